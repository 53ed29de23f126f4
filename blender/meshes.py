"""Meshes as arrays, and the objects that play caches."""

from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np


@contextmanager
def evaluated(thing, context):
    """The mesh of an object in the current frame, after its modifiers."""
    made = thing.evaluated_get(context.evaluated_depsgraph_get())
    try:
        yield made.to_mesh()
    finally:
        made.to_mesh_clear()


def positions(mesh):
    """The positions of its vertices, (k, 3) float32, in the space of the object."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def triangles(mesh):
    """Its triangles, (m, 3) int32."""
    mesh.calc_loop_triangles()
    flat = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", flat)
    return flat.reshape(-1, 3)


def cache_path(asked, thing):
    """The path of a cache as a user gave it, or beside the saved file.

    Raises:
        ValueError: neither is there.
    """
    if asked:
        return Path(bpy.path.abspath(asked)).with_suffix(".pc2")
    if not bpy.data.filepath:
        raise ValueError("save the .blend file first, or say where the cache is to be written")
    return Path(bpy.data.filepath).with_name(f"{bpy.path.clean_name(thing.name)}-completed.pc2")


def add_played(context, thing, mesh, cache, first):
    """Adds an object like another one, whose mesh a cache moves from a frame on."""
    made = bpy.data.objects.new(f"{thing.name} completed", mesh)
    made.matrix_world = thing.matrix_world
    for collection in thing.users_collection:
        collection.objects.link(made)
    modifier = made.modifiers.new("dynmesh", "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = bpy.path.relpath(str(cache)) if bpy.data.filepath else str(cache)
    modifier.frame_start = first
    modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"  # as they are
    context.view_layer.objects.active = made
