"""The commands and code in the documentation work as described."""

import argparse
import contextlib
import io
import os
import re
import runpy
import shlex
import sys
import tomllib
from itertools import groupby
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from commands import run_here
from conftest import REPOSITORY
from documents import DOCS, PROGRAMS, README, blocks, cells, run

import dynmesh
from dynmesh.cli import VERBS

TABLE = re.compile(r"^\[[^\]]+\]\(([^)\s]+\.csv)\)$", re.MULTILINE)
"""A reference to a table of measurements, in whose place the site shows it."""


SHORTER = {
    "script/reproduce two-readings\n": "script/reproduce two-readings --known 0.3\n",
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
    (quoted,) = re.findall(r"This prints (\d\.\d+),", README)
    assert run(sys.executable, "-c", snippet, cwd=tmp_path) == f"{quoted}\n"


@pytest.mark.slow
def test_the_shell_of_the_readme(tmp_path: Path) -> None:
    walker = dynmesh.synth.walker()[:6]
    dynmesh.write(tmp_path / "body.obj", walker[:1])
    dynmesh.write(tmp_path / "cache.usdc", dynmesh.degraded(walker, camera=1))
    dynmesh.write(tmp_path / "walker.npz", walker)
    run_shell("dynmesh degrade walker.npz depth --depth 320x240 --cameras 2\n", tmp_path)
    for snippet in blocks("bash"):
        run_shell(snippet, tmp_path)
    assert (tmp_path / "quality.csv").read_text().count("good") == 6
    assert (tmp_path / "completed.usdc").exists()
    assert (tmp_path / "tracked.html").exists()


def with_tables(page: Path) -> str:
    """Returns a page as its site shows it, with tables in the place of references to them."""

    def shown(match: re.Match[str]) -> str:
        head, *rows = (f"| {' | '.join(row)} |\n" for row in cells(page.parent / match[1]))
        return "".join([head, f"|{'---|' * (head.count('|') - 1)}\n", *rows])

    return TABLE.sub(shown, page.read_text())


def assert_shown(printed: str, document: str) -> None:
    """Checks that a table of the document has the head and all rows of each table."""
    printed_tables, tables = (
        [set(table.splitlines()) for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)]
        for text in (printed, document)
    )
    for rows in printed_tables:
        assert any(rows <= shown for shown in tables), rows


RIVALS = (
    "biharmonic on motion (libigl)",
    "ARAP (libigl)",
    "ARAP from the previous frame (libigl)",
)


def errors_of_methods() -> dict[tuple[str, str], dict[str, float]]:
    """The errors of the table of methods, relative to that of motion, by sequence and loss."""
    (_, _, of_motion, *methods), *measured = cells(DOCS / "tables" / "methods.csv")
    assert of_motion == "motion, x 1e4"
    return {
        (sequence.partition(",")[0], known): dict(
            zip(["motion", *methods], map(float, values), strict=True)
        )
        for sequence, known, *values in measured
        if sequence != "crane, 80 frames"
    }


def as_number(cell: str) -> float:
    return np.inf if cell == "-" else float(cell)


def test_the_table_of_the_readme_is_that_of_the_results() -> None:
    names = {
        "person": "crane",
        "horse": "horse_gallop",
        "face": "ict_face_arkit",
        "sea": "ocean_sim_50x50",
        "flag": "flag_sim_50x50",
    }
    errors = errors_of_methods()
    (_, *losses), *measured = cells(DOCS / "tables" / "crane.csv")
    times = {
        (row[0], loss): cell.split("; ")[1].removesuffix(" ms")
        for row in measured
        for loss, cell in zip(losses, row[1:], strict=True)
        if cell != "-"
    }
    built_in = {(row[0], row[1]): row[2:] for row in cells(DOCS / "tables/rivals-completion.csv")}
    timed = ("detail (dynmesh)", "motion (dynmesh)", RIVALS[0], RIVALS[1])
    checked = 0
    for line in re.findall(r"^\| (.*) \|$", README, flags=re.MULTILINE):
        case, *shown = (cell.strip() for cell in line.split("|"))
        subject, _, loss = case.rpartition(", ")
        if subject in names:
            row = errors[
                names[subject], loss.removesuffix(" known").replace("one camera", "camera")
            ]
            relative = [row["detail"], 1, row[RIVALS[0]], min(row[RIVALS[1]], row[RIVALS[2]])]
            assert shown == [f"{row['motion'] * times:.2g}" for times in relative], case
            checked += 1
        elif (key := (subject, loss.removesuffix(" known").replace("one ", ""))) in built_in:
            ours, motion, biharmonic, *arap = built_in[key][:5]
            assert shown == [ours, motion, biharmonic, min(arap, key=as_number)], case
            checked += 1
        elif loss in ("10 % known", "30 % known", "one camera"):
            known = {"30 % known": "30 %", "one camera": "camera"}.get(loss, loss)
            assert shown == [times[method, known] for method in timed], case
            checked += 1
    assert checked == 14


def test_what_the_readme_claims_is_what_the_tables_show() -> None:
    relative = [
        row["detail"] / min(row[one] for one in RIVALS) for row in errors_of_methods().values()
    ]
    assert len(relative) == 30
    told = " ".join(README.split())
    (mean,) = re.findall(r"On 30 cases .*? error is (\S+) times .*? in three cases libigl", told)
    assert mean == f"{np.exp(np.log(relative).mean()):.2f}"
    assert sum(one > 1 for one in relative) == 3
    _, *measured = cells(DOCS / "tables" / "crane.csv")
    detail, biharmonic = (
        np.array([float(cell.split("; ")[1].removesuffix(" ms")) for cell in row[1:]])
        for name in ("detail (dynmesh)", RIVALS[0])
        for row in measured
        if row[0] == name
    )
    ratios = detail / biharmonic
    spans = re.findall(r"takes (\S+) to (\S+) ms, (\S+) to (\S+) times", told)
    most = f"{detail.min():.0f}", f"{detail.max():.0f}"
    assert spans == [(*most, f"{ratios.min():.2f}", f"{ratios.max():.2f}")]


def test_every_table_is_shown_and_whole() -> None:
    shown = {
        (page.parent / name).resolve()
        for page in DOCS.rglob("*.md")
        for name in TABLE.findall(page.read_text())
    }
    assert shown == {path.resolve() for path in (DOCS / "tables").iterdir()}
    for path in shown:
        head, *rows = cells(path)
        assert rows
        assert all(len(row) == len(head) for row in rows), path


def test_the_constants_in_the_pages_are_those_of_the_code() -> None:
    defined: dict[str, set[float]] = {}
    for folder in ("shape", "surface_fit"):
        text = (REPOSITORY / "cpp" / "src" / folder / "constants.hpp").read_text()
        for name, value in re.findall(r"^  \w+ (\w+) = ([-+\d.e]+);", text, flags=re.MULTILINE):
            defined.setdefault(name, set()).add(float(value))
    assert len(defined) > 50
    quoted = [
        (name, float(value))
        for page in DOCS.rglob("*.md")
        for name, value in re.findall(r"`(\w+)`\s=\s(-?\d+(?:\.\d+)?)", page.read_text())
    ]
    assert len(quoted) > 10
    assert not [(name, value) for name, value in quoted if value not in defined.get(name, ())]


DOCUMENTS = [*sorted(REPOSITORY.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
MEASURING = {"script/reproduce": "benchmarks", "script/dev/bench": "benchmarks.speed"}
"""The modules of scripts that take too long to be run by a test."""


def long_commands() -> set[str]:
    """The commands of measurements that pages show and no test runs."""
    lines = "".join("".join(blocks("console", page.read_text())) for page in DOCUMENTS).splitlines()
    return {line for line in lines if line.startswith((*MEASURING, "python -m benchmarks"))}


@pytest.mark.filterwarnings("ignore:'benchmarks:RuntimeWarning")  # another test imported it
@pytest.mark.parametrize("command", sorted(long_commands()))
def test_long_commands_are_understood(command: str) -> None:
    program, *arguments = shlex.split(command, comments=True)
    module = MEASURING.get(program) or arguments[1]
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


def test_the_scripts_that_pages_name_exist() -> None:
    named = {
        name
        for page in DOCUMENTS
        for name in re.findall(r"\bscript/(?:dev/)?[\w-]+", page.read_text())
    }
    assert len(named) > 10
    assert not [name for name in named if not os.access(REPOSITORY / name, os.X_OK)]


def test_continuous_integration_runs_the_commands_of_the_readme() -> None:
    commands = [line for line in blocks("console")[0].splitlines() if line.startswith("script/")]
    assert commands == ["script/demo", "script/test"]
    workflow = (REPOSITORY / ".github" / "workflows" / "ci.yml").read_text()
    assert set(commands) <= {line.strip() for line in workflow.splitlines()}
    last = (REPOSITORY / ".ci" / "run").read_text().splitlines()[-1]
    assert last == f"exec {commands[-1]} --all"


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
    "docs/results.md",
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
@pytest.mark.parametrize("name", ["motion", "properties"])
def test_the_programs_of_the_method_hold(name: str, tmp_path: Path) -> None:
    """They end with assertions."""
    run(sys.executable, PROGRAMS / f"{name}.py", cwd=tmp_path)


def test_every_dependency_has_a_row_with_its_extras() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"]
    uses = {"": project["project"]["dependencies"] + project["build-system"]["requires"], **extras}
    uses[""] += [n for g in project["dependency-groups"].values() for n in g if isinstance(n, str)]
    expected: dict[str, set[str]] = {}
    for extra, requirements in uses.items():
        for requirement in requirements:
            name = re.split(r"[^\w-]", requirement)[0]
            expected.setdefault(name, set()).update({extra} - {""})
    table = (REPOSITORY / "third_party_notes" / "README.md").read_text()
    rows = re.findall(r"^\| (.+?) \|.*\|.*\| ?(.*?) \|.*\|$", table, flags=re.MULTILINE)
    given = {
        name: set(re.findall(r"`(\w+)`", extra))
        for names, extra in rows
        for name in names.split(", ")
    }
    assert expected.items() <= given.items()


@pytest.mark.slow
def test_the_site_is_whole(tmp_path: Path) -> None:
    """Builds strictly: a broken link or anchor is an error."""
    run(sys.executable, "-m", "mkdocs", "build", "--strict", "-d", tmp_path, cwd=REPOSITORY)
    shown = (tmp_path / "reference" / "python" / "index.html").read_text()
    assert "Completes the next frame." in shown
    assert "dynmesh.Completer.restore" in shown  # inherited from what completer and tracker share
    for language, symbol in (("cpp", "register_template"), ("c", "dynmesh_push_sparse")):
        reference = (tmp_path / "reference" / language / "index.html").read_text()
        assert f'<h3 id="{symbol}">' in reference
    assert 'href="walker.html"' in (tmp_path / "gallery" / "index.html").read_text()
    assert (tmp_path / "gallery" / "walker.html").exists()
    commands = (tmp_path / "reference" / "commands" / "index.html").read_text()
    assert all(f'id="dynmesh-{verb}"' in commands for verb in VERBS)
    assert "--drop-above" in commands
    assert "<td>biharmonic on motion (libigl)</td>" in (tmp_path / "results/index.html").read_text()
    method = (tmp_path / "method" / "index.html").read_text()
    assert ">flatnonzero<" in method  # a program in the place of its link
    assert "<math" in method
    assert "arithmatex" not in method
    pages = "".join(page.read_text() for page in tmp_path.rglob("*.html"))
    loaded = re.findall(r"<(?:script|link|img)[^>]*?(?:src|href)=\"?(https?://[^\s\">]+)", pages)
    assert not loaded  # pages load nothing from elsewhere


def anchors(document: Path) -> set[str]:
    """Returns the anchors of the headings, as Markdown renderers generate them."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text()):
        if target.startswith("https://"):
            continue
        place, _, anchor = target.partition("#")
        path = document.parent / place if place else document
        assert path.exists(), target
        assert path.suffix != ".png" or path.stat().st_size < 300_000, target
        assert not anchor or path.suffix != ".md" or anchor in anchors(path), target
