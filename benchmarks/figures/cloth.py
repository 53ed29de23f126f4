"""The picture of a cloth that a depth camera recorded: the points, and the mesh tracked in them."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

import dynmesh
from dynmesh.draw import figures
from dynmesh.draw.figures import Mark, View
from dynmesh.metrics import bounding_box_diagonal
from dynmesh.normals import vertex_normals

from ..harness import progress
from .strip import DOTS, Panel, draw_surface, save

RECORDING = "kinect_cloth_scans.npz"
FILE = "recorded/cloth.webp"
LABEL = "distance from the points, % of the diagonal"
_SIZE = (330, 330)
_SHOWN_POINTS = 6000
_NEIGHBOURS = 12


def draw(data: Path, folder: Path, every: int) -> None:
    """Tracks the whole recording, and draws every so manyth frame."""
    with np.load(data / RECORDING) as stored:
        points, offsets = stored["points"].astype(np.float64), stored["offsets"]
        template, faces = stored["template_vertices"].astype(np.float64), stored["template_faces"]
    diagonal = bounding_box_diagonal(template)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = np.ptp(points, axis=0) / 2
    # From beside the camera, which is at the origin and looks along z.
    view = View((-0.6, 0, -1), (0.0, -1, 0), np.stack([middle - half, middle + half]), _SIZE)
    tracker = dynmesh.Tracker(faces, template)
    scans, meshes = [], []
    frames = list(pairwise(offsets.tolist()))
    for number, (first, end) in enumerate(progress(frames, FILE)):
        scan = points[first:end]
        mesh = tracker.push(scan, viewpoints=np.zeros((1, 3))).astype(np.float64)
        if number % every:
            continue
        dots = Mark(DOTS, faces[:0], scan[:: max(1, len(scan) // _SHOWN_POINTS)], 1.6)
        scans.append(figures.render_marked(faces[:1], mesh, view, [dots]))
        # From the mean of the points around a vertex, across the surface.
        around = scan[KDTree(scan).query(mesh, _NEIGHBOURS)[1]].mean(axis=1) - mesh
        distance = np.abs((around * vertex_normals(faces, mesh)).sum(axis=1))
        meshes.append(draw_surface(faces, mesh, view, distance / diagonal))
    panels = [Panel("recorded", "15 500 points of a frame", scans), Panel("tracked", "", meshes)]
    save(panels, folder / FILE, LABEL)
