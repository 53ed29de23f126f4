"""The command that looks at a rig before tracking."""

from pathlib import Path
from typing import Annotated

import typer

from ..files.new_output import new_output
from ..jobs.option import FILES, OUTPUT
from ..jobs.rig_options import RigOptions
from ..jobs.rig_report import report_rig
from .options import Axis, Overwrite, with_options
from .terminal import DOUBTFUL, say


@with_options(RigOptions, RigOptions)
def rig(
    scans: Annotated[
        Path,
        typer.Argument(
            metavar="SCANS",
            help="Point clouds or depth images, as for `dynmesh track`.",
        ),
    ],
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="PAGE", help="An HTML file.", rich_help_panel=OUTPUT
        ),
    ],
    template: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The mesh, in about the pose of the first scan.",
            rich_help_panel=FILES,
        ),
    ] = None,
    options: RigOptions,
    up: Annotated[
        Axis | None,
        typer.Option(
            help="The up axis of the page. [as the template states, else y]", rich_help_panel=OUTPUT
        ),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Show cameras, what they see and the template, and say what is wrong with them.

    The exit code is 3 if something is wrong. Examples:

    ```text
    dynmesh rig depth --template body.obj -o rig.html
    dynmesh rig depth --template body.obj --poses world-to-camera -o rig.html
    ```
    """
    with new_output(output, overwrite, ".html") as made:
        report = report_rig(scans, template, options, None if up is None else up.value)
        made.write_text(report.page, encoding="utf-8")
    widths = [max(map(len, column)) for column in zip(*report.table, strict=True)]
    for name, *values in report.table:
        cells = (value.rjust(width) for value, width in zip(values, widths[1:], strict=True))
        say("  ".join([name.ljust(widths[0]), *cells]))
    for sentence in (*report.wrong, *report.right):
        say(f"{scans}: {sentence}")
    say(f"{output}: open it in a browser")
    if report.wrong:
        raise typer.Exit(DOUBTFUL)
