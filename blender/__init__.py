"""dynmesh in Blender: an operator on meshes, in the menu Object."""

import bpy

from .complete import Complete


def _add_entry(menu, _):
    menu.layout.operator(Complete.bl_idname, text=f"{Complete.bl_label}…")


def register():
    """Called when the extension is enabled."""
    bpy.utils.register_class(Complete)
    bpy.types.VIEW3D_MT_object.append(_add_entry)


def unregister():
    """Called when the extension is disabled."""
    bpy.types.VIEW3D_MT_object.remove(_add_entry)
    bpy.utils.unregister_class(Complete)
