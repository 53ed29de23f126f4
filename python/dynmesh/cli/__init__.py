"""The command `dynmesh`: each verb is a function, whose signature and docstring are the command."""

import inspect
import json
import os
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from cyclopts import App, CycloptsError
from rich.console import Console
from rich.markup import escape

from .._core import __version__
from .._errors import DynmeshError, in_one_line
from .._report import Report
from .command import Command, refusal

VERBS = {
    "info": "verbs.info:info",
    "synth": "synth:sequence",
    "degrade": "verbs.degrade:degrade",
    "complete": "verbs.complete:complete",
    "rig": "verbs.rig:rig",
    "track": "verbs.track:track",
    "register": "verbs.register:registered",
    "evaluate": "verbs.evaluate:evaluate",
    "view": "verbs.view:view",
    "picture": "verbs.picture:picture",
    "convert": "verbs.convert:convert",
    "batch": "cli.jobs:batch",
}
"""The module and the function of each command. Only the one that is run is loaded."""

_INSTEAD = {"convert": "verbs.convert:convert_clouds"}
"""What a command does with files that are no sequences."""

_EXIT_CODES = {"good": 0, "failed": 1}
"""Of the qualities of reports; of others, whose outputs are written but doubtful, it is 3."""


@dataclass(frozen=True, kw_only=True)
class Drawn(Report):
    """A picture that was written; Python gets the picture itself."""

    output: Path


app = App(
    name="dynmesh",
    help="Completes dynamic meshes: frames that share one connectivity, of which some vertices are "
    "missing.\n\n"
    "A sequence is an animated mesh in one of the formats npz, hdf5, npy, pc2, ply, obj, usd, "
    "usdz, alembic and model, recognised by its suffix. A vertex is missing in a frame if its "
    "known mask says so or, in a file without masks, if its position is not finite.\n\n"
    "Every command also takes --quiet (-q), which prints only what is wrong, and --json, which "
    "prints its report as JSON. The exit code is 0 if all is well, 1 after an error, 2 if the "
    "command line or an option is wrong, and 3 if a result was written but is doubtful.",
    help_flags=("--help", "-h"),
    help_format="plaintext",
    version=f"dynmesh {__version__}",
    version_flags=("--version",),
)


def _loaded(name: str) -> Callable[..., Any]:
    module, _, function = name.partition(":")
    result: Callable[..., Any] = getattr(import_module(f"dynmesh.{module}"), function)
    return result


@cache
def command_of(verb: str) -> Command:
    """The command of a verb."""
    instead = _INSTEAD.get(verb)
    return Command(_loaded(VERBS[verb]), None if instead is None else _loaded(instead))


def _description(verb: str) -> str:
    """The docstring of a verb up to its arguments, read without loading its module."""
    module, _, name = VERBS[verb].partition(":")
    place = Path(__file__).parents[1].joinpath(*module.split("."))
    source = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    text = source.read_text(encoding="utf-8").partition(f"\ndef {name}(")[2]
    return inspect.cleandoc(text.partition('"""')[2].partition("Args:")[0])


def __getattr__(name: str) -> Any:
    """The commands, by the names of the verbs, for the app to load."""
    if name in VERBS:
        command = App(name=name, default_command=command_of(name), help=_description(name))
        command.help_format = "markdown"
        return command
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


for _verb in VERBS:
    app.command(f"{__name__}:{_verb}", name=_verb, help=_description(_verb))
app.register_install_completion_command()


def main() -> None:
    """Runs the command line and reports an error in one line."""
    quiet, as_json, tokens = _common(sys.argv[1:])
    try:
        report = run(tokens, quiet=quiet)
    except (CycloptsError, OSError, ValueError, TypeError, ImportError) as error:
        message, code = _told(error, tokens)
        console = Console(stderr=True, emoji=False)
        console.print(f"[red]dynmesh:[/red] {escape(message)}", highlight=False, soft_wrap=True)
        sys.exit(code)
    except KeyboardInterrupt:
        sys.exit(130)
    if report is None:  # of the help, for example
        return
    try:
        _show(report, quiet, as_json, tokens)
        sys.stdout.flush()
    except BrokenPipeError:  # who reads it has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(_EXIT_CODES.get(report.quality, 3))


def run(tokens: Sequence[str], *, quiet: bool = False) -> Report | None:
    """Runs a command line, and shows how far it is in a terminal; returns what was done.

    Raises:
        CycloptsError: the command line is wrong.
        OSError, ImportError, TypeError, ValueError: what the command raises.
    """
    command, given, unset = app.parse_args(tokens, exit_on_error=False, print_error=False)
    if "progress" in unset:
        given.arguments["progress"] = not quiet
    result = command(*given.args, **given.kwargs)
    if result is None or isinstance(result, Report):
        return result
    pixels = "{} x {} pixels".format(*result.size)
    remarks = (pixels, *result.info.get("remarks", ()))
    return Drawn(output=given.arguments["output"], remarks=remarks)


def _told(error: Exception, tokens: Sequence[str]) -> tuple[str, int]:
    """What an error says, with options in place of arguments; and the exit code."""
    error, code = (refusal(error), 2) if isinstance(error, CycloptsError) else (error, 1)
    if isinstance(error, DynmeshError) and error.argument is not None and tokens[0] in VERBS:
        option = command_of(tokens[0]).option_of(error.argument)
        is_given = option in {token.partition("=")[0] for token in tokens}
        # Files hold arrays that are called like options.
        is_of_file = error.file is not None and error.argument in ("faces", "known")
        if option is not None and (is_given or not is_of_file):
            return _spelt(error.told(option), tokens), 2
    if isinstance(error, DynmeshError) and error.argument is None and error.file is None:
        code = 2  # what is about no file is about the command line
    return _spelt(in_one_line(error), tokens), code


def _spelt(text: str, tokens: Sequence[str]) -> str:
    """Names arguments of functions, which messages mark as in `threads`, as options.

    Files are named as seen from the current folder, from which they were given.
    """
    here = re.escape(str(Path.cwd()) + os.sep)
    text = re.sub(rf"(?<![^\s'\"(]){here}(?=\S)", "", text)
    return command_of(tokens[0]).spelt(text) if tokens and tokens[0] in VERBS else text


def _common(tokens: list[str]) -> tuple[bool, bool, list[str]]:
    """Takes the options of all commands out of a command line."""
    ours = ("--quiet", "-q", "--json")
    others = [token for token in tokens if token not in ours]
    return "--quiet" in tokens or "-q" in tokens, "--json" in tokens, others


def _show(report: Report, quiet: bool, as_json: bool, tokens: Sequence[str]) -> None:
    """Prints a report: what was found on standard output, what was done on standard error."""
    if as_json:
        print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
        return
    output = getattr(report, "output", None)
    lines = report.lines() if output is None or not quiet else filter(None, [report.reason])
    place, file = ("", sys.stdout) if output is None else (f"{output}: ", sys.stderr)
    for line in lines:
        print(_spelt(f"{place}{line}", tokens), file=file)
