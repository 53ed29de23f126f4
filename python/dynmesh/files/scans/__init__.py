"""Scans in files: point clouds and depth images, and the cameras that made them."""

from ...frames.scan import DepthScan, PointScan, Scan
from .cameras import UNITS, Rig, ScanCamera, given_unit, read_cameras, write_cameras
from .point_files import read_points, write_ply
from .reader import ScanReader, open_scans, unit_of_scans
from .writer import DepthFolder, PointFolder

__all__ = [
    "UNITS",
    "DepthFolder",
    "DepthScan",
    "PointFolder",
    "PointScan",
    "Rig",
    "Scan",
    "ScanCamera",
    "ScanReader",
    "given_unit",
    "open_scans",
    "read_cameras",
    "read_points",
    "unit_of_scans",
    "write_cameras",
    "write_ply",
]
