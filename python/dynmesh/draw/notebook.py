"""How sequences and completers show themselves in a notebook, and completers in a line."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from html import escape
from typing import Any

from .._core import Completer
from .._errors import InputError
from .._extras import require
from ..frames.memory import SequenceReader
from ..sequence import Sequence, rate
from .page import framed, page

LARGEST_PLAYER = 2_000_000
"""Bytes that showing a sequence may add to a notebook."""

LARGEST_MESH = 200_000
"""Vertices of a mesh that is still simplified within about two seconds."""

_SIZES = ((2000, 30), (1000, 30), (1000, 15), (500, 15))
"""How many vertices and frames a player may show; the first that is small enough is used."""


def show_objects() -> None:
    """Makes sequences and completers show themselves in notebooks, and completers in a line.

    :class:`Sequence` holds data alone, and the compiled class has no words of its own.
    """
    for shown, name, function in (
        (Sequence, "_repr_html_", sequence_shown),
        (Completer, "_repr_html_", completer_shown),
        (Completer, "__repr__", completer_line),
    ):
        setattr(shown, name, function)


def sequence_shown(sequence: Sequence) -> str:
    """Returns HTML with a player, if there can be one, and a description of a sequence."""
    n_frames, n_vertices, _ = sequence.vertices.shape
    known = "no masks"
    if sequence.known is not None:
        known = f"{100 * sequence.known.mean():.3g} %" if sequence.known.size else "nothing"
    rows = {
        "frames": f"{n_frames}, {rate(sequence.fps)}",
        "mesh": f"{n_vertices} vertices, {len(sequence.faces)} faces, {sequence.vertices.dtype}",
        "known": known,
        "generation and age": "no" if sequence.generation is None else "yes",
    }
    try:
        return _player(sequence) + _table("Sequence", rows)
    except (ImportError, ValueError) as error:
        # For a notebook, this is not an error: the table describes every sequence.
        return _table("Sequence", rows | {"no player": str(error)})


def completer_line(completer: Completer) -> str:
    """Describes a completer in one line."""
    method = completer.settings["method"]
    return f"Completer({method}, {_mesh(completer)}, {_progress(completer)})"


def completer_shown(completer: Completer) -> str:
    """Returns HTML that describes a completer."""
    settings = (f"{name}={value!r}" for name, value in completer.settings.items())
    rows = {
        "mesh": _mesh(completer),
        "topology": repr(completer.topology),
        "settings": ", ".join(settings),
        "progress": _progress(completer),
    }
    with suppress(RuntimeError):  # of a completer in use, `progress` says so
        rows["last frame"] = repr(completer.report)
    return _table("Completer", rows)


def _mesh(completer: Completer) -> str:
    return f"{completer.n_vertices} vertices, {completer.n_edges} edges, {completer.dtype}"


def _progress(completer: Completer) -> str:
    try:
        n_frames, report = completer.n_frames, completer.report
    except RuntimeError:  # to show a completer must not fail at any time
        return "in use by another thread"
    if n_frames == 0:
        return "no frames"
    known = 100 * report.known / completer.n_vertices
    frames = "1 frame" if n_frames == 1 else f"{n_frames} frames"
    return f"{frames}, {known:.3g} % known in the last"


def _player(sequence: Sequence) -> str:
    """Returns a frame with a page that plays the sequence.

    Raises:
        ImportError: the extra `view` is not installed.
        ValueError: there is nothing to play, or the mesh or even its smallest player is too large.
    """
    if sequence.vertices.shape[1] > LARGEST_MESH:
        raise InputError(
            f"simplifying more than {LARGEST_MESH} vertices takes long; dynmesh view writes a page"
        )
    reader = SequenceReader(sequence)
    for max_vertices, max_frames in _SIZES:
        with _without_widgets():
            made = page(reader, max_vertices=max_vertices, max_frames=max_frames)
        player = framed(made.html)
        if len(player.encode()) <= LARGEST_PLAYER:
            return player
    raise InputError("the mesh cannot be simplified enough; dynmesh view writes a larger page")


@contextmanager
def _without_widgets() -> Iterator[None]:
    """Keeps the widgets of k3d from sending their data to the notebook, which would store it too.

    Package `comm` intends that its function is replaced, as kernels do.
    """
    comm: Any = require("comm", extra="view")
    usual = comm.create_comm
    comm.create_comm = comm.DummyComm
    try:
        yield
    finally:
        comm.create_comm = usual


def _table(title: str, rows: dict[str, str]) -> str:
    lines = "".join(
        f'<tr><th style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"
