"""The command that registers a mesh with scans."""

from pathlib import Path
from typing import Annotated

import typer

from ..jobs.register_options import RegisterOptions
from ..jobs.registering import register_each
from .options import OutputPath, Overwrite, with_options
from .terminal import DOUBTFUL, say


@with_options(RegisterOptions, RegisterOptions)
def register(
    template: Annotated[Path, typer.Argument(metavar="TEMPLATE", help="The mesh.")],
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN",
            help="A point cloud (PLY, XYZ, NPY, NPZ) or a mesh, or a folder of these or of depth "
            "images.",
        ),
    ],
    output: OutputPath,
    *,
    options: RegisterOptions,
    overwrite: Overwrite = False,
) -> None:
    """Register a mesh with a scan: the same mesh, in the pose and the shape of the scan.

    The exit code is 3 if a result is doubtful or ruined. With a folder of scans, OUT is a folder.

    Examples:
    ```text
    dynmesh register body.obj scan.ply registered.obj
    dynmesh register body.obj scans registered --landmarks hands_and_feet.json
    dynmesh register body.obj scan.ply registered.obj --page registered.html
    ```
    """
    all_good = True
    for made in register_each(template, scan, output, options, overwrite):
        well = f"good; {made.found.far:.2%} of the points are far from the mesh"
        say(f"{made.output}: {made.reason or well}")
        all_good = all_good and not made.reason
    if options.page is not None:
        say(f"{options.page}: open it in a browser")
    if not all_good:
        raise typer.Exit(DOUBTFUL)
