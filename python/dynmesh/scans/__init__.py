"""Scans in files: point clouds and depth images, and the cameras that made them."""

from .cameras import Rig, ScanCamera, read_cameras, write_cameras
from .point_files import read_points, write_ply
from .reader import ScanReader, open_scans, unit_of_scans
from .scan import DepthScan, PointScan, Scan
from .writer import DepthFolder, PointFolder

__all__ = [
    "DepthFolder",
    "DepthScan",
    "PointFolder",
    "PointScan",
    "Rig",
    "Scan",
    "ScanCamera",
    "ScanReader",
    "open_scans",
    "read_cameras",
    "read_points",
    "unit_of_scans",
    "write_cameras",
    "write_ply",
]
