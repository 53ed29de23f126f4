"""The command that registers a mesh with scans."""

from pathlib import Path
from typing import Annotated

import typer

from ..jobs.register_options import RegisterOptions
from ..jobs.registering import register_each, remarks_on
from .options import OutputPath, Overwrite, with_options
from .terminal import DOUBTFUL, say, say_remarks


@with_options(RegisterOptions, RegisterOptions)
def register(
    template: Annotated[Path, typer.Argument(metavar="TEMPLATE", help="The mesh.")],
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN",
            help="A point cloud (PLY, XYZ, NPY, NPZ) or a mesh; or several, or depth images: a "
            "folder, or a pattern in quotes.",
        ),
    ],
    output: OutputPath,
    *,
    options: RegisterOptions,
    overwrite: Overwrite = False,
) -> None:
    """Register a mesh with a scan: the same mesh, in the pose and the shape of the scan.

    With several scans, OUT is a folder, and one that fails does not stop the others. The exit code
    is 1 if a scan failed, else 3 if a result is doubtful or ruined.

    Examples:
    ```text
    dynmesh register body.obj scan.ply registered.obj
    dynmesh register body.obj 'scans/*.ply' registered --landmarks landmarks
    dynmesh register body.obj scan.ply registered.obj --page registered.html
    ```
    """
    made = []
    for one in register_each(template, scan, output, options, overwrite):
        made.append(one)
        if one.found is not None:
            well = f"good; {one.found.far:.2%} of the points are far from the mesh"
            say(f"{one.output}: {one.reason or well}")
    say_remarks(output, remarks_on(made, options))
    failed = [one.reason for one in made if one.found is None]
    doubtful = sum(1 for one in made if one.reason) - len(failed)
    if options.page is not None and len(failed) < len(made):
        say(f"{options.page}: open it in a browser")
    if failed:
        for reason in failed:
            say(f"failed: {reason}")
        done = len(made) - doubtful - len(failed)
        also = f"{doubtful} doubtful or ruined, " if doubtful else ""
        say(f"{done} done, {also}{len(failed)} failed of {len(made)} scans")
        raise typer.Exit(1)
    if doubtful:
        raise typer.Exit(DOUBTFUL)
