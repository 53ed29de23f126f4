"""Every command and snippet of the README does what it says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text()


def blocks(language: str) -> list[str]:
    """The code blocks of one language, in their order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)


def run(*command: str | Path, cwd: Path) -> str:
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    result = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def test_python(tmp_path: Path) -> None:
    (snippet,) = blocks("python")
    assert len(snippet.splitlines()) <= 12
    assert "NMSVE" in run(sys.executable, "-c", snippet, cwd=tmp_path)


def test_shell(tmp_path: Path) -> None:
    (snippet,) = blocks("bash")
    shown = run("bash", "-euc", snippet, cwd=tmp_path)
    (quoted,) = re.findall(r"the shell lines above give\s+([\d.]+)", README)
    assert quoted in shown
    example = REPOSITORY / "examples" / "python" / "complete_file.py"
    shown = run(sys.executable, example, "partial.npz", "again.npz", cwd=tmp_path)
    assert "frame 174: 3001 known, 7001 filled in" in shown
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "completed.npz").read_bytes()


@pytest.mark.usefixtures("programs")
def test_cpp(tmp_path: Path, programs: Path) -> None:
    (snippet,) = blocks("cpp")
    (project,) = blocks("cmake")
    (tmp_path / "main.cpp").write_text(snippet)
    (tmp_path / "CMakeLists.txt").write_text(project)
    run("cmake", "--install", programs, "--prefix", tmp_path / "prefix", cwd=tmp_path)
    run("cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={tmp_path / 'prefix'}", cwd=tmp_path)
    run("cmake", "--build", "build", cwd=tmp_path)
    shown = run(tmp_path / "build" / "mine", cwd=tmp_path)
    assert shown == "2 filled in, vertex 1 is at height 5\n"


def test_the_two_commands_are_there() -> None:
    (snippet,) = blocks("console")
    for line in snippet.splitlines():
        script = REPOSITORY / line.split()[0]
        assert os.access(script, os.X_OK)
    ci = (REPOSITORY / ".ci" / "run").read_text()
    assert "script/test" in ci


def test_the_table_of_errors_is_what_the_command_prints(data: Path, tmp_path: Path) -> None:
    table = REPOSITORY / "benchmarks" / "nmsve_table.py"
    printed = run(sys.executable, table, data, cwd=tmp_path)
    assert printed.strip() in README


@pytest.mark.parametrize("name", ["README.md", "docs/results.md"])
def test_links_lead_somewhere(name: str) -> None:
    document = REPOSITORY / name
    targets = re.findall(r"\]\(([^)#]+)\)", document.read_text())
    assert targets
    for target in targets:
        path = document.parent / target
        assert path.exists(), target
        assert path.suffix != ".png" or path.stat().st_size < 300_000, target
