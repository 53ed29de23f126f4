"""Writes the tables of bad input of the site into the folder build, for ``script/docs``.

Needs the compiled programs, as ``cmake --preset develop; cmake --build --preset develop`` makes
them.
"""

from bad_input.page import PATH, page
from conftest import REPOSITORY

if __name__ == "__main__":
    PATH.parent.mkdir(parents=True, exist_ok=True)
    PATH.write_text(page(REPOSITORY / "build" / "develop"))
