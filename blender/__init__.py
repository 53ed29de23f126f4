"""dynmesh in Blender: two operators on meshes, in the menu Object > dynmesh."""

import bpy

from .complete import Complete
from .track import Track

_OPERATORS = Complete, Track


class Menu(bpy.types.Menu):
    """The entry of the menu Object."""

    bl_idname = "VIEW3D_MT_dynmesh"
    bl_label = "dynmesh"

    def draw(self, _):
        """Lists the operators."""
        for operator in _OPERATORS:
            self.layout.operator(operator.bl_idname, text=operator.bl_label + "…")


def _add_menu(menu, _):
    menu.layout.menu(Menu.bl_idname)


def register():
    """Called when the extension is enabled."""
    for one in (*_OPERATORS, Menu):
        bpy.utils.register_class(one)
    bpy.types.VIEW3D_MT_object.append(_add_menu)


def unregister():
    """Called when the extension is disabled."""
    bpy.types.VIEW3D_MT_object.remove(_add_menu)
    for one in (Menu, *reversed(_OPERATORS)):
        bpy.utils.unregister_class(one)
