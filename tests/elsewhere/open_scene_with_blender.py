"""Opens a scene with Blender: `open_scene_with_blender.py OUT.npz FILE FPS FRAME...`.

Run it with a Python that has Blender. For each object with a mesh, OUT holds its positions and its
matrix to the world in every frame, its texture coordinates and the names of its materials. Blender
turns Alembic files from y up to z up, in the matrices as well as in the positions.
"""

import sys

import bpy
import numpy as np


def main(out: str, file: str, fps: str, *frames: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = int(fps)
    if file.endswith(".abc"):
        bpy.ops.wm.alembic_import(filepath=file)
    else:
        bpy.ops.wm.usd_import(filepath=file, apply_unit_conversion_scale=False)
    found = {}
    for thing in [thing for thing in scene.objects if thing.type == "MESH"]:
        positions, matrices = [], []
        for frame in frames:
            scene.frame_set(int(frame))
            graph = bpy.context.evaluated_depsgraph_get()
            mesh = thing.evaluated_get(graph).to_mesh()
            flat = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("co", flat)
            positions.append(flat.reshape(-1, 3))
            matrices.append(np.array(thing.matrix_world))
        layer = thing.data.uv_layers
        found |= {
            f"{thing.name}:positions": np.stack(positions),
            f"{thing.name}:matrices": np.stack(matrices),
            f"{thing.name}:textured": np.array([len(layer[0].data) if layer else 0]),
            f"{thing.name}:materials": np.array([str(one.name) for one in thing.data.materials]),
        }
    np.savez(out, **found)


main(*sys.argv[1:])
