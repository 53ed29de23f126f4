"""Shows a completion in the rerun viewer while it runs.

    python live.py partial.npz
    python live.py partial.npz --save completion.rrd

The observed vertices are dots. The completed mesh is coloured by generation: grey where observed,
then from yellow, next to an observed vertex, to violet, eight or more edges away; red where no
edges lead to an observed vertex. Below is the time that each frame took.

Requires `pip install 'dynmesh[live]'`.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

import dynmesh

Array = NDArray[Any]

# By generation; disconnected vertices are of generation -1, which is the last row.
COLOURS = np.frombuffer(
    bytes.fromhex("d7dce3 fde725 a0da39 4ac16d 1fa187 277f8e 365c8d 46327e 440154 cc3311"), np.uint8
).reshape(-1, 3)

LAYOUT = rrb.Vertical(
    rrb.Spatial3DView(name="completion", contents=["observed", "completed"]),
    rrb.TimeSeriesView(name="milliseconds per frame", contents="milliseconds"),
    row_shares=[3, 1],
)


def main(source: str, recording: Path | None) -> None:
    """Completes a sequence and shows each frame as soon as it is completed."""
    rr.init("dynmesh live")
    if recording is None:
        rr.spawn(default_blueprint=LAYOUT)
    else:
        rr.save(recording, default_blueprint=LAYOUT)
    with dynmesh.open(source) as reader:
        up = rr.ViewCoordinates.RIGHT_HAND_Y_UP
        if reader.header.up_axis == "z":
            up = rr.ViewCoordinates.RIGHT_HAND_Z_UP
        rr.log("/", up, static=True)
        # The triangles do not change, so they are sent once; the vertices are sent with every
        # frame.
        rr.log("completed", rr.Mesh3D.from_fields(triangle_indices=reader.faces), static=True)
        completer: dynmesh.Completer | None = None
        for number, (points, known) in enumerate(reader):
            rr.set_time("frame", sequence=number)
            if completer is None:
                completer = dynmesh.Completer(reader.faces, points)
                completed = points
            else:
                completed = completer.push(points, known)
                rr.log("milliseconds", rr.Scalars(1e3 * completer.report.seconds))
            show(reader.faces, completed, completer.generation)


def show(faces: Array, completed: Array, generation: Array) -> None:
    """Logs one frame, whose observed vertices are unchanged."""
    generation = np.minimum(generation, len(COLOURS) - 2)
    rr.log("observed", rr.Points3D(completed[generation == 0], colors=[0, 114, 178]))
    rr.log(
        "completed",
        rr.Mesh3D.from_fields(
            vertex_positions=completed,
            vertex_normals=normals(faces, completed),
            vertex_colors=COLOURS[generation],
        ),
    )


def normals(faces: Array, points: Array) -> Array:
    """Returns vertex normals for smooth shading, the area-weighted normals of the triangles."""
    a, b, c = points[faces].swapaxes(0, 1)
    sums = np.zeros_like(points)
    for corner in faces.T:
        np.add.at(sums, corner, np.cross(b - a, c - a))
    return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-30))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Shows a completion in the rerun viewer.")
    parser.add_argument("source", help="an incomplete sequence, in any format that dynmesh reads")
    parser.add_argument("--save", type=Path, metavar="FILE.rrd", help="write a file instead")
    arguments = parser.parse_args()
    main(arguments.source, arguments.save)
