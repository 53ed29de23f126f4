"""A format that another package brings, as docs/formats.md describes one."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from sequences import sea

import dynmesh
from dynmesh.formats import table

PAGE = (REPOSITORY / "docs" / "formats.md").read_text(encoding="utf-8")


def test_a_format_of_another_package_is_read_and_written(tmp_path: Path) -> None:
    module = (REPOSITORY / "docs" / "programs" / "raw_format.py").read_text(encoding="utf-8")
    (points,) = re.findall(r'```toml\n\[project.entry-points."(.*?)"\]\n(.*?)```', PAGE, re.DOTALL)
    package = tmp_path / "package"
    (package / "raw_format-1.0.dist-info").mkdir(parents=True)
    (package / "raw_format.py").write_text(module)
    (package / "raw_format-1.0.dist-info" / "METADATA").write_text("Name: raw_format\nVersion: 1.0")
    (package / "raw_format-1.0.dist-info" / "entry_points.txt").write_text(
        "[{}]\n{}".format(*points).replace('"', "")
    )
    partial = dynmesh.synth.ocean(4, grid=9)
    dynmesh.write(tmp_path / "a.npz", partial)
    script = f"""
import sys
sys.path.insert(0, {str(package)!r})
import dynmesh
with dynmesh.open("a.npz") as frames:
    dynmesh.write("a.raw", frames)
with dynmesh.complete("a.raw") as frames:
    dynmesh.write("b.npz", frames)
try:
    dynmesh.write("a.raw", dynmesh.open("a.raw"))
except ValueError as error:
    assert "is the input" in str(error), error
else:
    raise AssertionError
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)
    again = dynmesh.read(tmp_path / "b.npz")
    np.testing.assert_array_equal(again.vertices, partial.vertices)
    np.testing.assert_array_equal(again.faces, partial.faces)


SEA = sea(4)
NOTHING: dict[str, Any] = {}
Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs a package with this format, for files `.mine`."""

    def entry(make: Callable[[], Any]) -> None:
        point = SimpleNamespace(name="mine", value="package:mine", load=make)
        monkeypatch.setattr(table, "entry_points", lambda **_: [point])
        table.all_formats.cache_clear()

    yield entry
    table.all_formats.cache_clear()


def mine(**more: Any) -> dynmesh.formats.Format:
    def write(path: Path, _: dynmesh.Header, frames: Any) -> None:
        with path.open("wb") as file:
            np.save(file, np.stack([frame.points for frame in frames]))

    given: dict[str, Any] = {"suffixes": (".mine",), "read": lambda _: SEA, "write": write}
    return dynmesh.formats.Format(name="mine", **(given | more))


@pytest.mark.parametrize("loaded", [lambda: NOTHING["mine"], lambda: 3])
def test_what_cannot_be_loaded_is_told_and_others_work(install: Install, loaded: Any) -> None:
    install(loaded)
    with pytest.warns(UserWarning, match=r"format mine of package:mine cannot be loaded"):
        assert len(table.all_formats()) >= 10


def test_a_good_one_is_read_and_written(install: Install, tmp_path: Path) -> None:
    def read(path: Path) -> dynmesh.Sequence:
        return dynmesh.Sequence(np.load(path), SEA.faces)

    install(lambda: mine(read=read))
    dynmesh.write(tmp_path / "a.mine", SEA)
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a.mine").vertices, SEA.vertices)
