"""dynmesh completes dynamic meshes in real time.

The connectivity is fixed, the first frame is complete, and of every later frame only some vertices
were observed. dynmesh estimates the others, frame by frame, from that frame and earlier ones only:

    completer = dynmesh.Completer(faces, first_frame)
    for points, known in sensor:
        frame = completer.push(points, known)

In raw scans and depth images, whose points belong to no vertex, a tracker finds the mesh:

    tracker = dynmesh.Tracker(faces, first_frame)
    for points, normals in scanner:
        frame = tracker.push(points, normals)

The method of the completer is that of Arvanitis, Lalos, Moustakas and Fakotakis, "Fast and
Effective Dynamic Mesh Completion" (WSCG 2017).
"""

from . import baselines, degrade, draw, metrics, synth
from ._core import (
    Agreement,
    Alignment,
    Completer,
    FrameReport,
    RefusedFace,
    TopologyReport,
    Tracker,
    TrackingReport,
    __version__,
    cells,
    find_alignment,
)
from ._errors import DynmeshError
from .completion.in_memory import complete
from .diagnosis import Diagnosis, Finding, diagnose
from .files import Writer, create, create_like, open, read, write
from .files.frame import Frame
from .files.header import Header
from .files.reader import Reader
from .matrices import adjacency, laplacian
from .polygons import Polygons
from .registration import Registration, register, register_depth
from .sequence import Description, Sequence
from .verbs.complete import FileReport, complete_file
from .verbs.convert import ConversionReport, convert, convert_file
from .verbs.evaluate import Evaluation, FrameErrors, evaluate
from .verbs.show import picture, view
from .whole_frames import WholeFrame, whole_frame

__all__ = [
    "Agreement",
    "Alignment",
    "Completer",
    "ConversionReport",
    "Description",
    "Diagnosis",
    "DynmeshError",
    "Evaluation",
    "FileReport",
    "Finding",
    "Frame",
    "FrameErrors",
    "FrameReport",
    "Header",
    "Polygons",
    "Reader",
    "RefusedFace",
    "Registration",
    "Sequence",
    "TopologyReport",
    "TrackFileReport",
    "Tracker",
    "TrackingReport",
    "WholeFrame",
    "Writer",
    "__version__",
    "adjacency",
    "baselines",
    "batch",
    "cells",
    "complete",
    "complete_file",
    "convert",
    "convert_file",
    "create",
    "create_like",
    "degrade",
    "diagnose",
    "draw",
    "evaluate",
    "find_alignment",
    "info",
    "laplacian",
    "metrics",
    "open",
    "picture",
    "read",
    "register",
    "register_depth",
    "register_file",
    "synth",
    "track_file",
    "view",
    "whole_frame",
    "write",
]

info = diagnose
"""The name of the same in the shell."""
