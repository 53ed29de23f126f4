"""Compares the methods of `dynmesh reproduce` with libigl, and draws figures 12 to 15.

    python -m benchmarks.beyond [FOLDER NAME ...] --out OUT

OUT gets the figures: 12 where vertices are hidden from a camera or by patches, 13 with both
readings of the weights, 14 and 15 with detail and libigl; and claims.json, which benchmarks.claims
shows. For each sequence, a table of errors and times is printed. A method of libigl that cannot
complete a sequence is left out.
"""

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from dynmesh.draw import figures
from dynmesh.study.charts import along_frames, compared, shown
from dynmesh.study.claims import Verdict, detail_verdicts, listed, relative
from dynmesh.study.completion import Method
from dynmesh.study.losses import PAPER_SHARES, SCENARIOS
from dynmesh.study.measure import Run
from dynmesh.study.methods import COMPARED, DETAIL, LIA_ON_MOTION, MOTION
from dynmesh.study.pictures import heatmaps, in_rows, sheet, surfaces, view_of
from dynmesh.study.result_tables import claims_table, sequence_table
from dynmesh.study.sequence_study import Study, pictured_frames
from dynmesh.study.style import NMSVE_LABEL, new_figure, nmsve_caption, save
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import percent

from .baselines import BASELINES, BIHARMONIC, ONCE
from .harness import Table, parser, progress, sequences, show

_LARGEST_SHOWN = 1e5  # in the unit of the figures; larger errors are outside the picture
_FASTER_THAN_BIHARMONIC = 1.5


def study(subject: Subject, seed: int = 0) -> Study:
    """Measure all methods on one sequence, but those of libigl that cannot run or complete it."""
    result = Study(subject, seed)
    result.measure(ONCE, PAPER_SHARES, ())
    for method in progress((*COMPARED, *BASELINES), subject.name):
        try:
            result.measure(method, PAPER_SHARES)
        except (ImportError, RuntimeError) as error:
            if method not in BASELINES:
                raise
            print(f"{subject.name}: {method.label} is left out: {error}", file=sys.stderr)
    return result


def measured(study: Study, methods: tuple[Method, ...]) -> list[Method]:
    """Return those methods that were measured."""
    return [method for method in methods if study.shares(method)]


def verdicts(study: Study) -> list[Verdict]:
    """Judge the claims about detail."""
    found = detail_verdicts(study, measured(study, (MOTION, LIA_ON_MOTION, *BASELINES)))
    if study.shares(BIHARMONIC):
        times = relative(study, DETAIL, BIHARMONIC, lambda run: float(np.median(run.seconds)))
        words = f"time of the biharmonic relative to that of detail: {listed(times)}"
        claim = f"Detail is at least {_FASTER_THAN_BIHARMONIC:g} times as fast as the biharmonic."
        holds = min(times.values()) >= _FASTER_THAN_BIHARMONIC
        found.insert(-1, Verdict(claim, study.subject.name, holds, words))
    return found


def hidden_parts(studies: list[Study], folder: Path) -> Path:
    """Draw the error of all methods if vertices are hidden from a camera or by patches."""
    methods = [*COMPARED, *BASELINES]
    width = 0.86 / len(methods)
    with new_figure(13.5, 5.2) as figure:
        axes = figure.subplots(1, len(SCENARIOS), sharey=True)
        for axis, (name, words) in zip(axes, SCENARIOS.items(), strict=True):
            for index, method in enumerate(methods):
                runs = {
                    number: shown(study.scenarios[name, method.key])
                    for number, study in enumerate(studies)
                    if (name, method.key) in study.scenarios
                }
                centres = np.array([*runs]) + width * (index - (len(methods) - 1) / 2)
                means = np.array([errors.mean() for errors in runs.values()])
                spreads = [np.percentile(errors, (10, 90)) for errors in runs.values()]
                below, above = np.array(spreads).reshape(-1, 2).T
                axis.bar(
                    centres,
                    means,
                    0.92 * width,
                    color=method.colour,
                    label=method.label,
                    hatch="///" if method.dash == "--" else None,
                    edgecolor="white",
                    yerr=np.clip([means - below, above - means], 0, None),
                    ecolor="#555555",
                )
            axis.set_xticks(range(len(studies)), [study.subject.name for study in studies])
            axis.set(title=words, yscale="log")
            axis.grid(visible=False, axis="x")
        axes[0].set(ylabel=NMSVE_LABEL)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        return save(figure, folder, "figure12_camera_and_patches", is_chart=True)


def two_readings(studies: list[Study], folder: Path) -> Path:
    """Draw the error of the two readings of the weights along the frames."""
    with new_figure(13.5, 4.0 * len(studies) + 0.6) as figure:
        axes = figure.subplots(len(studies), len(PAPER_SHARES), sharey="row", squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            for axis, share in zip(row, PAPER_SHARES, strict=True):
                for method, label in ((MOTION, "re-estimated"), (ONCE, "once only")):
                    along_frames(axis, study.grid[method.key, share], method, label)
                axis.set(yscale="log", xlabel="frame", title=f"{percent(share)} known")
            row[0].set_ylim(top=min(row[0].get_ylim()[1], _LARGEST_SHOWN))
            row[0].set(ylabel=f"{study.subject.name}: {NMSVE_LABEL}")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        return save(figure, folder, "figure13_two_readings", is_chart=True)


def detail_and_libigl(studies: list[Study], folder: Path) -> Path:
    """Draw error and time, without bands, which would overlap."""
    methods = (MOTION, DETAIL, LIA_ON_MOTION, *BASELINES)
    return compared(studies, methods, folder, "figure14_detail_and_libigl", with_bands=False)


def completed(
    subject: Subject, runs: dict[Method, Run], words: str, azimuth: float, path: Path
) -> Path:
    """Draw the original and what methods make of one frame, and what is known and their errors."""
    number, columns = pictured_frames(subject)["figure8"], len(runs) + 1
    view = view_of(replace(subject, azimuth=azimuth), [number])
    truth, found = subject.vertices[number], list(runs.values())
    meshes = surfaces(subject, number, [run.frames[number] for run in found], view)
    dots = figures.render(subject.faces, truth, view, known=found[0].masks[number])
    heat, limit = heatmaps(subject, number, found, view)
    captions = ["known (blue)", *(nmsve_caption(run.nmsve[number - 1]) for run in found)]
    return sheet(
        f"{subject.name}, frame {number}, {words}",
        in_rows(figures.cropped([*meshes, dots, *heat]), columns),
        [["original", *(method.label for method in runs)], [""] * columns],
        [[""] * columns, captions],
        path.parent,
        path.name,
        limit,
    )


def draw(studies: list[Study], folder: Path) -> None:
    """Draw all figures."""
    hidden_parts(studies, folder)
    two_readings(studies, folder)
    detail_and_libigl(studies, folder)
    for study in progress(studies, "drawing"):
        subject = study.subject
        methods = measured(study, (MOTION, DETAIL, LIA_ON_MOTION, *BASELINES))
        for name, words in SCENARIOS.items():
            runs = {method: study.scenarios[name, method.key] for method in methods}
            # The camera does not see the back, so the picture is taken from there.
            azimuth = subject.azimuth + (180 if name == "camera" else 0)
            path = folder / f"figure12_{name}_{subject.name}"
            completed(subject, runs, words, azimuth, path)
        share = PAPER_SHARES[0]
        runs = {m: study.grid[m.key, share] for m in methods if m is not LIA_ON_MOTION}
        path = folder / f"figure15_{subject.name}"
        completed(subject, runs, f"{percent(share)} known", subject.azimuth, path)


def main() -> None:
    """Measure, draw, and print the tables."""
    made = parser(__doc__)
    made.add_argument("--out", type=Path, required=True, help="the folder for the figures")
    made.add_argument("--frames", type=int, help="at most this many of each sequence")
    made.add_argument("--azimuth", type=float, help="of the pictures, in degrees")
    arguments = made.parse_args()
    studies = []
    for subject in sequences(arguments, arguments.frames):
        azimuth = subject.azimuth if arguments.azimuth is None else arguments.azimuth
        studies.append(study(replace(subject, azimuth=azimuth)))
    claims = [verdict for done in studies for verdict in verdicts(done)]
    arguments.out.mkdir(parents=True, exist_ok=True)
    stored = json.dumps([asdict(verdict) for verdict in claims])
    (arguments.out / "claims.json").write_text(stored + "\n", encoding="utf-8")
    draw(studies, arguments.out)
    methods = (*COMPARED, *BASELINES, ONCE)
    tables = [Table(s.subject.name, sequence_table(s, measured(s, methods))) for s in studies]
    show(arguments, *tables, Table("claims-of-detail", claims_table(claims)))


if __name__ == "__main__":
    main()
