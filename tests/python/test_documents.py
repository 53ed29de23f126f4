"""Every command and snippet of the documents does what it says."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text()


SHORTER = {
    "docs/make_figures --page": "docs/make_figures --draft --page",
    "dynmesh synth walker walker.npz\n": "dynmesh synth walker walker.npz --frames 8\n",
}
"""Commands of the pages that run on less than they say: no page quotes what these print."""


def blocks(language: str, document: str = README) -> list[str]:
    """The code blocks of one language, in their order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", document, flags=re.DOTALL | re.MULTILINE)


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
    alone = subprocess.run([sys.executable, example], capture_output=True, text=True, check=False)
    assert (alone.returncode, alone.stderr.partition(":")[0]) == (1, "usage")
    completed = np.load(tmp_path / "completed.npz")["vertices"]
    np.testing.assert_array_equal(np.load(tmp_path / "again.npz")["vertices"], completed)


def build(folder: Path, programs: Path) -> Path:
    """Builds the CMake project in `folder` against an installed dynmesh."""
    run("cmake", "--install", programs, "--prefix", folder / "prefix", cwd=folder)
    run("cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={folder / 'prefix'}", cwd=folder)
    run("cmake", "--build", "build", cwd=folder)
    return folder / "build"


def test_cpp(tmp_path: Path, programs: Path) -> None:
    (snippet,) = blocks("cpp")
    (project,) = blocks("cmake")
    (tmp_path / "main.cpp").write_text(snippet)
    (tmp_path / "CMakeLists.txt").write_text(project)
    shown = run(build(tmp_path, programs) / "mine", cwd=tmp_path)
    assert shown == "2 filled in, vertex 1 is at height 5\n"


def test_the_two_commands_are_there() -> None:
    (snippet,) = blocks("console")
    for line in snippet.splitlines():
        script = REPOSITORY / line.split()[0]
        assert os.access(script, os.X_OK)
    ci = (REPOSITORY / ".ci" / "run").read_text()
    assert "script/test" in ci


def test_the_table_of_errors_is_what_the_command_prints(data: Path) -> None:
    printed = run(sys.executable, "-m", "benchmarks.nmsve_table", data, cwd=REPOSITORY)
    assert printed.strip() in README


@pytest.mark.parametrize(
    "name", ["docs/diagnosis.md", "docs/formats.md", "docs/gallery.md", "docs/method.md"]
)
def test_pages_do_what_they_say(name: str, tmp_path: Path) -> None:
    document = (REPOSITORY / name).read_text()
    for folder in ("benchmarks", "docs"):  # commands name files of the repository
        (tmp_path / folder).symlink_to(REPOSITORY / folder)
    for whole, less in SHORTER.items():
        document = document.replace(whole, less)
    printed = [run("bash", "-euc", snippet, cwd=tmp_path) for snippet in blocks("bash", document)]
    # The snippets of a page build on one another, as they do for its reader.
    printed.append(run(sys.executable, "-c", "\n".join(blocks("python", document)), cwd=tmp_path))
    for text in printed:
        for table in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
            assert table in document
    if name == "docs/diagnosis.md":
        (answer,) = blocks("console", document)
        assert answer in "".join(f"{line.rstrip()}\n" for line in printed[0].splitlines())
    page = Path(name).stem
    shown = set(re.findall(rf"\]\((figures/{page}/.*?)\)", document))
    if find_spec("igl") is None:
        shown.discard("figures/method/hidden_side.png")
    assert shown == {str(p.relative_to(tmp_path)) for p in tmp_path.glob(f"figures/{page}/*")}


def test_the_map_of_the_code_is_whole() -> None:
    document = (REPOSITORY / "CONTRIBUTING.md").read_text()
    _, _, rest = document.partition("\n## Where everything is\n")
    named = set(re.findall(r"`(\w+)`", rest.partition("\n## ")[0]))
    folders = [REPOSITORY / "cpp" / name for name in ("src", "include/dynmesh", "apps")]
    files = [path for folder in folders for path in folder.iterdir()]
    stems = {path.stem for path in files if path.suffix in (".cpp", ".hpp")}
    assert len(stems) > 40
    assert not stems - named


def anchors(document: Path) -> set[str]:
    """Of its headings, as they are made where Markdown is shown."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize(
    "document",
    [*sorted(REPOSITORY.glob("*.md")), *sorted((REPOSITORY / "docs").rglob("*.md"))],
    ids=lambda path: str(path.relative_to(REPOSITORY)),
)
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text()):
        if target.startswith("https://"):
            continue
        place, _, anchor = target.partition("#")
        path = document.parent / place if place else document
        assert path.exists(), target
        assert path.suffix != ".png" or path.stat().st_size < 300_000, target
        assert not anchor or path.suffix != ".md" or anchor in anchors(path), target
