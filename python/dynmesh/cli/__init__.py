"""The command `dynmesh`: the package for files, in the shell."""

from itertools import pairwise
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from .._core import __version__
from .batch import batch
from .completion import complete
from .description import info
from .evaluation import evaluate
from .options import format_names, quietly
from .pictures import picture, view
from .registering import register
from .rig import rig
from .sequences import convert, degrade, synth
from .terminal import fail
from .tracking import track


class _Command(TyperCommand):
    """A command whose usage errors name the refused value and hint at unquoted patterns."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _plain(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        given = [*args]
        try:
            return super().parse_args(ctx, args)
        except Exception as error:  # the exception classes of typer are private
            if "extra argument" in str(error):
                ctx.fail(f"{error}; put patterns in quotes, for example '*.ply'")
            value = _value_of(getattr(getattr(error, "param", None), "opts", []), given)
            if value is not None and value not in str(error) and hasattr(error, "message"):
                error.message += f", not '{value}'"
            raise


class _Group(TyperGroup):
    """The command of the commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _plain(super().get_params(ctx))


def _plain(parameters: list[Any]) -> list[Any]:
    """Shows no type for options that take no value, and --help below all other options."""
    for option in parameters:
        if getattr(option, "is_flag", False):
            option.metavar = ""
    *others, help_option = parameters
    if others:
        help_option.rich_help_panel = others[-1].rich_help_panel
    return parameters


def _value_of(names: list[str], arguments: list[str]) -> str | None:
    """Returns the value given to the option with one of these names, or None."""
    for argument, following in pairwise([*arguments, ""]):
        name, equals, value = argument.partition("=")
        if name in names:
            return value if equals else following
    return None


app = typer.Typer(
    name="dynmesh",
    cls=_Group,
    context_settings={"help_option_names": ["--help", "-h"]},
    help="Completes dynamic meshes: frames that share one connectivity, of which some vertices are "
    "missing.\n\n"
    f"A sequence is an animated mesh in one of the formats {format_names}, recognised by its "
    "suffix. A vertex is missing in a frame if its known mask says so or, in a file without masks, "
    "if its position is not finite.",
    rich_markup_mode="markdown",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
for command in (
    info,
    synth,
    degrade,
    complete,
    rig,
    track,
    register,
    evaluate,
    view,
    picture,
    convert,
    batch,
):
    app.command(cls=_Command)(quietly(command))


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
    """Runs the command line and reports an error in one line."""
    try:
        app()
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except (ValueError, TypeError, ImportError) as error:
        fail(str(error))
