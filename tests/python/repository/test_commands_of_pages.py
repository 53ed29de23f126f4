"""The commands and code in the documentation work as described."""

import argparse
import contextlib
import io
import re
import runpy
import shlex
import sys
from itertools import groupby
from pathlib import Path
from unittest import mock

import pytest
from commands import run_here
from conftest import REPOSITORY
from documents import DOCS, DOCUMENTS, PROGRAMS, README, blocks, run, with_tables

import dynmesh
from benchmarks import __main__ as benchmarks

SHORTER = {
    "benchmarks.figures --page": "benchmarks.figures --draft --page",
    "dynmesh synth walker walker.npz\n": "dynmesh synth walker walker.npz --frames 8\n",
    "dynmesh synth walker figure.npz --frames 20\n": "dynmesh synth walker figure.npz --frames 5\n",
    "dynmesh.synth.walker()[:60]": "dynmesh.synth.walker()[:3]",
    "d.read('walker.npz')[:20]": "d.read('walker.npz')[:5]",
}
"""Commands of the pages that are run with less data here; pages quote nothing else of them."""


SIMPLE = re.compile(r"(dynmesh|script/reproduce|python -m benchmarks\.\S+)( [^$|<>;&*?`(){}\\]*)?")
"""A command that needs no shell."""


def run_module(name: str, *arguments: str) -> str:
    """Runs `python -m` in this process, and returns what is printed."""
    output = io.StringIO()
    with mock.patch.object(sys, "argv", [name, *arguments]), contextlib.redirect_stdout(output):
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    return output.getvalue()


def run_shell(snippet: str, cwd: Path) -> str:
    """Runs lines of a shell, and returns what they print; one that fails ends them.

    Commands of dynmesh and benchmarks that need no shell are run in this process: to start a
    process takes longer than most of them do.
    """
    printed = ""
    lines = snippet.replace("\\\n", " ").splitlines()
    for here, group in groupby(lines, key=lambda line: bool(SIMPLE.fullmatch(line))):
        if not here:
            printed += run("bash", "-euc", "\n".join(group), cwd=cwd)
            continue
        for line in group:
            program, *arguments = shlex.split(line, comments=True)
            with contextlib.chdir(cwd):
                if program == "python":
                    printed += run_module(*arguments[1:])
                    continue
                if program == "script/reproduce":
                    printed += run_module("benchmarks", *arguments)
                    continue
                result = run_here(*arguments, columns=80)
            assert result.returncode == 0, result.stdout + result.stderr
            printed += result.stdout
    return printed


@pytest.mark.slow
def test_the_python_of_the_readme(tmp_path: Path) -> None:
    (snippet,) = blocks("python")
    (quoted,) = re.findall(r"It prints (\d\.\d+):", README)
    assert run(sys.executable, "-c", snippet, cwd=tmp_path) == f"{quoted}\n"


@pytest.mark.slow
def test_the_shell_of_the_readme(tmp_path: Path) -> None:
    walker = dynmesh.synth.walker()[:6]
    dynmesh.write(tmp_path / "body.obj", walker[:1])
    dynmesh.write(tmp_path / "cache.usdc", dynmesh.degrade(walker, camera=1))
    dynmesh.write(tmp_path / "walker.npz", walker)
    run_shell("dynmesh degrade walker.npz depth --depth 320x240 --cameras 2\n", tmp_path)
    for snippet in blocks("bash"):
        run_shell(snippet, tmp_path)
    assert (tmp_path / "quality.csv").read_text().count("good") == 6
    assert (tmp_path / "completed.usdc").exists()
    assert (tmp_path / "tracked.html").exists()


def assert_shown(printed: str, document: str) -> None:
    """Checks that a table of the document has the head and all rows of each table."""
    printed_tables, tables = (
        [set(table.splitlines()) for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)]
        for text in (printed, document)
    )
    for rows in printed_tables:
        assert any(rows <= shown for shown in tables), rows


def long_commands() -> set[str]:
    """The commands of measurements that pages show and no test runs."""
    lines = "".join("".join(blocks("console", page.read_text())) for page in DOCUMENTS).splitlines()
    return {
        line for line in lines if line.startswith((*benchmarks.MODULES, "python -m benchmarks"))
    }


@pytest.mark.filterwarnings("ignore:'benchmarks:RuntimeWarning")  # another test imported it
@pytest.mark.parametrize("command", sorted(long_commands()))
def test_long_commands_are_understood(command: str) -> None:
    program, *arguments = shlex.split(command, comments=True)
    module = benchmarks.MODULES.get(program) or arguments[1]
    if program == "python":
        del arguments[:2]
    parse = argparse.ArgumentParser.parse_args

    def parse_alone(parser: argparse.ArgumentParser) -> None:
        parse(parser)
        raise StopIteration

    with (
        mock.patch.object(argparse.ArgumentParser, "parse_args", parse_alone),
        pytest.raises(StopIteration),
    ):
        run_module(module, *arguments)


def test_one_command_makes_every_table_and_picture(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """And then compares the pages."""
    started = list[list[str]]()
    monkeypatch.setattr(benchmarks, "run", lambda *words: started.append([*words]))
    monkeypatch.setattr(sys, "argv", ["script/reproduce", "all", str(tmp_path), "--docs"])
    benchmarks.main()
    made = {words[1] for words in started if words[0] == "benchmarks"}
    assert made == benchmarks.TABLES.keys() - {"all"}
    assert {words[0] for words in started[:-1]} == {
        *benchmarks.MODULES.values(),
        "benchmarks.figures",
    }
    assert started[-1][0] == "pytest"
    assert "FOLDER" not in str(started)
    out = [words[words.index("--out") + 1] for words in started[:-1]]
    assert {str(DOCS / "figures" / name) for name in ("builtin", "recorded")} <= {*out}


PAGES = (
    "docs/diagnosis.md",
    "docs/formats.md",
    "docs/guides/recordings.md",
    "docs/guides/training.md",
    "docs/guides/research.md",
    "docs/guides/scene_caches.md",
    "docs/guides/shell.md",
    "docs/guides/templates.md",
    "docs/guides/track.md",
    "docs/method.md",
    "docs/paper.md",
    "docs/results.md",
    "docs/speed.md",
    "docs/tutorial.md",
)


def outputs(snippets: list[str], cwd: Path) -> list[str]:
    """Returns the output of each snippet; each builds on the previous ones."""
    end = "-- end of a snippet --"
    whole = "".join(f"{snippet}\nprint({end!r})\n" for snippet in snippets)
    return run(sys.executable, "-c", whole, cwd=cwd).split(f"{end}\n")[:-1]


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
@pytest.mark.usefixtures("coarse_figures")
@pytest.mark.filterwarnings("ignore:'benchmarks:RuntimeWarning")  # another test imported it
def test_pages_do_what_they_say(name: str, tmp_path: Path) -> None:
    document = with_tables(REPOSITORY / name)
    for whole, less in SHORTER.items():
        document = document.replace(whole, less)
    for folder in ("benchmarks", "docs"):  # commands name files of the repository
        (tmp_path / folder).symlink_to(REPOSITORY / folder)
    printed: list[str] = []
    if name == "docs/tutorial.md":  # there, commands use files that Python code wrote
        printed += outputs(blocks("python", document), tmp_path)
    printed += [run_shell(snippet, tmp_path) for snippet in blocks("bash", document)]
    if name != "docs/tutorial.md":
        printed += outputs(blocks("python", document), tmp_path)
    for text in printed:
        assert_shown(text, document)
    for answer in blocks("text", document):
        assert answer in printed
    if name == "docs/diagnosis.md":
        (answer,) = blocks("console", document)
        assert answer in "".join(f"{line.rstrip()}\n" for line in printed[0].splitlines())
    folder = f"figures/{Path(name).stem}"
    shown = set(re.findall(rf"\]\((?:\.\./)?({folder}/.*?)\)", document))
    assert shown == {str(p.relative_to(tmp_path)) for p in tmp_path.glob(f"{folder}/*")}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["memory", "motion", "properties"])
def test_the_programs_of_pages_hold(name: str, tmp_path: Path) -> None:
    """They end with assertions, or measure."""
    run(sys.executable, PROGRAMS / f"{name}.py", cwd=tmp_path)
