"""How sequences show themselves in a notebook."""

from html import escape

from .._errors import InputError
from ..frame import check_any, rate, shares
from ..sequence import Sequence
from .page import framed, page

LARGEST_PLAYER = 2_000_000
"""Bytes that showing a sequence may add to a notebook."""

LARGEST_MESH = 200_000
"""Vertices of a mesh that is still simplified within about two seconds."""

_SIZES = ((2000, 30), (1000, 30), (1000, 15), (500, 15))
"""How many vertices and frames a player may show; the first that is small enough is used."""


def shown(sequence: Sequence) -> str:
    """Returns HTML with a player, if there can be one, and a description of a sequence."""
    n_frames, n_vertices, _ = sequence.vertices.shape
    rows = {
        "frames": f"{n_frames}, {rate(sequence.fps)}",
        "mesh": f"{n_vertices} vertices, {len(sequence.faces)} faces, {sequence.vertices.dtype}",
        "known": shares(sequence.vertices, sequence.known),
        "generation and age": "no" if sequence.generation is None else "yes",
    }
    player = ""
    try:
        player = _player(sequence)
    except (ImportError, InputError) as error:
        # For a notebook, this is not an error: the table describes every sequence.
        rows["no player"] = str(error)
    lines = "".join(
        f'<tr><th style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    return f"{player}<table><caption>Sequence</caption>{lines}</table>"


def _player(sequence: Sequence) -> str:
    if sequence.vertices.shape[1] > LARGEST_MESH:
        raise InputError(
            f"simplifying more than {LARGEST_MESH} vertices takes long; dynmesh view writes a page"
        )
    check_any(sequence)
    for max_vertices, max_frames in _SIZES:
        result = page(sequence, max_vertices=max_vertices, max_frames=max_frames)
        player = framed(result.html)
        if len(player.encode()) <= LARGEST_PLAYER:
            return player
    raise InputError("the mesh cannot be simplified enough; dynmesh view writes a larger page")
