"""Sheets with provenance, holes and errors, as pages and pictures show them."""

from dataclasses import replace

import numpy as np
from meshes import sheet

from dynmesh import Sequence

MESH = sheet(12)
X = MESH.vertices[:, 0]
RIGHT = np.repeat([[False], [True]], [1, 8], axis=0) & (X > 5.5)
"""The right half of all frames after the first."""
MOVING = Sequence(
    MESH.vertices + np.arange(9)[:, None, None] * np.array([1, 0, 0]),
    MESH.faces,
    fps=10.0,
    generation=2 * RIGHT.astype(np.int32),
    age=2 * RIGHT.astype(np.int32),
)
"""A sheet that moves along x at constant speed, with provenance."""
TRUTH = Sequence(np.stack([MESH.vertices] * 9), MESH.faces, fps=0.05)
"""A sheet that stays; its frames follow one another slowly."""
PRESENT = np.ones(TRUTH.vertices.shape[:2], np.bool_)
PRESENT[2:4], PRESENT[4], PRESENT[3, 30] = False, X > 5.5, True
HOLED = replace(TRUTH, known=PRESENT, vertices=np.where(PRESENT[..., None], TRUTH.vertices, np.nan))
"""The sheet, wholly but in frame 2, which is empty, 3, which is a dot, and 4, which is half."""
KNOWN = ~RIGHT
KNOWN[5] = X < 2.5
PARTIAL = replace(TRUTH, known=KNOWN, vertices=np.where(KNOWN[..., None], TRUTH.vertices, np.nan))
"""The right half is missing after frame 0; in frame 5, more."""
ERROR = np.where(np.arange(9) == 7, 2.0, 0.2)[:, None] * ~KNOWN
COMPLETED = replace(
    TRUTH,
    vertices=TRUTH.vertices + ERROR[..., None] * [0, 0, 1],
    generation=(~KNOWN).astype(np.int32),
    age=3 * (~KNOWN).astype(np.int32),
)
"""The missing vertices are estimated too high; the error is largest in frame 7."""
