"""Writes docs/robustness/bad_input.md anew: ``python tests/python/write_bad_input.py``.

Needs the compiled programs, as ``cmake --preset develop; cmake --build --preset develop`` makes
them.
"""

from bad_input.page import PATH, page
from conftest import REPOSITORY

if __name__ == "__main__":
    PATH.parent.mkdir(exist_ok=True)
    PATH.write_text(page(REPOSITORY / "build" / "develop"))
