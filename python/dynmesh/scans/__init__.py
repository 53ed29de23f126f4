"""Scans in files: point clouds and depth images, and the cameras that made them."""

from ..scan import DepthScan, PointScan, Scan
from .cameras import Rig, ScanCamera, read_cameras, write_cameras
from .opening import ScanSource, open_scans, unit_of_scans
from .point_files import read_points, write_ply
from .reader import ScanReader
from .writer import ScanRun, scan_folder

__all__ = [
    "DepthScan",
    "PointScan",
    "Rig",
    "Scan",
    "ScanCamera",
    "ScanReader",
    "ScanRun",
    "ScanSource",
    "open_scans",
    "read_cameras",
    "read_points",
    "scan_folder",
    "unit_of_scans",
    "write_cameras",
    "write_ply",
]
