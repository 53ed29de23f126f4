"""Tracks a mesh through a folder of scans."""

import tempfile
from pathlib import Path

import bpy
import numpy as np

from . import meshes


class Track(meshes.OfMesh, bpy.types.Operator):
    """Track the mesh through a folder of scans, in a new object with a cache."""

    bl_idname = "dynmesh.track"
    bl_label = "Track in Scans"

    directory: bpy.props.StringProperty(
        name="Scans",
        description="Point clouds or depth images, with cameras.json beside them, in the space of "
        "the scene",
        subtype="DIR_PATH",
    )
    remove_planes: bpy.props.BoolProperty(
        name="Remove planes", description="Leave floor and walls out of the scans"
    )

    def invoke(self, context, _):
        """Asks for the folder and the options."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Tracks the mesh as it is in the current frame."""
        import dynmesh

        thing = context.object
        try:
            cache = meshes.cache_path(self.cache, thing, "tracked")
            with (
                tempfile.TemporaryDirectory() as folder,
                meshes.evaluated(thing, context) as mesh,
            ):
                to_world = np.array(thing.matrix_world, np.float32)
                points = meshes.positions(mesh) @ to_world[:3, :3].T + to_world[:3, 3]
                body = dynmesh.Sequence(points[None], meshes.triangles(mesh))
                template = Path(folder) / "template.npz"
                dynmesh.write(template, body)
                report = dynmesh.track_file(
                    Path(bpy.path.abspath(self.directory)),
                    cache,
                    template=template,
                    overwrite=True,
                    remove_planes=self.remove_planes,
                )
        except (ImportError, OSError, TypeError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        copy = bpy.data.meshes.new_from_object(
            thing.evaluated_get(context.evaluated_depsgraph_get())
        )
        made = meshes.add_played(context, thing, copy, "tracked", cache, context.scene.frame_start)
        made.matrix_world.identity()  # the cache is in the space of the scene
        level = "INFO" if report.quality == "good" else "WARNING"
        for line in report.lines():
            self.report({level}, line)
        return {"FINISHED"}
