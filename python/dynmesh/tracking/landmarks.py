"""Landmarks in files: one for every scan, or a folder with one for each."""

import json
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError
from ..files.naming import naming
from ..files.numbered import files_in
from ..registration import Landmarks
from ..scans.reader import CAMERAS

_SUFFIX = ".json"


def landmark_files(path: Path | None) -> list[Path]:
    """Returns the files with landmarks: that of the path, or all of a folder but the cameras."""
    if path is None:
        return []
    if not path.is_dir():
        return [path]
    return [file for file in files_in(path, _SUFFIX) if file.name != CAMERAS]


def landmarks_of(path: Path | None, scans: SequenceOf[Path]) -> list[Landmarks | None]:
    """Reads the landmarks of each scan: of one file, or, in a folder, of that of its name.

    Args:
        path: of the file or the folder; None means that there are none.
        scans: the paths of the scans.

    Raises:
        OSError, ValueError: as :func:`read_landmarks`; or the folder holds no landmarks, or those
            of something else.
    """
    if path is None or not path.is_dir():
        return [None if path is None else read_landmarks(path)] * len(scans)
    found = {file.stem: file for file in landmark_files(path)}
    stems = [scan.stem for scan in scans]
    if not found:
        raise InputError(
            f"holds no landmarks; those of {scans[0].name} would be in {stems[0]}{_SUFFIX}",
            file=path,
        )
    for stem, file in found.items():
        if stem not in stems:
            raise InputError(
                "belongs to no scan; name landmarks as their scan, such as "
                f"{stems[0]}{_SUFFIX} for {scans[0].name}",
                file=file,
            )
    return [read_landmarks(found[stem]) if stem in found else None for stem in stems]


def landmark_remarks(path: Path | None, used: SequenceOf[bool]) -> tuple[str, ...]:
    """What the user should know of the landmarks of several scans, of which some were used."""
    n = len(used)
    if path is None or n == 1:
        return ()
    if not path.is_dir():
        return (f"the landmarks of {path} were used for all {n} scans; a folder can hold others",)
    without = n - sum(used)
    return (f"{without} of {n} scans had no landmarks in {path}",) if without else ()


def read_landmarks(path: Path) -> Landmarks:
    """Reads the landmarks of a JSON file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is not as :func:`register_file` describes; the message names the landmark.
    """
    with naming(path):
        try:
            given = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"is not JSON: {error}") from None
        if not isinstance(given, list) or not given:
            raise ValueError("must be a list of landmarks, with at least one")
        rows = [_landmark(number, one) for number, one in enumerate(given)]
    return np.array([vertex for vertex, _ in rows]), np.array([place for _, place in rows])


def _landmark(number: int, given: Any) -> tuple[int, list[float]]:
    if not isinstance(given, dict) or given.keys() != {"vertex", "position"}:
        raise ValueError(
            f"landmark {number} must have a vertex and a position and nothing else, not {given!r}"
        )
    vertex, position = given["vertex"], given["position"]
    if isinstance(vertex, bool) or not isinstance(vertex, int) or not 0 <= vertex < 2**31:
        raise ValueError(f"landmark {number}: the vertex must be an index, not {vertex!r}")
    is_place = isinstance(position, list) and len(position) == 3
    if not is_place or not all(
        isinstance(x, int | float) and not isinstance(x, bool) for x in position
    ):
        raise ValueError(f"landmark {number}: the position must be three numbers, not {position!r}")
    return vertex, [float(x) for x in position]
