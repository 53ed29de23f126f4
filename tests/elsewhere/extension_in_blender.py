"""Runs the extension: `extension_in_blender.py EXTENSION.zip OUT.npz`.

Run it with a Python that has Blender. A waving sheet, of which a vertex group marks a part as
known, is completed. OUT holds the positions that the object with the cache has in every frame.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def positions(thing):
    mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def frames_of(thing):
    scene = bpy.context.scene
    found = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        found.append(positions(thing))
    return np.stack(found)


def sheet():
    """A grid that bends more in every frame, with half of its vertices in the group `seen`."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12)
    thing = bpy.context.object
    thing.shape_key_add(name="flat")
    bent = thing.shape_key_add(name="bent")
    for point in bent.data:
        point.co.z = 0.5 * point.co.x**2
    for frame, value in ((1, 0.0), (6, 1.0)):
        bent.value = value
        bent.keyframe_insert("value", frame=frame)
    group = thing.vertex_groups.new(name="seen")
    group.add(list(range(0, len(thing.data.vertices), 2)), 1.0, "REPLACE")
    return thing


def main(extension, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(
        filepath=extension, repo="user_default", enable_on_install=True
    )
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 6
    folder = Path(out).parent
    thing = sheet()
    found = {"truth": frames_of(thing)}
    try:
        bpy.ops.dynmesh.complete(mask="none", cache=str(folder / "none.pc2"))
    except RuntimeError as error:
        found["refused"] = np.array(str(error))
    bpy.ops.dynmesh.complete(mask="seen", cache=str(folder / "completed.pc2"))
    found["completed"] = frames_of(bpy.context.object)
    np.savez(out, **found)


main(*sys.argv[1:])
