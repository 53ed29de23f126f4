"""The evaluation of the paper: its figures 7 to 11 and its claims, for both methods.

This needs the extra `reproduce`. The benchmarks, which are not part of the package, compare with
other methods and use the same sequences, losses, measurements and tables.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from .._extras import require_all
from ..draw.figures import load_pyvista
from ..files import PathLike
from ..files.lock import check_folder
from ..files.new_output import exists_already
from . import charts, pictures, report
from .claims import Claims, detail_verdicts, verdicts
from .methods import COMPARED
from .own_methods import Begin, imported, own_methods
from .sequence_study import Plan, study
from .subjects import Subject, built_in, from_file

__all__ = ["imported", "reproduce"]

Progress = Callable[[str, int, int], object]
"""A function of what was done, the number of steps done, and that of all steps."""


def reproduce(
    out: PathLike,
    *,
    data: Iterable[PathLike] = (),
    quick: bool = False,
    frames: int | None = None,
    seed: int = 0,
    up: str | None = None,
    azimuth: float | None = None,
    methods: Mapping[str, Begin] | None = None,
    overwrite: bool = False,
    progress: Progress = lambda _what, _done, _all: None,
) -> Path:
    """Run the evaluation and write figures, `results.json` and `report.html`.

    Args:
        out: the folder for the results. It is created if it does not exist.
        data: files with sequences, or folders of such files. The default is the built-in walker
            and ocean.
        quick: whether to measure fewer frames and shares of known vertices.
        frames: the largest number of frames of each sequence, at least 2. The default is 30 if
            `quick`, else all.
        seed: the seed of the known masks.
        up: the axis that points up in the pictures of `data`, "x", "y" or "z". The default is the
            axis that the file names, z for sheets that lie flat, or else y.
        azimuth: the direction from which the pictures of `data` are taken, in degrees around `up`.
            The default is 60.
        methods: others to be compared, by their names in tables and charts: functions or classes
            of the faces (m, 3) and the first frame (k, 3). What they return has a method
            `push(points, known)`, as :class:`dynmesh.Completer`, which returns the next frame,
            (k, 3) and finite; positions that are not known are NaN.
        overwrite: whether to replace the results of another run.
        progress: called while work is being done.

    Returns:
        The path of `report.html`.

    Raises:
        TypeError: a method does not return what it must.
        ValueError, OSError: a sequence cannot be read, has missing vertices or no second frame, or
            `frames` is less than 2; or a method of `methods` fails or has the name of another one.
        ImportError: matplotlib or pyvista is not installed.
    """
    if frames is not None and frames < 2:
        raise ValueError(f"frames: must be at least 2, not {frames}")
    out = Path(out)
    check_folder(out / "results.json")
    for older in (out / "results.json", out / "report.html"):
        if older.exists() and not overwrite:
            raise exists_already(older, "all results")
    require_all("PIL.Image", "matplotlib", extra="reproduce")
    load_pyvista("reproduce")
    plan = Plan.quick() if quick else Plan()
    if frames is not None:
        plan = replace(plan, frames=frames)
    own = own_methods(methods or {})
    subjects = _subjects([Path(item) for item in data], plan, up, azimuth)
    out.mkdir(parents=True, exist_ok=True)

    whole = 2 + len(subjects) * (plan.n_runs(len(COMPARED) + len(own)) + 3)  # runs and pictures
    done = 0

    def advance(what: str) -> None:
        nonlocal done
        done += 1
        progress(what, done, whole)

    studies = []
    for subject in subjects:
        step = partial(advance, f"measuring {subject.name}")
        studies.append(study(subject, plan, seed, step, own))

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
    ]
    made = []
    for draw in drawing:
        made.append(draw())
        advance("drawing")
    kind = "quick run" if quick else "full run"
    kind += "" if plan.frames is None else f" of the first {plan.frames} frames"
    report.write_results(studies, claims, kind, seed, out)
    return report.write_report(studies, claims, kind, made, out)


def _subjects(data: list[Path], plan: Plan, up: str | None, azimuth: float | None) -> list[Subject]:
    if not data:
        return built_in(plan.frames)
    paths = [path for item in data for path in (_in_folder(item) if item.is_dir() else [item])]
    subjects: list[Subject] = []
    for path in paths:
        if any(subject.name == path.stem for subject in subjects):
            raise ValueError(f"{path}: another sequence is called {path.stem} too; rename one")
        subjects.append(from_file(path, plan.frames, up, 60.0 if azimuth is None else azimuth))
    return subjects


def _in_folder(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.npz"))
    if not found:
        raise ValueError(f"{folder}: contains no sequence in a file *.npz")
    return found
