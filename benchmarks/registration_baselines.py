"""What other libraries offer for registering a mesh with one scan, if they are installed."""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from dynmesh.scans import Scan
from dynmesh.sequence import Positions

from .subjects import Subject
from .tracking_table import Register
from .tracking_table import baselines as of_trimesh

_VERTICES, _POINTS = 1000, 2000
"""So many of them CPD can take in seconds; the other vertices follow its displacement field."""
_ICP_RADIUS = 0.1
"""How far rigid ICP searches, in diagonals of the scan."""


def baselines(subject: Subject) -> dict[str, Register]:
    """Return the methods of the libraries that are installed, by name, with their defaults."""
    optional: dict[str, tuple[str, Callable[..., Positions]]] = {
        "rigid ICP (Open3D)": ("open3d", _rigid),
        "CPD (pycpd)": ("pycpd", _cpd),
    }
    found = of_trimesh(subject)
    for name, (module, method) in optional.items():
        if find_spec(module) is not None:
            found[name] = partial(method, import_module(module))
    return found


def _rigid(open3d: Any, last: Positions, scan: Scan) -> Positions:
    """Iterates closest points and planes, from the scan to the mesh as it is elsewhere here."""
    clouds = []
    for points in (scan.cloud, last):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(np.float64)))
        cloud.estimate_normals()
        clouds.append(cloud)
    found = open3d.pipelines.registration.registration_icp(
        *clouds,
        _ICP_RADIUS * float(np.linalg.norm(np.ptp(scan.cloud, axis=0))),
        np.eye(4),
        open3d.pipelines.registration.TransformationEstimationPointToPlane(),
    )
    inverse = np.linalg.inv(found.transformation)
    return np.asarray(last @ inverse[:3, :3].T + inverse[:3, 3])


def _cpd(pycpd: Any, last: Positions, scan: Scan) -> Positions:
    """Coherent point drift (Myronenko and Song 2010), at the usual scale of its parameters."""
    rng = np.random.default_rng(0)

    def some(rows: Positions, n: int) -> Positions:
        return rows[rng.permutation(len(rows))[:n]]

    centre = scan.cloud.mean(axis=0)
    size = float(np.sqrt(((scan.cloud - centre) ** 2).sum(axis=1).mean()))
    mesh, points = (last - centre) / size, (scan.cloud - centre) / size
    drift = pycpd.DeformableRegistration(X=some(points, _POINTS), Y=some(mesh, _VERTICES))
    drift.register()
    kernel = np.exp(-cdist(mesh, drift.Y, "sqeuclidean") / (2 * drift.beta**2))
    return np.asarray((mesh + kernel @ drift.W) * size + centre)
