"""Completes the vertices of an animated mesh that are missing in some frames."""

import tempfile
from pathlib import Path
from typing import ClassVar

import bpy
import numpy as np

from . import meshes


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
            cache = meshes.cache_path(self.cache, thing)
            with tempfile.TemporaryDirectory() as folder:
                partial = Path(folder) / "partial.npz"
                mesh = self._write(dynmesh, context, partial)
                report = dynmesh.complete_file(
                    partial,
                    cache,
                    overwrite=True,
                    bidirectional=self.bidirectional,
                    noise=self.noise or None,
                )
        except (OSError, TypeError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            scene.frame_set(now)
        meshes.add_played(context, thing, mesh, cache, scene.frame_start)
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
            meshes.triangles(copy),
            last - first + 1,
            len(copy.vertices),
            np.float32,
            has_known=True,
            fps=scene.render.fps / scene.render.fps_base,
            start=first,
        )
        with dynmesh.create(path, header) as writer:
            for frame in range(first, last + 1):
                scene.frame_set(frame)
                with meshes.evaluated(thing, context) as mesh:
                    points, marked = meshes.positions(mesh), self._marked(thing, mesh, frame)
                known = marked if self.marks == "known" else ~marked
                if frame == first and self.mask in thing.vertex_groups:
                    known = np.ones(len(points), np.bool_)
                if len(points) != len(copy.vertices):
                    raise ValueError(
                        f"frame {frame} has {len(points)} vertices, but frame {first} has "
                        f"{len(copy.vertices)}; modifiers must not change their number"
                    )
                writer.append(points, known)
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
