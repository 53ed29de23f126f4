"""The result of a diagnosis: the findings and a description of the sequence."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import Header
from ..topology import TopologyReport
from .finding import SEVERITIES, Finding, Severity

SCHEMA_VERSION = 1


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The problems of a mesh and its motion.

    Attributes:
        findings: the most important first; empty if there are no problems.
        header: what the file states.
        topology: the report of the topology; None if there are no faces.
        diagonal: of the bounding box of frame 0, in the unit of the positions.
        mean_edge: of frame 0, in the same unit; None if no edge is longer than 0.
        known_share: (n,) float64, the share of the vertices that was observed in each frame.
        motion: (n,) float64, the median distance that a vertex moved since the previous frame, in
            diagonals; NaN for frame 0 and for frames with too few observed vertices.
        likely_up: "y" or "z"; a guess if the file does not state it.
    """

    findings: tuple[Finding, ...]
    header: Header
    topology: TopologyReport | None
    diagonal: float
    mean_edge: float | None
    known_share: NDArray[np.float64]
    motion: NDArray[np.float64]
    likely_up: str

    def __repr__(self) -> str:
        """Lists the codes of the findings."""
        return f"Diagnosis({', '.join(f.code for f in self.findings) or 'no findings'})"

    def __str__(self) -> str:
        """Returns the summary and, for each finding, what was found and the advice."""
        told = [f"{f.severity}: {f.message}\n  {f.advice}" for f in self.findings]
        return "\n".join([self.summary, *told])

    @property
    def summary(self) -> str:
        """How many problems there are, such as "1 error, 2 warnings"."""
        counts = [(self.count(severity), severity) for severity in SEVERITIES]
        told = [f"{n} {severity}{'s' if n > 1 else ''}" for n, severity in counts if n]
        return ", ".join(told) or "No problems were found."

    @property
    def severity(self) -> Severity | None:
        """The severity of the most important finding; None if there are none."""
        return self.findings[0].severity if self.findings else None

    def count(self, severity: Severity) -> int:
        """Returns the number of findings of this severity."""
        return sum(finding.severity == severity for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Returns dicts, lists, strings, numbers and None, as JSON has them."""
        header, shares = self.header, self.known_share[1:]
        motion = self.motion[np.isfinite(self.motion)]
        return {
            "schema": "dynmesh-diagnosis",
            "version": SCHEMA_VERSION,
            "severity": self.severity,
            "counts": {severity: self.count(severity) for severity in SEVERITIES},
            "findings": [_finding_as_dict(one, header) for one in self.findings],
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


def _finding_as_dict(finding: Finding, header: Header) -> dict[str, Any]:
    where = {
        kind: getattr(finding.where, kind).tolist() for kind in ("vertices", "faces", "frames")
    }
    where["frames"] = [header.number(frame) for frame in where["frames"]]
    return {
        "code": finding.code,
        "severity": finding.severity,
        "count": finding.count,
        "worst": finding.worst,
        "message": finding.message,
        "advice": finding.advice,
        "where": where,
    }
