"""Pictures of meshes, as arrays of pixels: surfaces, known and missing vertices, heatmaps.

Everything is rendered off screen with pyvista (extra `view`).
"""

import os
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, Positions
from .._checks import check_choice, check_complete, check_finite
from .._errors import InputError, require
from ..header import Axis
from ..topology import cells, unit

Image = NDArray[np.uint8]

SURFACE_COLOUR = "#d7dce3"
KNOWN_COLOUR = "#0072b2"
MISSING_COLOUR = "#cc3311"
DISCONNECTED_COLOUR = "#009e73"
HEATMAP = (SURFACE_COLOUR, "#f6c65b", "#e4572e", "#9b1d3a", "#4a0d3a")
"""From small to large, evenly spaced, so that what is right looks like a plain surface."""
HEATMAP_RANGE = 1e-2  # first to last colour: errors in a frame vary by decades


def heatmap(n: int) -> list[str]:
    """Returns `n` colours of the heatmap, from its first to its last one."""
    ends = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in HEATMAP])
    places = np.linspace(0, len(HEATMAP) - 1, n)
    shades = [np.interp(places, np.arange(len(HEATMAP)), channel) for channel in ends.T]
    return [
        f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in np.rint(shades).astype(int).T
    ]


@dataclass(frozen=True)
class View:
    """The direction and the extent from which a mesh is drawn.

    Attributes:
        axes: unit vectors: right in the picture, up in the picture, towards the viewer.
        box: (2, 3) the corners of the axis-aligned box that fills the picture.
        up: "x", "y" or "z", the axis that is up in the picture.
        size: width and height in pixels.
        is_reversed: whether this axis points down instead, as in the axes of a camera.
    """

    axes: NDArray[np.float64]
    box: NDArray[np.floating[Any]]
    up: str
    size: tuple[int, int] = (480, 640)
    is_reversed: bool = False

    @classmethod
    def of(
        cls,
        frames: Positions,
        up: str,
        azimuth: float,
        size: tuple[int, int] = (480, 640),
        *,
        is_reversed: bool = False,
    ) -> "View":
        """Creates a view from slightly above, in which (k, 3) or (n, k, 3) positions all fit.

        The up axis is "x", "y" or "z"; a flat sheet is viewed from higher above. The azimuth is
        the angle around it in degrees, from the next axis (in the order x, y, z, x) towards the one
        after it.
        """
        check_choice("up", up, Axis)
        check_finite("azimuth", azimuth)
        points = frames.reshape(-1, 3)
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        axis = "xyz".index(up)
        extent = box[1] - box[0]
        flat = extent[axis] < 0.25 * extent.max()
        angle = np.radians(float(azimuth))
        towards = np.roll([0.9 if flat else 0.25, np.cos(angle), np.sin(angle)], axis)
        towards[axis] *= -1 if is_reversed else 1
        view = cls(np.eye(3), box, up, size, is_reversed)
        right = np.cross(view.upwards, towards)
        axes = unit(np.stack([right, np.cross(towards, right), towards]))
        return replace(view, axes=axes)

    @property
    def upwards(self) -> NDArray[np.float64]:
        """(3,) the direction that is up in the scene."""
        return np.asarray(np.eye(3)["xyz".index(self.up)] * (-1 if self.is_reversed else 1))

    def around(self, points: Positions) -> "View":
        """Returns the same view at the same scale, moved to other (k, 3) positions."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        half = (self.box[1] - self.box[0]) / 2
        return replace(self, box=np.stack([middle - half, middle + half]))


def render(
    faces: NDArray[np.integer[Any]],
    points: Positions,
    view: View,
    places: NDArray[np.floating[Any]],
    colours: Sequence[str],
    dots: Mask | None = None,
) -> Image:
    """Draws one frame, as (height, width, 3) uint8, on white.

    The `places` (k,) are from 0 for the first of `colours`, each as "#rrggbb", to 1 for the last.
    The `dots`, (k,) bool, are drawn as dots; they need not be in a face.
    """
    cells(faces, len(points))  # as VTK would end the process for a face out of range
    check_complete("points", points)
    if not np.isfinite(places).all():
        raise InputError("must be finite", argument="places")
    pyvista = load_pyvista()
    surface = pyvista.PolyData.from_regular_faces(
        np.asarray(points, np.float32), np.asarray(faces, np.int64)
    )
    surface["places"] = places.astype(np.float32)
    table = pyvista.LookupTable(list(colours), scalar_range=(0, 1))
    style = {"cmap": table, "show_scalar_bar": False, "ambient": 0.25, "diffuse": 0.85}
    plotter = pyvista.Plotter(off_screen=True, window_size=view.size, lighting="light kit")
    with closing(plotter):
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        if surface.n_cells:
            plotter.add_mesh(surface, scalars="places", smooth_shading=True, **style)
        if dots is not None and dots.any():
            cloud = pyvista.PolyData(surface.points[dots])
            size = {"point_size": max(view.size) / 120, "render_points_as_spheres": True}
            plotter.add_mesh(cloud, scalars=surface["places"][dots], **size, **style)
        camera, centre = plotter.camera, view.box.mean(axis=0)
        half = (view.box[1] - view.box[0]) / 2
        half = half if half.any() else np.ones(3)  # a single point has no extent
        width, height, _ = np.abs(view.axes) @ half
        camera.focal_point = centre
        camera.position = centre + 4 * np.linalg.norm(half) * view.axes[2]
        camera.up = view.axes[1]
        camera.parallel_projection = True
        camera.parallel_scale = 1.04 * max(height, width * view.size[1] / view.size[0])
        plotter.reset_camera_clipping_range()
        return np.asarray(plotter.screenshot(return_img=True), np.uint8)[..., :3]


def cropped(images: list[Image], margin: int = 12) -> list[Image]:
    """Crops white margins, from all images alike so that they stay comparable."""
    marked = np.any([(image < 250).any(axis=2) for image in images], axis=0)
    rows, columns = np.flatnonzero(marked.any(axis=1)), np.flatnonzero(marked.any(axis=0))
    if not len(rows):
        return images
    top, left = max(rows[0] - margin, 0), max(columns[0] - margin, 0)
    return [image[top : rows[-1] + margin, left : columns[-1] + margin] for image in images]


def load_pyvista() -> Any:
    """Imports pyvista, or raises an ImportError that names the extra which installs it."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        # Otherwise VTK looks for a screen and prints an error if there is none.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    return require("pyvista", extra="view")


def thin(
    faces: NDArray[np.integer[Any]], points: Positions, max_vertices: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Chooses vertices and triangles that represent a mesh.

    Edges are collapsed where the surface is flat, always onto one of their ends, so that the values
    of the kept vertices remain valid in all other frames. More than `max_vertices` are kept if
    non-manifold triangles prevent collapses, and those in no triangle are removed first.

    Returns the (v,) numbers of the kept vertices and (t, 3) triangles of these v.
    """
    if len(points) <= max_vertices:
        return np.arange(len(points)), np.asarray(faces, np.intp)
    if not np.isfinite(points).all():
        vertex = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise InputError(
            f"the first frame lacks vertex {vertex}, but is needed to simplify a large mesh"
        )
    pyvista = require("pyvista", extra="view")
    a, b, c = faces.T
    proper = faces[(a != b) & (b != c) & (c != a)]
    used = np.unique(proper)
    if len(used) <= max_vertices:
        return used, np.searchsorted(used, proper)
    surface = pyvista.PolyData.from_regular_faces(points[used], np.searchsorted(used, proper))
    surface["vertex"] = used
    with pyvista.vtk_verbosity("off"):
        thinned = surface.decimate_pro(
            1 - max_vertices / len(used), preserve_topology=True, splitting=False
        )
    return np.asarray(thinned["vertex"], np.intp), np.asarray(thinned.regular_faces, np.intp)
