"""The files that the evaluation writes: results.json and report.html."""

import base64
import json
import platform
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .._core import __version__
from .charts import linear_fit
from .claims import Claims
from .losses import SCENARIOS
from .result_tables import evidence_table, sequence_table
from .sequence_study import Study
from .tables import html

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; }
td, th { border: 1px solid #ccc; padding: 0.25em 0.6em; text-align: left; vertical-align: top; }
td b, p b { color: #b34700; }
"""

_TITLES = {
    "figure7": "Figure 7: iterations and time against the share of known vertices. Lines are "
    "medians over the frames; bands are the whole range (iterations) and the quartiles (time).",
    "figure8": "Figure 8: known and missing vertices, and the error after completion by motion.",
    "figure9": "Figure 9: error and time of the methods. Lines are means (error) and medians "
    "(time) over the frames; bands are the 10th to 90th percentile and the quartiles. The dashed "
    "lines are the baselines applied to motion vectors, which the paper does not have.",
    "figure10": "Figure 10: the original, motion, LIA and LSM.",
    "figure11": "Figure 11: the original, and reconstructions by motion at four shares of known "
    "vertices.",
}


def write_results(studies: list[Study], claims: Claims, plan: str, seed: int, folder: Path) -> Path:
    """Write all numbers as JSON. NMSVE is in bounding-box diagonals, without the factor of 10⁴."""
    results = {
        "dynmesh": __version__,
        "numpy": np.__version__,
        "machine": platform.machine(),
        "plan": plan,
        "seed": seed,
        "sequences": {study.subject.name: _numbers(study) for study in studies},
        "claims": [asdict(verdict) for verdict in claims.paper],
        "detail_claims": [asdict(verdict) for verdict in claims.detail],
    }
    path = folder / "results.json"
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return path


def write_report(
    studies: list[Study], claims: Claims, plan: str, pictures: list[Path], folder: Path
) -> Path:
    """Write a page that contains all tables and figures and needs no other file."""
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>dynmesh: the evaluation of "
        f"the paper</title><style>{_STYLE}</style>",
        "<h1>The evaluation of the paper</h1>",
        f"<p>Arvanitis, Lalos, Moustakas and Fakotakis: Fast and Effective Dynamic Mesh "
        f"Completion, WSCG 2017. Reproduced by dynmesh {__version__}, {escape(plan)}.</p>"
        "<p>Errors are NMSVE &times; 10⁴ in bounding-box diagonals of frame 0, averaged over all "
        "frames after frame 0; results.json has them without the factor of 10⁴. Times are the "
        "median processor time of a frame on this machine, in one thread.</p>",
        "<h2>The claims of the paper</h2>",
        html(evidence_table(claims.paper)),
        "<h2>Detail</h2>",
        "<p>Method detail preserves the shape of the mesh, which the paper does not have.</p>",
        html(evidence_table(claims.detail)),
    ]
    for study in studies:
        parts.append(f"<h2>{escape(study.subject.name)}: error and time of every method</h2>")
        parts.append(html(sequence_table(study, study.methods)))
    parts.append("<h2>Figures</h2>")
    titles = dict(_TITLES)
    for picture in pictures:
        if title := titles.pop(picture.stem.split("_")[0], ""):
            parts.append(f"<p>{escape(title)}</p>")
        data = base64.b64encode(picture.read_bytes()).decode()
        parts.append(f"<img alt='{escape(picture.stem)}' src='data:image/png;base64,{data}'>")
    path = folder / "report.html"
    path.write_text("\n".join(parts) + "\n</html>\n", encoding="utf-8")
    return path


def _numbers(study: Study) -> dict[str, Any]:
    return {
        "frames": study.subject.n_frames,
        "vertices": study.subject.n_vertices,
        "linear_fit": linear_fit(study)._asdict(),
        "sweep": {str(share): run.summary() for share, run in study.sweep.items()},
        "grid": {
            method.key: {
                str(share): study.grid[method.key, share].summary()
                for share in study.shares(method)
            }
            for method in study.methods
        },
        "scenarios": {
            name: {
                method.key: study.scenarios[name, method.key].summary() for method in study.methods
            }
            for name in SCENARIOS
        },
    }
