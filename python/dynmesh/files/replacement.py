"""Moves finished files to their destinations, several of them almost atomically."""

import contextlib
import json
import os
import shutil
import zlib
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from .kept import CannotResumeError

_plan = "placing.json"


def put_in_place(
    folder: Path, places: Mapping[str, Path], outdated: Iterable[Path], *, plan: bool
) -> None:
    """Moves the files in a folder to their destinations, in order, and removes outdated ones.

    If there are several, the files that they replace are removed first, starting with the last. So
    the files that exist before the last one is moved are a beginning of the new or of the older
    sequence, and never a mixture. With `plan`, :func:`finish_placing` can continue in that folder
    after the process was killed.

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


def finish_placing(folder: Path, existing: Collection[Path], folders: Collection[Path]) -> bool:
    """Finishes a :func:`put_in_place` that was killed; returns whether all files are in place.

    If a file has since been removed or changed at its destination, nothing is done. Only `existing`
    files may be removed or replaced, and files be put in `folders`.

    Raises:
        CannotResumeError: what was to be done is damaged, or not among what may be done.
        OSError: a file cannot be moved.
    """
    plan = _load(folder, existing, folders)
    if plan is None:
        return False
    places, stamps, remove = plan
    for name, place in places.items():
        file = folder / name if (folder / name).exists() else place
        if not file.exists() or _stamp(file) != stamps[name]:
            (folder / _plan).unlink()
            return False
    for outdated in remove:
        outdated.unlink(missing_ok=True)
    _move(folder, places)
    return True


def remove_placed(folder: Path) -> None:
    """Removes a folder whose files are in place; the plan, which says so, last."""
    with contextlib.suppress(OSError):
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name == _plan):
            if entry.is_dir():
                shutil.rmtree(entry)
            else:
                entry.unlink()
        folder.rmdir()


def _load(
    folder: Path, existing: Collection[Path], folders: Collection[Path]
) -> tuple[dict[str, Path], dict[str, list[int]], list[Path]] | None:
    """Reads what :func:`_save` wrote. Its bytes may be damaged, so its names are not used."""
    file = folder / _plan
    try:
        text, seal = file.read_bytes().split(b"\n")
        if int(seal) != zlib.crc32(text):
            raise ValueError
        plan = json.loads(text)
        stamps = plan["stamps"]
        places = {name: _absolute(folder / place) for name, place in plan["places"].items()}
        remove = [_absolute(folder / place) for place in plan["remove"]]
        if not places.keys() == stamps.keys():
            raise ValueError
    except (FileNotFoundError, NotADirectoryError):
        return None
    except IsADirectoryError as error:
        raise CannotResumeError("is a folder", file=file) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise CannotResumeError("is damaged or of an earlier version", file=file) from error
    may_hold = set(map(_absolute, folders))
    may_go = set(map(_absolute, existing))
    for name, place in places.items():
        if name == _plan or place.name != name or place.parent not in may_hold:
            raise CannotResumeError(f"would put {name!r} at {place}", file=file)
    for place in remove:
        if place not in may_go and os.path.lexists(place):
            raise CannotResumeError(
                f"would remove {place}, which is no file of the output", file=file
            )
    return places, stamps, remove


def _absolute(place: Path) -> Path:
    """The place without "..", which may itself be a link."""
    return Path(os.path.normpath(place.absolute()))


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
    text = json.dumps(plan).encode()
    partial = folder / f"{_plan}.part"
    partial.write_bytes(b"%s\n%d" % (text, zlib.crc32(text)))
    partial.replace(folder / _plan)
