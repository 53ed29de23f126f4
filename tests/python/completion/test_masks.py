"""Masks of arrays, frames and sequences are carried or refused, wherever positions are taken."""

import inspect
import types
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from entries import ENTRIES, FRAME, FRAMES, KNOWN, MASKS, MESH
from sequences import sea

import dynmesh
from dynmesh import (
    alignment,
    baselines,
    formats,
    losses,
    metrics,
    registration,
    scans,
    topology,
    whole_frames,
)

RESULTS = {"Alignment", "Diagnosis", "Registration", "WholeFrame"}
"""What these hold is made by dynmesh."""

PLAIN = {"Frame", "Description", "PointScan.only", "DepthScan.only", "ScanCamera"}
"""Records, which are checked where they are used, and what takes neither positions nor masks."""


OF_SEQUENCES = {
    "complete",
    "convert",
    "degrade",
    "evaluate",
    "info",
    "opened",
    "picture",
    "view",
    "write",
}
"""Verbs, which make a Sequence of arrays."""

FILES = {
    ("open", "faces"),
    ("open", "known"),
    ("complete", "training"),
    ("track", "training"),
    ("track", "template"),
    ("track", "scans"),
}
"""Arrays in place of files, which are checked as those of files are."""


def _takers() -> Iterator[tuple[str, str]]:
    """All public functions and their parameters that may be arrays."""
    of_arrays = (alignment, registration, topology, whole_frames)
    for module in (dynmesh, formats, metrics, baselines, losses, scans, *of_arrays):
        for name in module.__all__:
            found = getattr(module, name)
            if isinstance(found, types.ModuleType) or not callable(found):
                continue
            functions = {name: found}
            if inspect.isclass(found):
                own = inspect.getmembers(found, inspect.isfunction)
                functions = {f"{name}.{n}": method for n, method in own if not n.startswith("_")}
                functions[name] = found.__init__
            for function, called in functions.items():
                for parameter in inspect.signature(called).parameters.values():
                    is_options = parameter.kind is parameter.VAR_KEYWORD
                    if "ndarray" in str(parameter.annotation) and not is_options:
                        yield function, parameter.name


def test_the_table_names_all_that_takes_arrays() -> None:
    there = {(name, argument) for name, (_, given) in ENTRIES.items() for argument in given}
    takers = {one for one in _takers() if one[0] not in RESULTS | PLAIN | OF_SEQUENCES}
    assert len(takers) > 60
    assert takers - there - FILES == set()


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
