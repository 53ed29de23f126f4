"""Verbs from file to file, as a command runs them."""

import warnings
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

import dynmesh
from dynmesh._errors import locating
from dynmesh.verbs.convert import convert_clouds

_WRITING = ("provenance", "overwrite", "output_format")


def write(frames: Any, output: str | Path, **options: Any) -> SimpleNamespace:
    """Writes frames, and returns all that the reports say."""
    options = {"overwrite": False} | options
    if "output_format" in options:
        options["format"] = options.pop("output_format")
    with frames, warnings.catch_warnings():
        warnings.simplefilter("ignore", dynmesh.DoubtfulWarning)
        written = dynmesh.write(output, frames, **options)
    of_verb = {} if written.report is None else vars(written.report)
    return SimpleNamespace(**(of_verb | vars(written)), lines=written.lines)


def frames_of(
    header: dynmesh.Header, frames: Iterable[Any], origin: Any = None
) -> dynmesh.frames.Run[Any]:
    """Frames or positions with a header."""
    each = (f if isinstance(f, dynmesh.Frame) else dynmesh.Frame(f) for f in frames)
    return dynmesh.frames.Run(header, lambda: each, origin=origin)


def complete(
    path: str | Path, output: str | Path, *, source: Any = None, **options: Any
) -> SimpleNamespace:
    """Completes a file."""
    writing = {name: options.pop(name) for name in _WRITING if name in options}
    shared = dynmesh.formats.Shared(options.get("template"))
    with dynmesh.formats.opened(path, "path", shared, **(source or {})) as frames:
        return write(dynmesh.complete(frames, **options), output, **writing)


def convert(
    path: str | Path, output: str | Path, *, source: Any = None, **options: Any
) -> SimpleNamespace:
    """Converts a file, or point clouds."""
    gaps = (source or {}).get("gaps", "refuse")
    own = {name: value for name, value in options.items() if name not in _WRITING}
    clouds = convert_clouds(Path(path), gaps, **own)
    if clouds is not None:
        overwrite = options.get("overwrite", False)
        return SimpleNamespace(**vars(clouds.write(output, overwrite=overwrite)))
    writing = {name: options.pop(name) for name in _WRITING if name in options}
    with dynmesh.open(path, **(source or {})) as frames:
        return write(dynmesh.convert(frames, **options), output, **writing)


def track(scans: str | Path, output: str | Path, **options: Any) -> SimpleNamespace:
    """Tracks scans."""
    writing = {name: options.pop(name) for name in _WRITING if name in options}
    return write(dynmesh.track(scans, **options), output, **writing)


def pushed(
    faces: Any, frames: Any, known: Any = None, *, training: Any = None, **settings: Any
) -> list[Any]:
    """Completes frames one after another; the first one is complete."""
    points = [np.asarray(frame) for frame in frames]
    masks = [None] * len(points) if known is None else [*known]
    completer = dynmesh.Completer(faces, points[0], training=training, **settings)
    completed = [points[0]]
    for number, (one, mask) in enumerate(zip(points[1:], masks[1:], strict=True), 1):
        with locating(frame=number):
            completed.append(completer.push(one, mask))
    return completed
