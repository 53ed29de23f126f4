"""Moves finished files to their destinations, several of them almost atomically."""

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

_plan = "placing.json"


def put_in_place(
    folder: Path, places: Mapping[str, Path], outdated: Iterable[Path], *, plan: bool
) -> None:
    """Moves finished files to their destinations, in order.

    If there are several, the files that they replace are removed first, starting with the last. So
    the files that exist before the last one is moved are a beginning of the new or of the older
    sequence, and never a mixture.

    Args:
        folder: contains the files.
        places: destination of each file, by its name.
        outdated: further files to remove.
        plan: whether :func:`finish_placing` can continue in that folder after the process was
            killed.

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
    """Finishes a :func:`put_in_place` that was killed; returns whether all files are in place.

    The result is also True if the folder is empty or does not exist. If a file has since been
    removed or changed at its destination, nothing is done.

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
    """Returns what changes when a file is written, but not when it is moved."""
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
