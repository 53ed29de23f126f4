"""results.json and report.html."""

import base64
import json
import platform
from collections.abc import Iterable
from dataclasses import asdict
from html import escape
from pathlib import Path

import numpy as np

from .._core import __version__
from .charts import LinearFit
from .claims import Claims, Verdict, compare
from .methods import BEYOND, COMPARED, DETAIL, LIA_ON_MOTION, MOTION, Method
from .plan import PAPER_SHARES, SCENARIOS, Study
from .style import percent, scientific

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 1em 0; }
td, th { border: 1px solid #ccc; padding: 0.25em 0.6em; text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
.yes { color: #00614a; font-weight: bold; } .no { color: #b34700; font-weight: bold; }
"""

_TITLES = {
    "figure7": "Figure 7: iterations and time against the share of known vertices. Lines are "
    "medians over the frames, bands the whole range (iterations) and the quartiles (time).",
    "figure8": "Figure 8: known and missing vertices, and the error after completion by motion.",
    "figure9": "Figure 9: error and time of all methods. Lines are means (error) and medians "
    "(time) over the frames, bands the 10th to 90th percentile and the quartiles. Dashed: the "
    "baselines on motion vectors, which the paper does not have.",
    "figure10": "Figure 10: motion, LIA and LSM beside the original.",
    "figure11": "Figure 11: reconstructions by motion at four shares beside the original.",
    "figure12": "Figure 12, beyond the paper: vertices hidden from a camera or by patches, instead "
    "of at random.",
    "figure13": "Figure 13, beyond the paper: both readings of the weights. Estimated once only, "
    "errors feed on themselves.",
    "figure14": "Figure 14, beyond the paper: detail beside motion, LIA on motion and libigl. "
    "Lines are as in figure 9; dashed are the rivals.",
    "figure15": "Figure 15, beyond the paper: motion, detail and libigl beside the original, and "
    "their errors, where few vertices are known.",
}


def write_results(studies: list[Study], claims: Claims, plan: str, seed: int, folder: Path) -> Path:
    """Writes all numbers as JSON, NMSVE in bounding-box diagonals."""
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
    """Writes a page that stands alone, pictures and all."""
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>dynmesh: the paper's "
        f"evaluation</title><style>{_STYLE}</style>",
        "<h1>The paper's evaluation, reproduced</h1>",
        f"<p>Arvanitis, Lalos, Moustakas and Fakotakis: Fast and Effective Dynamic Mesh "
        f"Completion, WSCG 2017. Made by dynmesh {__version__}, {escape(plan)}. Times are of this "
        f"machine, one thread; NMSVE is in bounding-box diagonals of the first frame.</p>",
        "<h2>The claims</h2>",
        _claims_table(claims.paper),
        "<h2>Beyond the paper: detail</h2>",
        "<p>Detail keeps the shape of the mesh. It is compared with motion, with LIA on motion and "
        "with libigl: the biharmonic field of motion vectors, with the operator of the first "
        "frame, and ARAP, as rigid as possible from the first frame.</p>",
        *_left_out(studies),
        _claims_table(claims.detail),
        "<h2>Where motion is better, and where not</h2>",
        "<p>Each rival's error and time as multiples of those of motion: above 1, motion is "
        "better; <span class='no'>below 1</span>, the rival is.</p>",
        *(_comparison_table(study, MOTION, COMPARED) for study in studies),
        "<h2>Where detail is better, and where not</h2>",
        "<p>The same for detail.</p>",
        *(
            _comparison_table(study, DETAIL, (MOTION, LIA_ON_MOTION, *study.beyond))
            for study in studies
        ),
        *(_error_table(study) for study in studies),
        "<h2>Figures</h2>",
    ]
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


def _numbers(study: Study) -> dict[str, object]:
    methods = (*COMPARED, *study.beyond)
    return {
        "frames": study.subject.n_frames,
        "vertices": study.subject.n_vertices,
        "linear_fit": asdict(LinearFit.of(study)),
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
        "missing": study.missing,
    }


def _left_out(studies: list[Study]) -> list[str]:
    labels = {method.key: method.label for method in BEYOND}
    return [
        f"<p class='no'>Left out on {escape(study.subject.name)}: {escape(labels[key])}; "
        f"{escape(why)}.</p>"
        for study in studies
        for key, why in study.missing.items()
    ]


def _claims_table(claims: list[Verdict]) -> str:
    rows = [
        f"<tr><td>{escape(v.claim)}</td><td>{escape(v.sequence)}</td>"
        f"<td class='{'yes' if v.holds else 'no'}'>{'holds' if v.holds else 'does not hold'}</td>"
        f"<td>{escape(v.evidence)}</td></tr>"
        for v in sorted(claims, key=lambda v: [c.claim for c in claims].index(v.claim))
    ]
    head = "<tr><th>claim</th><th>sequence</th><th>verdict</th><th>measured</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _comparison_table(study: Study, ours: Method, methods: Iterable[Method]) -> str:
    rivals = [method for method in methods if method is not ours]
    columns = [compare(study, ours, rival) for rival in rivals]
    head = "".join(
        f"<th>{escape(c)}</th>" for c in [study.subject.name, *(r.label for r in rivals)]
    )
    rows = [
        f"<tr><td>{escape(setting)}</td>"
        + "".join(
            f"<td class='number'>error {_factor(column[setting].error)}<br>"
            f"time {_factor(column[setting].time)}</td>"
            for column in columns
        )
        + "</tr>"
        for setting in columns[0]
    ]
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _factor(value: float) -> str:
    return f"{value:.2f}" if value >= 1 else f"<span class='no'>{value:.2f}</span>"


def _error_table(study: Study) -> str:
    columns = [*(percent(s) for s in PAPER_SHARES), *SCENARIOS]
    head = "".join(f"<th>{escape(c)}</th>" for c in ["method", *columns])
    rows = []
    for method in (*COMPARED, *study.beyond):
        runs = [study.grid[method.key, share] for share in PAPER_SHARES]
        runs += [study.scenarios[name, method.key] for name in SCENARIOS]
        cells = "".join(
            f"<td class='number'>{scientific(run.nmsve.mean())}<br>"
            f"{1e3 * np.median(run.seconds):.3g} ms</td>"
            for run in runs
        )
        rows.append(f"<tr><td>{escape(method.label)}</td>{cells}</tr>")
    title = f"<h2>{escape(study.subject.name)}: mean NMSVE and median time</h2>"
    return f"{title}<table><tr>{head}</tr>{''.join(rows)}</table>"
