"""Reads a sequence with Blender, saves positions: `read_with_blender.py OUT.npz FPS FILE...`.

Run it with a Python that has Blender. Each of several files (OBJ, PLY) is one frame. The scene must
have the file's frame rate, or Blender shows an Alembic file at times between its samples. Positions
are in the mesh's own space: Blender rotates Alembic files from y up to z up, which is undone here.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def imported(file: str, fps: int) -> bpy.types.Object:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = fps
    suffix = Path(file).suffix
    if suffix == ".abc":
        bpy.ops.wm.alembic_import(filepath=file)
    elif suffix == ".obj":
        bpy.ops.wm.obj_import(filepath=file, forward_axis="Y", up_axis="Z", validate_meshes=False)
    elif suffix == ".ply":
        bpy.ops.wm.ply_import(filepath=file)
    else:
        bpy.ops.wm.usd_import(filepath=file)
    (body,) = (thing for thing in bpy.context.scene.objects if thing.type == "MESH")
    return body


def positions(body: bpy.types.Object, frame: int) -> np.ndarray:
    bpy.context.scene.frame_set(frame)
    mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def main(out: str, fps: str, *files: str) -> None:
    vertices = []
    for file in files:
        body = imported(file, int(fps))
        scene = bpy.context.scene
        numbers = range(scene.frame_start, scene.frame_end + 1) if len(files) == 1 else [0]
        vertices += [positions(body, number) for number in numbers]
    points = np.stack(vertices)
    if files[0].endswith(".abc"):
        points = np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)
    polygons = [list(polygon.vertices) for polygon in body.data.polygons]
    np.savez(
        out,
        vertices=points,
        polygon_sizes=[len(polygon) for polygon in polygons],
        polygon_corners=np.concatenate(polygons),
    )


main(*sys.argv[1:])
