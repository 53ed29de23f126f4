"""What an index of packages shows: addresses, and README with links that lead to them.

scikit-build-core calls this, as pyproject.toml says.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

REPOSITORY = "https://dynmesh.invalid"
"""The address of the repository, which is still missing; the tests refuse a release without it."""

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https:|#)([^)\s]+)\)")


def dynamic_metadata(_: Mapping[str, Any], project: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the addresses, and README."""
    tag = f"v{project['version']}"

    def absolute(link: re.Match[str]) -> str:
        kind = "raw" if link[1] else "blob"
        return f"{link[1]}[{link[2]}]({REPOSITORY}/{kind}/{tag}/{link[3]})"

    text = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    text = LINK.sub(absolute, text.replace("git clone URL", f"git clone {REPOSITORY}"))
    urls = {
        "Repository": REPOSITORY,
        "Documentation": f"{REPOSITORY}/blob/{tag}/docs/index.md",
        "Changelog": f"{REPOSITORY}/blob/{tag}/CHANGELOG.md",
        "Issues": f"{REPOSITORY}/issues",
    }
    return {"readme": {"content-type": "text/markdown", "text": text}, "urls": urls}
