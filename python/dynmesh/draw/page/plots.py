"""An empty plot of k3d, as all pages show it."""

from typing import Any

from ..._extras import require

FIELD_OF_VIEW = 30.0
"""In degrees, from top to bottom."""


def new_plot(up: str) -> tuple[Any, Any]:
    """Returns the library and a plot with nothing but what is added to it.

    Raises:
        ImportError: k3d is not installed.
    """
    k3d = require("k3d", extra="view")
    plot = k3d.plot(
        background_color=0xFFFFFF,
        camera_auto_fit=False,
        camera_fov=FIELD_OF_VIEW,
        camera_mode="orbit",
        camera_up_axis=up,
        colorbar_object_id=0,  # pages have their own colour bar
        grid_visible=False,
        axes_helper=0,
        menu_visibility=False,
    )
    return k3d, plot
