"""Locations of data and programs, and common fixtures."""

import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

# Tests run in one process for each processor. Further threads of NumPy would compete with them, and
# wait for one another at full load. Programs that the tests start inherit this.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from meshes import Mesh, sheet

from dynmesh import _core
from dynmesh.draw import figures

REPOSITORY = Path(__file__).parents[2]

LONGER = int(os.environ.get("DYNMESH_FUZZ", "1"))
"""Factor for the number of random examples, which script/fuzz increases."""

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


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of recorded sequences, which are not part of the project."""
    folder = Path(os.environ.get("DYNMESH_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("the recorded sequences are not here; DYNMESH_DATA names their folder")
    return folder


@pytest.fixture(scope="session")
def programs() -> Path:
    """The folder of the compiled programs, built with the preset `develop`."""
    folder = Path(os.environ.get("DYNMESH_PROGRAMS", REPOSITORY / "build" / "develop"))
    if not (folder / "dynmesh-complete").exists():
        pytest.skip(
            "dynmesh-complete is not built: cmake --preset develop; cmake --build --preset develop"
        )
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
    whole = figures._stage

    def small(view: figures.View) -> AbstractContextManager[Any]:
        return whole(replace(view, size=(60, 80)))

    monkeypatch.setattr(figures, "_stage", small)
    style = pytest.importorskip("benchmarks.style")
    monkeypatch.setitem(style._STYLE, "figure.dpi", 20)
    layout = pytest.importorskip("matplotlib.layout_engine").ConstrainedLayoutEngine
    monkeypatch.setattr(layout, "execute", lambda *_: None)


PATIENCE = 10**8
"""How often a call looks whether another thread takes part, about a minute on an idle machine."""


@pytest.fixture
def shared_pieces() -> Iterator[Callable[[], int]]:
    """Returns the number of pieces of work that other threads have done since the test began.

    Completers in the test work in pieces of 64 vertices, and share them if there are two or more.
    Every call waits until another thread takes part.
    """
    usual = _core._set_task_sharing(chunk=64, short_chunk=64, fewest_pieces=2, patience=PATIENCE)
    before = _core._pieces_done_by_others()
    yield lambda: _core._pieces_done_by_others() - before
    _core._set_task_sharing(*usual)


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
