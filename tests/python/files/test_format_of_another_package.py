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
from commands import dynmesh_command as run
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


class Reader(dynmesh.frames.FileFrames):
    """Frames of a file, of which `bad` are made otherwise."""

    def __init__(self, path: Path, bad: Callable[[], Any]) -> None:
        super().__init__(path, SEA.header)
        self._bad = bad

    def _frames(self, numbers: Any) -> Iterator[Any]:
        frames = [*SEA[:2], *self._bad()]
        yield from (frames[number] for number in numbers if number < len(frames))


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda _: NOTHING["faces"], "KeyError: 'faces'"),
        (lambda _: None, "it returns NoneType, not"),
        (lambda: SEA, "TypeError"),
        (lambda _: dynmesh.convert(dynmesh.frames.Kept(SEA)), "it returns Run, not"),
        (lambda path: Reader(path, lambda: NOTHING["points"]), "KeyError: 'points'"),
        (lambda path: Reader(path, lambda: SEA[2:3]), "it yields NoneType, not a Frame"),
        (lambda path: Reader(path, lambda: sea(2, grid=4)), "of shape"),
    ],
)
def test_what_a_reader_does_wrong_is_told(
    install: Install, tmp_path: Path, read: Any, said: str
) -> None:
    install(lambda: mine(read=read))
    (tmp_path / "a.mine").touch()
    for words in (
        ("info", tmp_path / "a.mine"),
        ("complete", tmp_path / "a.mine", tmp_path / "b.npz"),
    ):
        error = run(*words, code=1).stderr
        assert "a.mine: " in error
        assert "format mine cannot read it" in error or said == "of shape"
        assert said in error
    assert not (tmp_path / "b.npz").exists()


def write_badly(path: Path, frames: Any, content: bytes = b"x", said: Any = None) -> Any:
    assert [*frames]
    path.write_bytes(content)
    return said


@pytest.mark.parametrize(
    ("write", "said"),
    [
        (lambda *given: [*given[2]] and None, "has written no file"),
        (lambda path, _, all: write_badly(path, all, content=b""), "no file"),
        (lambda *_: NOTHING["fps"], "KeyError: 'fps'"),
        (lambda path, _, all: write_badly(path, all, said="ok"), "returns str, not remarks"),
    ],
)
def test_what_a_writer_does_wrong_is_told(
    install: Install, tmp_path: Path, write: Any, said: str
) -> None:
    install(lambda: mine(write=write))
    dynmesh.write(tmp_path / "in.npz", SEA)
    output = tmp_path / "out" / "a.mine"
    error = run("convert", tmp_path / "in.npz", output, code=1).stderr
    assert f"{output}: format mine cannot write it: " in error
    assert said in error
    assert not output.parent.exists()


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
    install(lambda: mine(read=lambda path: Reader(path, lambda: SEA[2:])))
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a.mine").vertices, SEA.vertices)
