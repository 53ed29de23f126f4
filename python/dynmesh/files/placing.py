"""How finished files get their places, several of them as if they were one."""

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

_plan = "placing.json"


def put_in_place(
    folder: Path, places: Mapping[str, Path], outdated: Iterable[Path], *, plan: bool
) -> None:
    """Moves finished files to their places, the last one last.

    Where there are several, what they replace goes first, from the last one on: what is there
    until the last one is in its place is the beginning of the new sequence or of the older one,
    and never a mixture.

    Args:
        folder: where the files are.
        places: where each is to go, by its name.
        outdated: further files to remove.
        plan: whether :func:`finish_placing` shall be able to go on in that folder.

    Raises:
        OSError: a file cannot be moved.
    """
    remove = list(outdated)
    if remove or len(places) > 1:
        older = [place for place in places.values() if place.exists()]
        remove = [*reversed(older), *remove]
    if plan:
        stamps = {name: _stamp(folder / name) for name in places}
        _save(folder, places, stamps, remove)
    for file in remove:
        file.unlink(missing_ok=True)
    if plan and remove:
        _save(folder, places, stamps, [])
    _move(folder, places)


def finish_placing(folder: Path) -> bool:
    """Does what is left to do where :func:`put_in_place` was killed; whether all is in place.

    It is, too, where the folder is empty or gone.

    Where somebody has since removed or changed what was in its place already, nothing is done.

    Raises:
        OSError: a file cannot be moved.
    """
    try:
        plan: dict[str, Any] = json.loads((folder / _plan).read_text())
    except FileNotFoundError:
        return not folder.exists() or not any(folder.iterdir())
    places = {name: folder / place for name, place in plan["places"].items()}
    for name, place in places.items():
        file = folder / name if (folder / name).exists() else place
        if not file.exists() or _stamp(file) != plan["stamps"][name]:
            (folder / _plan).unlink()
            return False
    for outdated in plan["remove"]:
        (folder / outdated).unlink(missing_ok=True)
    _move(folder, places)
    return True


def _move(folder: Path, places: Mapping[str, Path]) -> None:
    for name, place in places.items():
        if (folder / name).exists():
            place.parent.mkdir(exist_ok=True)
            (folder / name).replace(place)


def _stamp(file: Path) -> list[int]:
    """What a file keeps while it is moved, and loses when it is written."""
    found = file.stat()
    return [found.st_size, found.st_mtime_ns]


def _save(
    folder: Path, places: Mapping[str, Path], stamps: Mapping[str, list[int]], remove: list[Path]
) -> None:
    plan = {
        "places": {name: os.path.relpath(place, folder) for name, place in places.items()},
        "stamps": stamps,
        "remove": [os.path.relpath(file, folder) for file in remove],
    }
    partial = folder / f"{_plan}.part"
    partial.write_text(json.dumps(plan))
    partial.replace(folder / _plan)
