"""The command `dynmesh`: the package for people with a shell and a file."""

from typing import Annotated

import typer

from .._core import __version__
from .._terminal import fail
from .completion import batch, complete
from .evaluation import evaluate, reproduce
from .pictures import picture, view
from .sequences import convert, degrade, info, synth

app = typer.Typer(
    name="dynmesh",
    help="Completes dynamic meshes: one connectivity, a whole first frame, holes in the others.\n\n"
    "A sequence is an animated mesh in any of the formats that `dynmesh convert --help` lists. A "
    "vertex is missing in a frame where its position is not a number, or where a mask says so.",
    rich_markup_mode="markdown",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
for command in (
    info,
    synth,
    degrade,
    complete,
    evaluate,
    view,
    picture,
    convert,
    batch,
    reproduce,
):
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"dynmesh {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Runs the command line; one line says what went wrong."""
    try:
        app()
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except (ValueError, TypeError, ImportError) as error:
        fail(str(error))
