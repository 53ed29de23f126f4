"""Streams of frames through a completer, their errors, and copies of what is under way."""

import copy
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
from meshes import Array, Mesh

import dynmesh


def pickled(subject: Any) -> Any:
    return pickle.loads(pickle.dumps(subject))


COPIES = (pickled, copy.copy, copy.deepcopy)


def completed(mesh: Mesh, frames: Array, masks: Any, **settings: Any) -> list[Array]:
    completer = dynmesh.Completer(mesh.faces, frames[0], **settings)
    return [completer.push(*frame) for frame in zip(frames[1:], masks, strict=True)]


def errors_of(
    sequence: dynmesh.Sequence, frames: Array, masks: Any, *settings: dict[str, Any]
) -> list[float]:
    """The mean NMSVE of frames completed with each of the settings."""
    mesh = Mesh(faces=sequence.faces.astype(np.int64), vertices=frames[0])
    made = [np.stack(completed(mesh, frames, masks, **each)) for each in settings]
    return [dynmesh.metrics.nmsve(sequence.faces, frames[1:], each).mean() for each in made]


def completed_in_order(
    sequence: dynmesh.Sequence, order: list[int], **settings: Any
) -> dict[int, Any]:
    """The frames with these numbers, completed in this order, with their provenance."""
    assert sequence.known is not None
    completer = dynmesh.Completer(sequence.faces, sequence.vertices[order[0]], **settings)
    frames = {order[0]: (sequence.vertices[order[0]], completer.generation, completer.age)}
    for number in order[1:]:
        points = completer.push(sequence.vertices[number], sequence.known[number])
        frames[number] = (points, completer.generation, completer.age)
    return frames


def expected_of(sequence: dynmesh.Sequence, whole: int, **settings: Any) -> dynmesh.Sequence:
    """The sequence completed from its whole frame, backwards and forwards, in memory."""
    n = len(sequence.vertices)
    frames = completed_in_order(sequence, list(range(whole, -1, -1)), **settings)
    frames |= completed_in_order(sequence, list(range(whole, n)), **settings)
    points, generation, age = (np.stack([frames[i][part] for i in range(n)]) for part in range(3))
    return replace(sequence, vertices=points, known=None, generation=generation, age=age)
