"""The commands that measure errors."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from .. import files, study
from ..files import Source
from ..jobs import evaluation
from .options import Axis, Seed, share_out, with_source
from .terminal import say, track, work_bar

_ERRORS_OF = {"position": "positions", "surface": "distances from the true surface"}


@with_source(only=("faces", "prim"))
def evaluate(
    completed: Annotated[Path, typer.Argument(metavar="COMPLETED", help="The completed sequence.")],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The true sequence.")],
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
    source: Source,
) -> None:
    """Measure the error of a completed sequence.

    NMSVE, the normalised mean square visual error of the paper, is multiplied by 1e4, as in the
    documentation. The other values are distances between vertices and their true positions: mean,
    root mean square and 99th percentile per frame, averaged over the frames, and the overall
    maximum. All are in bounding-box diagonals of the reference's first frame, which is not itself
    measured; dynmesh info prints the lengths of the diagonal and of a mean edge. Standard errors,
    if COMPLETED has them, are compared with the distances that they describe: from the true
    positions or, in a tracked sequence, from the true surface. --json prints NMSVE as "nmsve",
    without the factor. --faces and --prim apply to both files where their formats support them. An
    example:

    ```text
    dynmesh evaluate completed.npz truth.npz
    ```
    """
    own, source_of_truth = share_out(source, completed, reference)
    with files.open(completed, **own) as ours, files.open(reference, **source_of_truth) as truth:
        result = evaluation.evaluate(ours, truth, track(ours, ours.n_frames, "measuring"))
    if as_json:
        print(json.dumps(_as_json(result), indent=2))
        return
    table = Table.grid(padding=(0, 2))
    table.add_row("NMSVE x 1e4", f"{1e4 * result.nmsve:.4g}")
    table.add_row("mean error", f"{result.mean:.4g}")
    table.add_row("root mean square", f"{result.rms:.4g}")
    table.add_row("99th percentile", f"{result.p99:.4g}")
    table.add_row("maximum", f"{result.maximum:.4g}")
    table.add_row("frames", str(result.frames))
    table.add_row("unit", f"bounding-box diagonal of frame 0, {result.bounding_box_diagonal:g}")
    if (found := result.calibration) is not None:
        table.add_row("standard errors are of", _ERRORS_OF[found.standard_error_of])
        table.add_row("errors within the 50 % interval", f"{100 * found.coverage_50:.3g} %")
        table.add_row("errors within the 90 % interval", f"{100 * found.coverage_90:.3g} %")
        table.add_row("error / standard error", f"{found.rms_ratio:.3g}, root mean squares")
        for name in ("rank", "generation", "age"):
            value = getattr(found, f"{name}_correlation")
            of = "standard error" if name == "rank" else name
            shown = "none" if value is None else f"{value:.3g}"
            table.add_row(f"rank correlation with {of}", shown)
    Console().print(table)


def reproduce(
    output: Annotated[Path, typer.Argument(metavar="OUT", help="A folder for the results.")],
    data: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="PATH",
            help="A sequence or a folder of sequences; repeatable. [the built-in sequences]",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Use fewer frames and shares.")] = False,
    frames: Annotated[
        int | None,
        typer.Option(metavar="N", min=2, help="At most this many frames per sequence. [all]"),
    ] = None,
    seed: Seed = 0,
    up: Annotated[
        Axis | None, typer.Option(help="The up axis in pictures of --data. [y; z if flat]")
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(metavar="DEGREES", help="View from this angle around the up axis. [60]"),
    ] = None,
) -> None:
    """Reproduce the paper's evaluation for both methods.

    Writes figures as PNG and SVG, results.json, and report.html, which needs no other file.
    """
    with work_bar("beginning") as progress:
        page = study.reproduce(
            output,
            data=data or (),
            quick=quick,
            frames=frames,
            seed=seed,
            up=None if up is None else up.value,
            azimuth=azimuth,
            progress=progress,
        )
    say(f"{page}: written; open it in a browser")


def _as_json(result: evaluation.Evaluation) -> dict[str, Any]:
    summary = {name: getattr(result, name) for name in ("mean", "rms", "p99", "maximum")}
    return {
        "nmsve": result.nmsve,
        "summary": summary,
        "frames": result.frames,
        "bounding_box_diagonal": result.bounding_box_diagonal,
        "standard_error": None if result.calibration is None else asdict(result.calibration),
    }
