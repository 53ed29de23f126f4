"""The commands that measure."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from .. import files
from ..study import evaluation
from .options import Axis, Faces, Prim, Seed, share_out
from .terminal import WorkBar, say, track


def evaluate(
    completed: Annotated[Path, typer.Argument(metavar="COMPLETED", help="What was filled in.")],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The truth.")],
    faces: Faces = None,
    prim: Prim = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Measure the error of a completed sequence.

    All figures are in bounding-box diagonals of the reference's first frame. NMSVE is the paper's
    normalised mean square visual error; the others are of the distance between a vertex and its
    true position: mean, root mean square and 99th percentile in the mean frame, and the largest of
    all. Frame 0 is left out. --faces and --prim are for both files, as far as they take them.
    """
    source, source_of_truth = share_out({"faces": faces, "prim": prim}, completed, reference)
    with files.open(completed, **source) as ours, files.open(reference, **source_of_truth) as truth:
        result = evaluation.evaluate(ours, truth, track(ours, ours.n_frames, "measuring"))
    if as_json:
        print(json.dumps(_as_json(result), indent=2))
        return
    table = Table.grid(padding=(0, 2))
    table.add_row("NMSVE", f"{result.nmsve:.4g}")
    table.add_row("mean error", f"{result.mean:.4g}")
    table.add_row("root mean square", f"{result.rms:.4g}")
    table.add_row("99th percentile", f"{result.p99:.4g}")
    table.add_row("maximum", f"{result.maximum:.4g}")
    table.add_row("frames", str(result.frames))
    table.add_row("unit", f"bounding-box diagonal of frame 0, {result.bounding_box_diagonal:g}")
    Console().print(table)


def reproduce(
    output: Annotated[Path, typer.Argument(metavar="OUT", help="A folder for the results.")],
    data: Annotated[
        list[Path] | None,
        typer.Option(help="A sequence, or a folder of them; may be given again. [built-in ones]"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer frames and shares.")] = False,
    frames: Annotated[
        int | None, typer.Option(min=2, help="So many of each sequence at most. [all]")
    ] = None,
    seed: Seed = 0,
    up: Annotated[
        Axis | None, typer.Option(help="The axis that is up in pictures of DATA. [y; z if flat]")
    ] = None,
    azimuth: Annotated[
        float | None, typer.Option(help="Degrees around it that pictures are taken from. [60]")
    ] = None,
) -> None:
    """Reproduce the paper's evaluation: figures 7 to 11, its claims, and what lies beyond.

    Writes figures as PNG and SVG, results.json, and report.html, which stands alone.
    """
    from ..study import reproduce as run
    from ..study.libigl import load_libigl

    try:
        load_libigl()
    except ImportError as error:
        say(f"The comparison with libigl is left out: {error}")
    with WorkBar() as progress:
        page = run(
            output,
            data=data or (),
            quick=quick,
            frames=frames,
            seed=seed,
            up=None if up is None else up.value,
            azimuth=azimuth,
            progress=progress,
        )
    say(f"{page}: open it in a browser")


def _as_json(result: evaluation.Evaluation) -> dict[str, Any]:
    summary = {name: getattr(result, name) for name in ("mean", "rms", "p99", "maximum")}
    return {
        "nmsve": result.nmsve,
        "summary": summary,
        "frames": result.frames,
        "bounding_box_diagonal": result.bounding_box_diagonal,
    }
