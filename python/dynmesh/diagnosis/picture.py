"""A picture of the findings: the mesh from two sides, and plots along the frames."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..draw import figures
from ..draw.figures import KNOWN_COLOUR, Image, Mark, View
from ..sequence import Mask
from .diagnosis import Diagnosis
from .finding import Finding, Indices

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (
    "#cc3311", "#0077bb", "#ee9900", "#009944", "#aa3399",
    "#00aacc", "#774411", "#ff66aa", "#808000", "#333388",
    "#ddcc00", "#66cc44", "#ff8866", "#005555", "#bb88ee", "#550022",
)  # fmt: skip
_INK, _PALE = "#222222", "#888888"
_TITLES = ("the first frame, from one side", "from the other side")
_SIDES = (60.0, 240.0)  # degrees
_FRAME_MARKS = {
    "leaps": ("v", "leap"),
    "scrambled_frames": ("X", "scrambled"),
    "outliers": ("d", "with outliers"),
    "zeros": ("o", "with zeros"),
    "repeated_frames": ("s", "repeated"),
}
_SHADED = ("frames_without_anchors", "hardly_any_anchors")

_STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": _PALE,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 10,
    "legend.frameon": False,
    "savefig.facecolor": "white",
}


def draw(diagnosis: Diagnosis, output: Path, *, heading: str, size: int = 640) -> None:
    """Draws the findings.

    The mesh of frame 0 is shown from two opposite sides. Each kind of finding has a colour; faces
    and connected vertices are painted, and small problems are shown as dots. The plots below show
    the share of known vertices and the motion of each frame, with marks at frames with findings.

    Args:
        diagnosis: the result of :func:`dynmesh.diagnose`.
        output: a PNG file; an existing file is replaced.
        heading: shown above the picture.
        size: of each view, in pixels.

    Raises:
        OSError: the file cannot be written.
        ImportError: pyvista is not installed.
    """
    colours = {f.code: COLOURS[i % len(COLOURS)] for i, f in enumerate(diagnosis.findings)}
    pyplot = require("matplotlib.figure", extra="view")
    matplotlib = require("matplotlib", extra="view")
    images = _sides(diagnosis, colours, size)
    moves = len(diagnosis.known_share) > 1
    tall = 9.2 / 2 * images[0].shape[0] / images[0].shape[1] if images else 1.0
    tall = min(max(tall, 3.0), 6.5)
    with matplotlib.rc_context(_STYLE):
        height = tall + 0.7 + (3.0 if moves else 0)
        figure: Figure = pyplot.Figure(figsize=(13, height), layout="constrained")
        figure.suptitle(heading, x=0.01, ha="left", fontsize=15, color=_INK)
        heights = [tall, 3.0] if moves else [tall]
        rows: Any = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)
        *sides, legend = rows[0, 0].subplots(1, 3, width_ratios=[4.6, 4.6, 3.3])
        _show(sides, images)
        _write_legend(legend, diagnosis, colours)
        if moves:
            known, motion = rows[1, 0].subplots(2, 1, sharex=True)
            _draw_frames(known, motion, diagnosis, colours)
        figure.savefig(output, dpi=100, format="png")


def _sides(diagnosis: Diagnosis, colours: dict[str, str], size: int) -> list[Image]:
    points, faces = diagnosis.first_frame, diagnosis.header.faces
    there: Mask = np.asarray(np.isfinite(points).all(axis=1))
    if not there.any():
        return []
    kept = np.flatnonzero(there[faces].all(axis=1))
    row = np.full(len(faces), -1)
    row[kept] = np.arange(len(kept))
    # Rare findings are drawn on top.
    findings = sorted(diagnosis.findings, key=_extent, reverse=True)
    marks = [_mark(finding, colours[finding.code], points, faces, row) for finding in findings]
    whole = np.where(there[:, None], points, 0)
    views = [View.of(points[there], diagnosis.likely_up, side, (size, size)) for side in _SIDES]
    shown = [figures.render_marked(faces[kept], whole, view, marks) for view in views]
    return figures.cropped(shown)


def _extent(finding: Finding) -> int:
    return len(finding.where.vertices) + len(finding.where.faces)


def _mark(
    finding: Finding,
    colour: str,
    points: NDArray[np.floating[Any]],
    faces: NDArray[np.integer[Any]],
    row: Indices,
) -> Mark:
    """Collects painted faces and dots; `row` is the row of each face among those drawn, or -1."""
    vertices, painted = finding.where.vertices, finding.where.faces
    dots = points[vertices]
    if len(painted):
        dots = points[faces[painted]].mean(axis=1)
    elif len(vertices):
        inside = np.zeros(len(points), np.bool_)
        inside[vertices] = True
        painted = np.flatnonzero(inside[faces].all(axis=1))
        inside[faces[painted]] = False
        dots = points[inside]
    dots = dots[np.isfinite(dots).all(axis=1)]
    size = 2.2 if len(dots) <= 30 else 1.6 if len(dots) <= 300 else 0.9
    if len(finding.where.faces) > 30:
        size = 0.5  # so that the painted faces remain visible between them
    drawn = row[painted]
    return Mark(colour, drawn[drawn >= 0], dots, size)


def _show(axes: "list[Axes]", images: list[Image]) -> None:
    for axis in axes:
        axis.axis("off")
    if not images:
        axes[0].text(0.5, 0.5, "the first frame is empty", ha="center", color=_INK)
        return
    for axis, image, title in zip(axes, images, _TITLES, strict=True):
        axis.imshow(image, interpolation="antialiased")
        axis.set_title(title, color=_INK)


def _write_legend(axis: "Axes", diagnosis: Diagnosis, colours: dict[str, str]) -> None:
    axis.axis("off")
    axis.set(xlim=(0, 1), ylim=(0, 1))
    if not diagnosis.findings:
        axis.text(0, 0.9, "no problems were found", color=_INK, fontsize=12)
        return
    step = min(0.09, 1 / (len(diagnosis.findings) + 1))
    for i, finding in enumerate(diagnosis.findings):
        y = 0.96 - i * step
        colour, on_mesh = colours[finding.code], _extent(finding) > 0
        marker = "o" if on_mesh else _FRAME_MARKS.get(finding.code, "o")[0]
        shown = on_mesh or finding.code in (*_FRAME_MARKS, *_SHADED)
        fill = colour if shown else "none"
        axis.plot(0.03, y, marker, markersize=10, color=colour, markerfacecolor=fill, clip_on=False)
        name = finding.code.replace("_", " ")
        text = f"{name}: {finding.count}"
        axis.text(0.09, y, text, va="center", color=_INK, fontsize=11)
        axis.text(1.0, y, finding.severity, va="center", ha="right", color=_PALE, fontsize=9)


def _draw_frames(
    known: "Axes", motion: "Axes", diagnosis: Diagnosis, colours: dict[str, str]
) -> None:
    n = len(diagnosis.known_share)
    numbers = np.arange(n)
    edges = np.arange(n + 1) - 0.5
    known.stairs(100 * diagnosis.known_share, edges, fill=True, color=KNOWN_COLOUR, alpha=0.75)
    known.set(ylabel="known / %", ylim=(0, 105), xlim=(-0.5, n - 0.5), yticks=[0, 50, 100])
    moved = 100 * diagnosis.motion
    motion.plot(numbers, moved, color=_PALE, linewidth=1.2, marker="." if n < 80 else None)
    most = float(np.nanmax(moved)) if np.isfinite(moved).any() else 0.0
    motion.set(ylabel="motion / %\nof diagonal", xlabel="frame", ylim=(0, 1.3 * most or 1))
    motion.locator_params(axis="x", integer=True)
    motion.xaxis.set_major_formatter(
        lambda x, _: str(diagnosis.header.number(round(x))) if 0 <= round(x) < n else ""
    )
    for finding in diagnosis.findings:
        frames = finding.where.frames
        colour = colours[finding.code]
        if finding.code in _SHADED:
            shade = np.zeros(n)
            shade[frames] = 105
            known.stairs(shade, edges, fill=True, color=colour, alpha=0.3, zorder=0)
        elif finding.code in _FRAME_MARKS:
            marker, label = _FRAME_MARKS[finding.code]
            at_curve = np.nan_to_num(moved[frames]) + 0.08 * (most or 1)
            high = finding.code in ("leaps", "scrambled_frames")
            places = at_curve if high else np.zeros(len(frames))
            motion.plot(
                frames, places, marker, color=colour, label=label, clip_on=False,
                markersize=9 if high else 5,
            )  # fmt: skip
    if motion.get_legend_handles_labels()[0]:
        motion.legend(loc="upper left", bbox_to_anchor=(1.0, 1.05), handletextpad=0.2)
