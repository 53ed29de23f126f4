"""The command that measures errors."""

import json
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.table import Table

from .. import files
from ..files import Source
from ..files.new_output import check_output, new_output
from ..frames.times import slice_of
from ..jobs import evaluation
from .options import parser, share_out, with_source
from .terminal import show, track

_ERRORS_OF = {"position": "positions", "surface": "distances from the true surface"}


@with_source(only=("faces", "prim"))
def evaluate(
    completed: Annotated[Path, typer.Argument(metavar="COMPLETED", help="The completed sequence.")],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The true sequence.")],
    *,
    frames: Annotated[
        slice | None,
        typer.Option(
            metavar="A:B",
            parser=parser(slice_of),
            help="Measure the frames from number A, in COMPLETED, to before B. [all but the first]",
        ),
    ] = None,
    only: Annotated[
        Literal["all", "missing"],
        typer.Option(help="Measure the distances of all vertices, or of the missing ones alone."),
    ] = "all",
    partial: Annotated[
        Path | None,
        typer.Option(
            "--input",
            metavar="FILE",
            help="The sequence that was completed, which says which vertices were missing. [what "
            "COMPLETED says itself]",
        ),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="A mesh that provides the faces of those files that hold none."
        ),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Also write a table with a row for each frame."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the table.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
    source: Source,
) -> None:
    """Measure the error of a completed sequence.

    NMSVE, the normalised mean square visual error of the paper, is multiplied by 1e4, as in the
    documentation. The other values are distances between vertices and their true positions: mean,
    root mean square and 99th percentile per frame, averaged over the frames, and the overall
    maximum. All are in bounding-box diagonals of the reference's first frame; dynmesh info prints
    the lengths of the diagonal and of a mean edge. Standard errors, if COMPLETED has them, are
    compared with the distances that they describe: from the true positions or, in a tracked
    sequence, from the true surface. --json prints NMSVE as "nmsve", without the factor. --faces and
    --prim apply to all files whose formats support them. Examples:

    ```text
    dynmesh evaluate completed.npz truth.npz
    dynmesh evaluate completed.npz truth.npz --only missing --input partial.npz --csv errors.csv
    ```
    """
    if table is not None:
        check_output(table, overwrite, ".csv")
    own, source_of_truth = share_out(source, completed, reference)
    with ExitStack() as opened:
        ours = opened.enter_context(files.open_with(completed, template, **own))
        truth = opened.enter_context(files.open_with(reference, template, **source_of_truth))
        observed = None
        if partial is not None:
            _, source_of_input = share_out(source, completed, partial)
            observed = opened.enter_context(files.open_with(partial, template, **source_of_input))
        result = evaluation.evaluate(
            ours,
            truth,
            frames=frames,
            only=only,
            partial=observed,
            watch=lambda given, n: track(given, n, "measuring"),
        )
    if table is not None:
        with new_output(table, overwrite, ".csv") as made:
            result.write_csv(made)
    if as_json:
        print(json.dumps(_as_json(result), indent=2))
        return
    shown = Table.grid(padding=(0, 2))
    shown.add_row("NMSVE x 1e4", f"{1e4 * result.nmsve:.4g}")
    shown.add_row("mean error", f"{result.mean:.4g}")
    shown.add_row("root mean square", f"{result.rms:.4g}")
    shown.add_row("99th percentile", f"{result.p99:.4g}")
    shown.add_row("maximum", f"{result.maximum:.4g}")
    shown.add_row("frames", str(result.frames))
    diagonal = f"{result.bounding_box_diagonal:g}"
    shown.add_row("unit", f"bounding-box diagonal of the first frame, {diagonal}")
    if (found := result.calibration) is not None:
        shown.add_row("standard errors are of", _ERRORS_OF[found.standard_error_of])
        shown.add_row("errors within the 50 % interval", f"{100 * found.coverage_50:.3g} %")
        shown.add_row("errors within the 90 % interval", f"{100 * found.coverage_90:.3g} %")
        shown.add_row("error / standard error", f"{found.rms_ratio:.3g}, root mean squares")
        for name in ("rank", "generation"):
            value = getattr(found, f"{name}_correlation")
            of = "standard error" if name == "rank" else name
            found_value = "none" if value is None else f"{value:.3g}"
            shown.add_row(f"rank correlation with {of}", found_value)
    show(shown)


def _as_json(result: evaluation.Evaluation) -> dict[str, Any]:
    summary = {name: getattr(result, name) for name in ("mean", "rms", "p99", "maximum")}
    return {
        "nmsve": result.nmsve,
        "summary": summary,
        "frames": result.frames,
        "bounding_box_diagonal": result.bounding_box_diagonal,
        "standard_error": None if result.calibration is None else asdict(result.calibration),
    }
