"""The command that looks at the cameras of depth images before tracking."""

from pathlib import Path
from typing import Annotated

import typer

from ..draw.rig_page import rig_page
from ..files.new_output import new_output
from ..files.scans import write_cameras
from ..jobs.option import FILES, OUTPUT
from ..jobs.rig import look_at_rig
from ..jobs.scan_options import ScanOptions
from .options import Overwrite, with_options
from .terminal import DOUBTFUL, say


@with_options(ScanOptions, ScanOptions)
def rig(
    scans: Annotated[
        Path, typer.Argument(metavar="SCANS", help="Depth images, as for `dynmesh track`.")
    ],
    *,
    template: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The mesh, in about the pose of the first scan.",
            rich_help_panel=FILES,
        ),
    ] = None,
    options: ScanOptions,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE.json",
            help="Write the corrected camera file, for `dynmesh track --cameras`.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="Write a page that shows the cameras, what they see, and the template.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Say what is wrong with the cameras of depth images, and correct their file.

    The usual misreadings are tried on the first scan: inverted poses, axes of OpenGL, transposed
    rotations, exchanged cameras, millimetres. The exit code is 3 if the cameras do not fit.

    Examples:
    ```text
    dynmesh rig depth --template body.obj
    dynmesh rig depth --template body.obj -o right.json --page rig.html
    dynmesh track depth tracked.npz --template body.obj --cameras right.json
    ```
    """
    if template is None and (page is None or output is not None):
        raise typer.BadParameter("--template is needed; without it, --page shows the cameras")
    report = look_at_rig(scans, template, options)
    say(f"{scans}: {report.told}")
    if output is not None and report.rig is None:
        say(f"{output}: not written, as no correction is known")
    if output is not None and report.rig is not None:
        with new_output(output, overwrite, ".json", inputs=filter(None, [report.rig.file])) as made:
            write_cameras(made, report.rig)
        say(f"{output}: written, with the corrected cameras")
    if page is not None:
        with new_output(page, overwrite, ".html") as made:
            shown = rig_page(
                report.scan,
                report.template,
                up=report.up,
                title=f"{scans.name}, the first scan",
                told=report.told,
                names=report.names,
            )
            made.write_text(shown, encoding="utf-8")
    if report.quality != "good":
        raise typer.Exit(DOUBTFUL)
