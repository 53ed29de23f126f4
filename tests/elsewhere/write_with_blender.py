"""Writes the files in `blender/`, and `truth.npz` with their expected content.

Run it with a Python that has Blender: `python write_with_blender.py`, made with bpy 5.0.1.

A mesh of quads, a pentagon and a triangle moves by a shape key, and stands still from frame 2 to
frame 4; it hangs below a turned and shifted empty and is shifted itself. Nothing is converted from
z up to y up where Blender lets one choose, so that positions stay as they are in the mesh; where
the points are written in the world's space (OBJ, PLY), `world` holds them.
"""

from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(__file__).parent / "blender"
FRAMES = range(1, 7)

points = [
    (0, 0, 0), (1, 0, 0.1), (2, 0, 0), (0, 1, 0.2), (1, 1, 0), (2, 1, 0.3),
    (0, 2, 0), (0.7, 2.6, 0.5), (2, 2, 0), (1, 3, 1), (3, 3, 1),
]  # fmt: skip
polygons = [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 8, 7, 6), (4, 5, 8), (7, 8, 10, 9)]


def make_scene() -> bpy.types.Object:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FRAMES[0], FRAMES[-1]
    scene.render.fps = 25
    mesh = bpy.data.meshes.new("BodyShape")
    mesh.from_pydata(points, [], polygons)
    mesh.uv_layers.new(name="UVMap")
    mesh.materials.append(bpy.data.materials.new("Skin"))
    body = bpy.data.objects.new("Body", mesh)
    parent = bpy.data.objects.new("Above", None)
    parent.location, parent.rotation_euler = (1, -2, 3), (0.3, 0.2, 0.7)
    body.parent, body.location = parent, (0.5, 0, 0.25)
    for thing in (parent, body):
        scene.collection.objects.link(thing)
    body.shape_key_add(name="rest")
    bent = body.shape_key_add(name="bent")
    for i, point in enumerate(points):
        bent.data[i].co = (point[0] + 0.3 * i, point[1] - 0.1 * i * i, point[2] + np.sin(i))
    for frame, value in zip(FRAMES, (0, 0.5, 0.5, 0.5, 1, 0.2)):  # noqa: B905 (as long as it is)
        bent.value = value
        bent.keyframe_insert("value", frame=frame)
    return body


def positions(body: bpy.types.Object, *, world: bool) -> np.ndarray:
    mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    if world:
        mesh.transform(body.matrix_world)
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    body = make_scene()
    truth = {"vertices": [], "world": []}
    axes = {"forward_axis": "Y", "up_axis": "Z"}
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        truth["vertices"].append(positions(body, world=False))
        truth["world"].append(positions(body, world=True))
        # With texture coordinates Blender would split vertices.
        path = FOLDER / f"body_{frame:04d}.ply"
        bpy.ops.wm.ply_export(filepath=str(path), export_uv=False, export_colors="NONE", **axes)
    np.savez_compressed(
        FOLDER / "truth.npz",
        polygon_sizes=np.array([len(polygon) for polygon in polygons]),
        polygon_corners=np.concatenate(polygons),
        **truth,
    )
    # If the mesh has no shape keys or armature, USD stores the points of every frame.
    for suffix in ("usdc", "usda"):
        bpy.ops.wm.usd_export(
            filepath=str(FOLDER / f"body.{suffix}"), export_animation=True,
            export_shapekeys=False, export_armatures=False, convert_world_material=False,
        )  # fmt: skip
    bpy.ops.wm.alembic_export(filepath=str(FOLDER / "body.abc"))
    bpy.ops.wm.obj_export(
        filepath=str(FOLDER / "body_.obj"), export_animation=True, start_frame=FRAMES[0],
        end_frame=FRAMES[-1], export_materials=False, **axes,
    )  # fmt: skip


main()
