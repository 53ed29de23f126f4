"""Completes the vertices of an animated mesh that are missing in some frames."""

import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar

import bpy
import numpy as np


class Complete(bpy.types.Operator):
    """Estimate the vertices that are missing in some frames, in a new object with a cache."""

    bl_idname = "dynmesh.complete"
    bl_label = "Complete Missing Vertices"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    mask: bpy.props.StringProperty(
        name="Mask",
        description="The attribute of points that marks vertices in each frame, or a vertex group, "
        "which marks the same ones in every frame but the first, where none is missing",
    )
    marks: bpy.props.EnumProperty(
        name="Marks",
        description="What it marks, with a value above a half",
        items=[
            ("known", "Known vertices", "The other vertices are missing"),
            ("missing", "Missing vertices", "The other vertices are known"),
        ],
    )
    bidirectional: bpy.props.BoolProperty(
        name="From both sides",
        description="Use the frames after a hole too, which is more accurate and takes longer",
        default=True,
    )
    noise: bpy.props.FloatProperty(
        name="Noise",
        description="Standard deviation of the known positions, which are smoothed; 0 for none",
        min=0,
        precision=4,
        subtype="DISTANCE",
    )
    cache: bpy.props.StringProperty(
        name="Cache",
        description="The cache that is written, a file .pc2 [beside the saved .blend file]",
        subtype="FILE_PATH",
    )

    @classmethod
    def poll(cls, context):
        """Whether a mesh is active."""
        return context.object is not None and context.object.type == "MESH"

    def invoke(self, context, _):
        """Asks for the options."""
        groups = context.object.vertex_groups
        if not self.mask and groups.active:
            self.mask = groups.active.name
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        """Completes the frames of the scene."""
        import dynmesh

        thing, scene = context.object, context.scene
        now = scene.frame_current
        try:
            cache = cache_path(self.cache, thing)
            with tempfile.TemporaryDirectory() as folder:
                partial = Path(folder) / "partial.npz"
                mesh = self._write(dynmesh, context, partial)
                completed = dynmesh.complete(
                    partial, bidirectional=self.bidirectional, noise=self.noise or None
                )
                report = dynmesh.write(cache, completed)
        except (OSError, TypeError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            scene.frame_set(now)
        add_played(context, thing, mesh, cache, scene.frame_start)
        for line in report.lines():
            self.report({"INFO" if report.quality == "good" else "WARNING"}, line)
        return {"FINISHED"}

    def _write(self, dynmesh, context, path):
        """Writes the frames of the scene with their masks; returns a copy of the first mesh."""
        thing, scene = context.object, context.scene
        first, last = scene.frame_start, scene.frame_end
        scene.frame_set(first)
        copy = bpy.data.meshes.new_from_object(
            thing.evaluated_get(context.evaluated_depsgraph_get())
        )
        header = dynmesh.Header(
            triangles(copy),
            last - first + 1,
            len(copy.vertices),
            np.float32,
            attributes=["known"],
            fps=scene.render.fps / scene.render.fps_base,
            start=first,
        )

        def frames():
            for frame in range(first, last + 1):
                scene.frame_set(frame)
                with evaluated(thing, context) as mesh:
                    points, marked = positions(mesh), self._marked(thing, mesh, frame)
                known = marked if self.marks == "known" else ~marked
                if frame == first and self.mask in thing.vertex_groups:
                    known = np.ones(len(points), np.bool_)
                if len(points) != len(copy.vertices):
                    raise ValueError(
                        f"frame {frame} has {len(points)} vertices, but frame {first} has "
                        f"{len(copy.vertices)}; modifiers must not change their number"
                    )
                yield dynmesh.Frame(points, known)

        dynmesh.write(path, dynmesh.frames.Run(header, frames))
        return copy

    def _marked(self, thing, mesh, frame):
        """Which vertices the mask marks, (k,) bool."""
        group = thing.vertex_groups.get(self.mask)
        values = np.zeros(len(mesh.vertices), np.float32)
        if group is not None:
            for number, vertex in enumerate(mesh.vertices):
                for element in vertex.groups:
                    if element.group == group.index:
                        values[number] = element.weight
            return values > 0.5
        attribute = mesh.attributes.get(self.mask)
        if attribute is None or attribute.domain != "POINT":
            there = [group.name for group in thing.vertex_groups]
            there += [one.name for one in mesh.attributes if one.domain == "POINT"]
            raise ValueError(
                f"frame {frame} has no vertex group or attribute of points '{self.mask}'; "
                f"there are {', '.join(there) or 'none'}"
            )
        if attribute.data_type not in ("BOOLEAN", "FLOAT", "INT"):
            raise ValueError(f"'{self.mask}' must be boolean, integer or float")
        kind = {"BOOLEAN": np.bool_, "FLOAT": np.float32}.get(attribute.data_type, np.int32)
        values = values.astype(kind)
        attribute.data.foreach_get("value", values)
        return values > 0.5


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
