"""Masks of arrays, frames and sequences are carried or refused, wherever positions are taken."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from entries import ENTRIES, FRAME, FRAMES, KNOWN, MASKS, MESH
from sequences import sea

import dynmesh


def _masked(values: Any) -> Any:
    mask = np.zeros(values.shape, np.bool_)
    mask.flat[0] = True
    return np.ma.masked_array(values, mask)


def _carriers(values: Any) -> dict[str, Any]:
    """The same, with masks of their own."""
    if isinstance(values, tuple):
        *others, last = values
        return {given: (*others, one) for given, one in _carriers(last).items()}
    found = {"a masked array": _masked(values), "a list": list(_masked(values))}
    ages: Any = {"generation": MASKS[: len(values)].astype(int)}
    ages["age"] = ages["generation"]
    if values.shape == FRAMES.shape:
        found["a sequence with a mask"] = dynmesh.Sequence(values, MESH.faces, MASKS)
        found["a sequence with generations"] = dynmesh.Sequence(values, MESH.faces, **ages)
        found["a list of frames"] = [dynmesh.Frame(one, KNOWN) for one in values]
    elif values.shape == FRAME.shape:
        found["a frame with a mask"] = dynmesh.Frame(values, KNOWN)
        found["a frame with generations"] = dynmesh.Frame(values, generation=KNOWN.astype(int))
    return found


CASES = [
    pytest.param(name, argument, carrier, id=f"{name}, {argument}: {given}")
    for name, (_, arguments) in ENTRIES.items()
    for argument, values in arguments.items()
    if isinstance(values, np.ndarray | tuple)
    for given, carrier in _carriers(values).items()
    if not (argument == "out" and given != "a masked array")  # what is no array
    if not ((name, argument) == ("whole_frame", "frames") and "sequence" in given)  # carries it
]


@pytest.mark.parametrize(("name", "argument", "carrier"), CASES)
def test_a_mask_that_would_be_ignored_is_refused(
    name: str, argument: str, carrier: Any, tmp_path: Path
) -> None:
    call, given = ENTRIES[name]
    kinds = "(MaskedArray|MaskedConstant|Sequence|Frame)"
    with pytest.raises((TypeError, ValueError), match=f"{argument}: the .* of a {kinds} would be"):
        call(tmp_path, **given | {argument: carrier})


PARTIAL = sea(6, share=0.6)


def _measured(sequence: dynmesh.Sequence) -> Any:
    whole = sea(6)
    completed = dynmesh.read(dynmesh.complete(whole))
    return dynmesh.evaluate(completed, whole, input=sequence, only="missing").to_dict()


CARRYING: dict[str, Callable[[dynmesh.Sequence, Path], Any]] = {
    "complete": lambda s, _: dynmesh.read(dynmesh.complete(s)).vertices,
    "whole_frame": lambda s, _: dynmesh.whole_frames.whole_frame(s.faces, s).positions,
    "convert": lambda s, _: (
        dynmesh.read(dynmesh.complete(dynmesh.read(dynmesh.convert(s, scale=2)))).vertices
    ),
    "a slice": lambda s, _: dynmesh.read(dynmesh.complete(s[1:5])).vertices,
    "info": lambda s, _: dynmesh.info(s).to_dict(),
    "evaluate": lambda s, _: _measured(s),
}
"""What takes a sequence as such, and a result that its positions decide."""


@pytest.mark.parametrize("name", CARRYING)
@pytest.mark.parametrize("sentinel", [0.0, -1e4, np.nan])
def test_what_stands_where_nothing_is_known_does_not_matter(
    name: str, sentinel: float, tmp_path: Path
) -> None:
    known: Any = PARTIAL.known
    spoilt = np.where(known[..., None], PARTIAL.vertices, np.float32(sentinel))
    run = CARRYING[name]
    expected = run(PARTIAL, tmp_path)
    found = run(replace(PARTIAL, vertices=spoilt), tmp_path)
    np.testing.assert_equal(found, expected)
