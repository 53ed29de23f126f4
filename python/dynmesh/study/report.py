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
from .baselines import BEYOND
from .charts import linear_fit
from .claims import Claims
from .losses import SCENARIOS
from .methods import COMPARED, DETAIL, LIA_ON_MOTION, MOTION
from .result_tables import comparison_table, evidence_table, sequence_table, training_table
from .sequence_study import Study
from .tables import html

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; }
td, th { border: 1px solid #ccc; padding: 0.25em 0.6em; text-align: left; vertical-align: top; }
td b, p b { color: #b34700; }
"""

_TRAINING = (
    "<h2>Beyond the paper: training, and matrix completion</h2>"
    "<p>The training frames are at most 50 of the first half of each sequence. At most 50 frames "
    "of the second half were completed. Errors are relative to that of detail without training; "
    "<b>below 1</b>, the method is more accurate. The prior weight tells how far detail used the "
    "training frames, from 0 to 1; the time is relative to that of detail. Matrix completion "
    "(Candes and Recht 2012) fills in all frames of the second half at once, from later frames "
    "too, by low rank, and with the graph of the mesh (Vlachos et al. 2017) also by smoothness; it "
    "cannot work live. Its parameters were chosen by 5 % of the vertices, held out.</p>"
)

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
    "figure12": "Figure 12, beyond the paper: vertices are hidden from a camera or by patches, "
    "instead of lost at random.",
    "figure13": "Figure 13, beyond the paper: both readings of the weights. If they are estimated "
    "once only, errors grow from frame to frame.",
    "figure14": "Figure 14, beyond the paper: detail, motion, LIA on motion and libigl. Lines are "
    "as in figure 9; the other methods are dashed.",
    "figure16": "Figure 16, beyond the paper: the error bars of detail, predicted against true. "
    "On the dashed line they are exact; above it on the left, and below it on the right, they are "
    "too wide.",
    "figure15": "Figure 15, beyond the paper: the original, motion, detail and libigl, and their "
    "errors, where few vertices are known.",
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
        "<h2>Beyond the paper: detail</h2>",
        "<p>Method detail preserves the shape of the mesh. It is compared with motion, with LIA on "
        "motion and with methods of libigl: the biharmonic field of motion vectors, with the "
        "operator of frame 0, and ARAP, as rigid as possible from frame 0.</p>",
        *_left_out(studies),
        html(evidence_table(claims.detail)),
        "<h2>Other methods relative to motion</h2>",
        "<p>The error and time of each method relative to those of motion. Above 1, motion is "
        "better; <b>below 1</b>, the other method is better.</p>",
        *(html(comparison_table(study, MOTION, COMPARED)) for study in studies),
        "<h2>Other methods relative to detail</h2>",
        "<p>The same for detail.</p>",
        *(
            html(comparison_table(study, DETAIL, (MOTION, LIA_ON_MOTION, *study.beyond)))
            for study in studies
        ),
    ]
    second_halves = {
        study.subject.name: study.second_half.numbers() for study in studies if study.second_half
    }
    if second_halves:
        parts += [_TRAINING, html(training_table(second_halves))]
    for study in studies:
        parts.append(f"<h2>{escape(study.subject.name)}: error and time of every method</h2>")
        parts.append(html(sequence_table(_numbers(study))))
    parts.append("<h2>Figures</h2>")
    shown = set()
    for picture in pictures:
        figure = picture.stem.split("_")[0]
        if figure not in shown:
            parts.append(f"<p>{escape(_TITLES[figure])}</p>")
            shown.add(figure)
        data = base64.b64encode(picture.read_bytes()).decode()
        parts.append(f"<img alt='{escape(picture.stem)}' src='data:image/png;base64,{data}'>")
    path = folder / "report.html"
    path.write_text("\n".join(parts) + "\n</html>\n", encoding="utf-8")
    return path


def _numbers(study: Study) -> dict[str, Any]:
    methods = (*COMPARED, *study.beyond)
    return {
        "frames": study.subject.n_frames,
        "vertices": study.subject.n_vertices,
        "linear_fit": asdict(linear_fit(study)),
        "sweep": {str(share): run.summary() for share, run in study.sweep.items()},
        "grid": {
            method.key: {
                str(share): study.grid[method.key, share].summary()
                for share in study.shares(method)
            }
            for method in methods
        },
        "once_only": {str(share): run.summary() for share, run in study.once.items()},
        "scenarios": {
            name: {method.key: study.scenarios[name, method.key].summary() for method in methods}
            for name in SCENARIOS
        },
        "error_bars": {name: asdict(found.calibration) for name, found in study.bars.items()},
        "missing": study.missing,
        "second_half": None if study.second_half is None else study.second_half.numbers(),
    }


def _left_out(studies: list[Study]) -> list[str]:
    labels = {method.key: method.label for method in BEYOND}
    return [
        f"<p><b>Left out on {escape(study.subject.name)}: {escape(labels[key])}; "
        f"{escape(why)}.</b></p>"
        for study in studies
        for key, why in study.missing.items()
    ]
