"""Makes landmarks for `dynmesh register` out of points that were picked in a viewer.

    python landmarks.py body.obj body_points.pp scan_points.pp landmarks.json

Pick at least three points on the template and, in the same order, the same points on the scan, such
as head, hands and feet. The nearest vertex of the template is taken. The points are those of

- MeshLab, "PickPoints", saved as .pp; points that were switched off there are left out.
- CloudCompare, "Point picking", "Point list picking", saved as text.
- Blender: put empties at the points, named in their order, select them, and run
  `for o in sorted(C.selected_objects, key=lambda o: o.name): print(*o.matrix_world.translation)`
  in its console; save what it prints. Import the files with forward Y and up Z, so that they keep
  their axes.

A text has one point a line, whose last three numbers are x, y and z.
"""

import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

import dynmesh


def read_points(path: Path) -> list[list[float]]:
    """Returns the points of a file of a viewer."""
    if path.suffix.lower() == ".pp":
        points = ElementTree.parse(path).iter("point")
        picked = [point for point in points if point.get("active") != "0"]
        return [[float(point.attrib[axis]) for axis in "xyz"] for point in picked]
    lines = [re.split(r"[\s,;]+", line.strip(" \t,;")) for line in path.read_text().splitlines()]
    return [[float(word) for word in line[-3:]] for line in lines if line != [""]]


def main(template: Path, of_template: Path, of_scan: Path, output: Path) -> None:
    """Pairs the points of the two files."""
    vertices = dynmesh.read(template).vertices[0]
    ours, theirs = read_points(of_template), read_points(of_scan)
    if len(ours) != len(theirs):
        sys.exit(f"{of_template} has {len(ours)} points, but {of_scan} has {len(theirs)}")
    nearest = [int(np.linalg.norm(vertices - point, axis=1).argmin()) for point in ours]
    landmarks = [{"vertex": v, "position": p} for v, p in zip(nearest, theirs, strict=True)]
    output.write_text(json.dumps(landmarks, indent=2) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit("usage: python landmarks.py TEMPLATE TEMPLATE_POINTS SCAN_POINTS LANDMARKS")
    main(*map(Path, sys.argv[1:]))
