"""The result: what was found, and what there is to say about the sequence."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import TopologyReport
from ..files import Header
from ..sequence import Positions
from .finding import MOST_PLACES, SEVERITIES, Finding, Severity
from .placement import Unit

SCHEMA_VERSION = 1


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is odd about a mesh and its motion.

    Attributes:
        findings: the most important first; empty where nothing is odd.
        header: what the file says.
        topology: what the core says of the connectivity; None where there are no faces.
        first_frame: (k, 3), NaN where frame 0 lacks a vertex.
        diagonal: of the bounding box of frame 0, in the unit of the positions.
        mean_edge: of frame 0, in the same unit; None where it has no edges longer than 0.
        known_share: (n,) float64, of each frame the share of the vertices that was observed.
        motion: (n,) float64, of each frame the median distance that a vertex moved since the one
            before, in diagonals; NaN for frame 0 and where too little was seen.
        likely_up: "y" or "z"; a guess where the file does not say.
        likely_unit: in which it would be as large as a person; a guess; None where it cannot be
            one.
    """

    findings: tuple[Finding, ...]
    header: Header
    topology: TopologyReport | None
    first_frame: Positions
    diagonal: float
    mean_edge: float | None
    known_share: NDArray[np.float64]
    motion: NDArray[np.float64]
    likely_up: str
    likely_unit: Unit | None

    def __repr__(self) -> str:
        """The codes of the findings."""
        return f"Diagnosis({', '.join(f.code for f in self.findings) or 'nothing odd'})"

    @property
    def severity(self) -> Severity | None:
        """That of the most important finding; None where nothing is odd."""
        return self.findings[0].severity if self.findings else None

    def count(self, severity: Severity) -> int:
        """How many findings of a severity there are."""
        return sum(finding.severity == severity for finding in self.findings)

    def as_json(self, *, most_places: int = MOST_PLACES) -> str:
        """The JSON that docs/diagnosis.md describes, with at most so many places of each kind."""
        return json.dumps(self.as_dict(most_places=most_places), indent=2, allow_nan=False)

    def as_dict(self, *, most_places: int = MOST_PLACES) -> dict[str, Any]:
        """The same as dicts, lists, strings, numbers and None."""
        header, shares = self.header, self.known_share[1:]
        motion = self.motion[np.isfinite(self.motion)]
        unit = self.likely_unit
        return {
            "schema": "dynmesh-diagnosis",
            "version": SCHEMA_VERSION,
            "severity": self.severity,
            "counts": {severity: self.count(severity) for severity in SEVERITIES},
            "findings": [_finding_as_dict(finding, most_places) for finding in self.findings],
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                "name": header.name,
                "fps": header.fps,
                "start": header.start,
                "times": None if header.times is None else header.times.tolist(),
                "up_axis": header.up_axis,
                "likely_up": self.likely_up,
                "metres_per_unit": header.metres_per_unit,
                "likely_metres_per_unit": None if unit is None else unit.metres,
                "has_known": header.has_known,
                "has_provenance": header.has_provenance,
            },
            "mesh": {
                **_topology_as_dict(self.topology),
                "triangles": len(header.faces),
                "polygons": None if header.polygons is None else len(header.polygons.sizes),
                "diagonal": self.diagonal,
                "mean_edge": self.mean_edge,
            },
            "known_share": {
                "mean": float(shares.mean()) if len(shares) else None,
                "least": float(shares.min()) if len(shares) else None,
                "most": float(shares.max()) if len(shares) else None,
            },
            "motion": {
                "median": float(np.median(motion)) if len(motion) else None,
                "most": float(motion.max()) if len(motion) else None,
            },
        }


def _topology_as_dict(topology: TopologyReport | None) -> dict[str, Any]:
    names = ("components", "isolated_vertices", "boundary_edges")
    told = {name: None if topology is None else getattr(topology, name) for name in names}
    closed = None if topology is None else topology.boundary_edges == 0
    refused = None if topology is None else len(topology.refused_faces)
    return {**told, "closed": closed, "refused_faces": refused}


def _finding_as_dict(finding: Finding, most_places: int) -> dict[str, Any]:
    kinds = ("vertices", "faces", "frames")
    return {
        "code": finding.code,
        "severity": finding.severity,
        "count": finding.count,
        "worst": finding.worst,
        "message": finding.message,
        "advice": finding.advice,
        "where": {kind: getattr(finding.where, kind)[:most_places].tolist() for kind in kinds},
    }
