"""A format that another package brings, as docs/formats.md describes one."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY

import dynmesh

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


@pytest.mark.parametrize("content", ["raise OSError('is broken')", "raw = 3"])
def test_a_format_that_cannot_be_loaded_is_told_and_others_work(
    content: str, tmp_path: Path
) -> None:
    (tmp_path / "broken.py").write_text(content)
    (tmp_path / "broken-1.0.dist-info").mkdir()
    (tmp_path / "broken-1.0.dist-info" / "METADATA").write_text("Name: broken\nVersion: 1.0")
    entry = "[dynmesh.formats]\nraw = broken:raw"
    (tmp_path / "broken-1.0.dist-info" / "entry_points.txt").write_text(entry)
    script = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import dynmesh
print(len(dynmesh.formats.all_formats()))
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "format raw of broken:raw cannot be loaded" in run.stderr
    assert int(run.stdout) >= 10
