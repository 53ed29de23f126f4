"""Streams of frames through a completer, their errors, and copies of what is under way."""

import copy
import pickle
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
