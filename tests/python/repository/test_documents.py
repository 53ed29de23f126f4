"""The documentation is whole: its links, its scripts, its site."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY
from documents import DOCUMENTS, run

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
    for page, shown in {
        "reference/python/classes/completer": "dynmesh.Completer.restore",  # inherited
        "reference/cpp": '<h3 id="register_template">',
        "reference/c": '<h3 id="dynmesh_push_sparse">',
        "reference/commands": "--drop-above",
        "gallery": 'href="walker.html"',
        "results": "<td>biharmonic on motion (libigl)</td>",
        "method": "<math",
    }.items():
        assert shown in (tmp_path / page / "index.html").read_text()
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
        assert path.suffix not in (".png", ".webp") or path.stat().st_size < 700_000, target
        assert not anchor or path.suffix != ".md" or anchor in anchors(path), target
