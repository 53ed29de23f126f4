"""The documentation is whole: its links, its scripts, its site."""

import os
import re
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from conftest import REPOSITORY
from documents import DOCUMENTS, blocks, run

from dynmesh.cli import VERBS


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


INDEX_PAGE = runpy.run_path(str(REPOSITORY / "cmake" / "index_page.py"))
"""What an index of packages shows."""


def test_the_page_of_an_index_links_to_files_of_the_release() -> None:
    made = INDEX_PAGE["dynamic_metadata"]({}, {"version": "1.2.3"})
    links = [*re.findall(r"\]\((\S+?)\)", made["readme"]["text"]), *made["urls"].values()]
    assert all(link.startswith("https://") for link in links)
    release = re.compile(rf"{INDEX_PAGE['REPOSITORY']}/(?:blob|raw)/v1\.2\.3/([^#]+)")
    files = [match[1] for link in links if (match := release.match(link))]
    assert len(files) > 10
    assert not [name for name in files if not (REPOSITORY / name).exists()]


def test_a_release_has_an_address() -> None:
    tags = subprocess.run(
        ["git", "tag", "--points-at", "HEAD"],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    ).stdout.split()
    if os.environ.get("GITHUB_REF_TYPE") == "tag" or any(tag.startswith("v") for tag in tags):
        assert not INDEX_PAGE["REPOSITORY"].endswith(".invalid")


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
