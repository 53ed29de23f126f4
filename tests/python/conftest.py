"""Locations of data and programs, and common fixtures."""

import os
import re
import shutil
import signal
from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

# Tests run in one process for each processor. Further threads of NumPy would compete with them, and
# wait for one another at full load. Programs that the tests start inherit this.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from meshes import Mesh, sheet

import dynmesh
from dynmesh.draw import figures

REPOSITORY = Path(__file__).parents[2]

LONGER = int(os.environ.get("DYNMESH_FUZZ", "1"))
"""Factor for the number of random examples, which script/dev/fuzz increases."""

SWIFT_SHADER = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SILENT = [
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
    "--no-first-run",
]
"""Options of Chromium: no graphics card, and no requests of its own."""

# The time of an example depends on the load of the machine, so there is no deadline, and drawing
# one may take long.
settings.register_profile(
    "dynmesh",
    deadline=None,
    derandomize=LONGER == 1,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("dynmesh")


SKIPS = (
    r"the recorded sequences are not here",  # they may not be redistributed
    r"Blender is not here",  # script/dev/interchange takes 1 GB for it
    r"the extension is not here",
    r"rustc is not here",
)
"""The starts of the reasons for which tests may be skipped; for any other, a skipped test fails."""


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Turns files that are skipped for a reason that is not listed into failures."""
    return _without_unlisted((yield))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Turns tests that are skipped for a reason that is not listed into failures."""
    return _without_unlisted((yield))


Report = TypeVar("Report", pytest.CollectReport, pytest.TestReport)


def _without_unlisted(report: Report) -> Report:
    if report.skipped and not hasattr(report, "wasxfail"):
        assert isinstance(report.longrepr, tuple)
        reason = report.longrepr[2].removeprefix("Skipped: ")
        if not any(re.match(listed, reason) for listed in SKIPS):
            report.outcome = "failed"
            report.longrepr = f"{reason} (skipped, but conftest.py does not list this reason)"
    return report


SLOW = {"chromium", "data", "shared_library"}
"""Fixtures whose tests run only in `script/test --all`."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Marks the tests that use these fixtures as slow."""
    for item in items:
        parameters = item.callspec.params if hasattr(item, "callspec") else {}
        if SLOW.intersection(item.fixturenames) - set(parameters):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of recorded sequences, which are not part of the project."""
    folder = Path(os.environ.get("DYNMESH_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("the recorded sequences are not here; DYNMESH_DATA names their folder")
    return folder


@pytest.fixture
def sequence_named(request: pytest.FixtureRequest) -> Callable[[str], dynmesh.Sequence]:
    """Returns a built-in sequence, or a recorded one."""

    def found(name: str) -> dynmesh.Sequence:
        if hasattr(dynmesh.synth, name):
            return getattr(dynmesh.synth, name)()  # type: ignore[no-any-return]
        return dynmesh.read(request.getfixturevalue("data") / f"{name}.npz")

    return found


def recorded(name: str, *more: Any) -> Any:
    """A parameter that names a recorded sequence, beside which a built-in one stands."""
    return pytest.param(name, *more, marks=pytest.mark.slow)


@pytest.fixture(scope="session")
def programs() -> Path:
    """The folder of the compiled programs, built with the preset `develop`."""
    folder = Path(os.environ.get("DYNMESH_PROGRAMS", REPOSITORY / "build" / "develop"))
    if not (folder / "dynmesh-complete").exists():
        pytest.skip("dynmesh-complete is not built: script/test -k version builds it")
    return folder


@pytest.fixture(scope="session")
def shared_library() -> Path:
    """The shared library, built by tests/install/run."""
    default = REPOSITORY / "build/shared/libdynmesh.so"
    path = Path(os.environ.get("DYNMESH_LIBRARY", default))
    if not path.exists():
        pytest.skip("the shared library is not built: tests/install/run builds it")
    return path


@pytest.fixture
def hearing_interrupts() -> Iterator[None]:
    """Child processes receive SIGINT, even if the tests themselves were started with it ignored.

    Child processes inherit that a signal is ignored, for example by nohup, but not handlers.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def mesh() -> Mesh:
    """A small sheet."""
    return sheet(7)


@pytest.fixture
def rng() -> np.random.Generator:
    """A random generator with a fixed seed."""
    return np.random.default_rng(0)


@pytest.fixture
def coarse_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are drawn quickly, with few pixels and no layout, if a test does not look at them."""
    whole = figures.render

    def small(faces: Any, points: Any, view: figures.View, *more: Any) -> figures.Image:
        return whole(faces, points, replace(view, size=(60, 80)), *more)

    monkeypatch.setattr(figures, "render", small)
    style = pytest.importorskip("benchmarks.style")
    monkeypatch.setitem(style._STYLE, "figure.dpi", 20)
    layout = pytest.importorskip("matplotlib.layout_engine").ConstrainedLayoutEngine
    monkeypatch.setattr(layout, "execute", lambda *_: None)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Chromium without a graphics card."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = os.environ.get("DYNMESH_CHROMIUM") or shutil.which("chromium")
    if program is None:
        pytest.skip("there is no Chromium: install it, or name it in DYNMESH_CHROMIUM")
    with playwright.sync_playwright() as driver:
        arguments = ["--no-sandbox", *SWIFT_SHADER, *SILENT]
        chromium = driver.chromium.launch(executable_path=program, args=arguments)
        yield chromium
        chromium.close()


@pytest.fixture
def browser(chromium: Any) -> Iterator[Any]:
    """A browser window without history."""
    window = chromium.new_context(viewport={"width": 900, "height": 600})
    window.set_default_timeout(600_000)
    yield window
    window.close()
