"""The paper's evaluation, reproduced: its figures 7 to 11, its claims, and what lies beyond.

Needs the extra `reproduce`. Where libigl is missing, or cannot complete a sequence, the comparison
with it is left out, and the report says so.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from .. import files, synth
from .._extras import require_all
from ..draw.figures import load_pyvista
from ..draw.heatmap import likely_up
from ..sequence import Sequence
from . import charts, pictures, report
from .claims import Claims, detail_verdicts, verdicts
from .measure import Subject
from .plan import SCENARIOS, Plan, seconds_of_work, study, trial

__all__ = ["reproduce"]

Progress = Callable[[str, float, float], object]
"""(what is being done, seconds of work done, in all, as estimated at the beginning)."""

_SECONDS_PER_PICTURE = 1.2  # about


def reproduce(
    out: Path,
    *,
    data: Iterable[Path] = (),
    quick: bool = False,
    frames: int | None = None,
    seed: int = 0,
    up: str | None = None,
    azimuth: float | None = None,
    progress: Progress = lambda _what, _done, _all: None,
) -> Path:
    """Runs the evaluation and writes figures, `results.json` and `report.html`.

    Args:
        out: a folder; it is made if need be, and files in it are replaced.
        data: sequences in files, or folders of them; without any, the built-in walker and ocean.
        quick: fewer frames and shares; else everything.
        frames: that many of each sequence at most, 2 or more; None: 30 if `quick`, else all.
        seed: of the masks.
        up: "x", "y" or "z", up in the pictures of `data`; None: z for sheets that lie flat, else y.
        azimuth: degrees around `up` that the pictures of `data` are taken from; None: 60.
        progress: is told of work done.

    Returns:
        The path of `report.html`.

    Raises:
        ValueError, OSError: a sequence cannot be read, has missing vertices or no second frame;
            `frames` is less than 2.
        ImportError: matplotlib or pyvista is missing.
    """
    if frames is not None and frames < 2:
        raise ValueError(f"frames: must be at least 2, not {frames}")
    require_all("PIL.Image", "matplotlib", extra="reproduce")
    load_pyvista("reproduce")
    plan = Plan.quick() if quick else Plan.full()
    plan = plan if frames is None else replace(plan, frames=frames)
    subjects = _subjects(list(data), plan, up, azimuth)
    out.mkdir(parents=True, exist_ok=True)

    trials = [trial(subject, seed) for subject in subjects]
    work = zip(subjects, trials, strict=True)
    whole = sum(seconds_of_work(subject, plan, tried) for subject, tried in work)
    whole += _SECONDS_PER_PICTURE * (5 + (4 + len(SCENARIOS)) * len(subjects))
    done = 0.0

    def advance(seconds: float) -> None:
        nonlocal done
        done += seconds
        progress(f"measuring {subject.name}", done, whole)

    progress("measuring", done, whole)
    studies = []
    for subject, tried in zip(subjects, trials, strict=True):
        studies.append(study(subject, plan, seed, tried, advance))

    claims = Claims(
        [verdict for s in studies for verdict in verdicts(s)],
        [verdict for s in studies for verdict in detail_verdicts(s)],
    )
    drawing: list[Callable[[], Path]] = [
        lambda: charts.figure7(studies, out),
        *(lambda s=s: pictures.figure8(s, out) for s in studies),
        lambda: charts.figure9(studies, out),
        *(lambda s=s: pictures.figure10(s, out) for s in studies),
        *(lambda s=s: pictures.figure11(s, out) for s in studies),
        lambda: charts.figure12(studies, out),
        *(
            lambda s=s, name=name: pictures.figure12(s, name, out)
            for s in studies
            for name in SCENARIOS
        ),
        lambda: charts.figure13(studies, out),
        lambda: charts.figure14(studies, out),
        *(lambda s=s: pictures.figure15(s, out) for s in studies),
    ]
    made = []
    for number, draw in enumerate(drawing):
        progress("drawing", done + (whole - done) * number / len(drawing), whole)
        made.append(draw())
    progress("done", whole, whole)
    kind = "quick run" if quick else "full run"
    kind += "" if plan.frames is None else f", of the first {plan.frames} frames"
    report.write_results(studies, claims, kind, seed, out)
    return report.write_report(studies, claims, kind, made, out)


def _subjects(data: list[Path], plan: Plan, up: str | None, azimuth: float | None) -> list[Subject]:
    if not data:
        walker, ocean = synth.walker(), synth.ocean()
        return [
            Subject.of("walker", walker, "z", 20.0, plan.frames),
            Subject.of("ocean", ocean, "z", 60.0, plan.frames),
        ]
    paths = [path for item in data for path in (_in_folder(item) if item.is_dir() else [item])]
    subjects: list[Subject] = []
    for path in paths:
        if any(subject.name == path.stem for subject in subjects):
            raise ValueError(f"{path}: another sequence is called {path.stem} too; rename one")
        sequence = files.read(path)
        _check_whole(path, sequence)
        axis = up or likely_up(sequence.vertices[0], sequence.up_axis)
        degrees = 60.0 if azimuth is None else azimuth
        subjects.append(Subject.of(path.stem, sequence, axis, degrees, plan.frames))
    return subjects


def _in_folder(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.npz"))
    if not found:
        raise ValueError(f"{folder}: holds no sequence, .npz")
    return found


def _check_whole(path: Path, sequence: Sequence) -> None:
    if len(sequence.vertices) < 2:
        raise ValueError(f"{path}: has {len(sequence.vertices)} frames; at least 2 are needed")
    if sequence.known is not None and not sequence.known.all():
        raise ValueError(f"{path}: has missing vertices; the evaluation takes whole sequences")
