"""The command `dynmesh`: each verb is a function, whose signature and docstring are the command."""

import inspect
import json
import re
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from cyclopts import App

from .._core import __version__
from .._report import Report
from .command import SHARED, Command, names_of, options_of
from .command import shared as shared_options
from .failure import drop, printing, spelt, tell

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

_EXIT_CODES = {"good": 0, "failed": 1}
"""Of the qualities of reports; of others, whose outputs are written but doubtful, it is 3."""


app = App(
    name="dynmesh",
    help="Completes dynamic meshes: frames that share one connectivity, of which some vertices are "
    "missing.\n\n"
    "A sequence is an animated mesh in one of the formats npz, npz_frames, hdf5, npy, pc2, ply, "
    "obj, usd, usdz, alembic and model, recognised by its suffix. A vertex is missing in a frame "
    "if its known mask says so or, in a file without masks, if its position is not finite.\n\n"
    "Every command also takes --quiet (-q), which prints only what is wrong, --json, which prints "
    "its report as JSON, and --traceback, which shows where in the program an error arose. The "
    "exit code is 0 if all is well, 1 after an error, 2 if the command line or an option is wrong, "
    "and 3 if a result was written but is doubtful.",
    help_flags=("--help", "-h"),
    help_format="plaintext",
    version=f"dynmesh {__version__}",
    version_flags=("--version",),
)


@cache
def command_of(verb: str) -> Command:
    """The command of a verb."""
    module, _, function = VERBS[verb].partition(":")
    return Command(getattr(import_module(f"dynmesh.{module}"), function))


def _description(verb: str) -> str:
    """The docstring of a verb up to its arguments, read without loading its module.

    The parameters that it names are options here.
    """
    module, _, name = VERBS[verb].partition(":")
    place = Path(__file__).parents[1].joinpath(*module.split("."))
    source = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    text = source.read_text(encoding="utf-8").partition(f"\ndef {name}(")[2]
    told = inspect.cleandoc(text.partition('"""')[2].partition("Args:")[0])
    return re.sub(r"`(\w+)`", lambda match: names_of(name, match[1])[0], told)


def __getattr__(name: str) -> Any:
    if name in VERBS:
        command = App(name=name, default_command=command_of(name), help=_description(name))
        command.help_format = "markdown"
        return command
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


for _verb in VERBS:
    app.command(f"{__name__}:{_verb}", name=_verb, help=_description(_verb))
app.register_install_completion_command()


def main() -> None:
    """Runs the command line; tells an error in one line, but shows a fault of dynmesh itself."""
    tokens = [*_each_mesh(_command_first(sys.argv[1:]))]
    shared = {"traceback": "--traceback" in tokens}
    code = 0
    try:
        report = run(tokens, shared)
        if report is not None:  # not of the help, for example
            code = _EXIT_CODES.get(report.quality, 3)
            _show(report, _command_in(tokens), shared)
    except KeyboardInterrupt:
        code = 130
    except Exception as error:
        code = tell(error, _command_in(tokens), tokens, trace=shared["traceback"])
    sys.exit(code)


def run(tokens: list[str], shared: dict[str, bool]) -> Report | None:
    """Runs a command line, and shows how far it is in a terminal; returns what was done.

    Args:
        tokens: the command line.
        shared: takes the options of all commands that are in it.
    """
    command, given, unset = app.parse_args(tokens, exit_on_error=False, print_error=False)
    shared |= {key: given.arguments.pop(key) for key in SHARED & given.arguments.keys()}
    if "progress" in unset:
        given.arguments["progress"] = False if shared.get("quiet") else None
    if not isinstance(command, Command):  # the help, for example
        with printing():
            command(*given.args, **given.kwargs)
        return None
    result: Report | None = command(*given.args, **given.kwargs)
    return result


def _command_first(tokens: list[str]) -> list[str]:
    """Moves options of all commands behind the command if they are before it."""
    names = {name for option in options_of(shared_options) for name in option.names}
    names |= {f"--no-{name[2:]}" for name in names}
    n = next((i for i, token in enumerate(tokens) if token.partition("=")[0] not in names), 0)
    return [*tokens[n : n + 1], *tokens[:n], *tokens[n + 1 :]]


def _each_mesh(tokens: list[str]) -> Iterator[str]:
    """Repeats --prim before each path of a mesh that follows it; files may follow these."""
    is_begun, previous = False, ""
    for token in tokens:
        if previous != "--prim":
            is_path = token.startswith("/") and not Path(token).suffix and not Path(token).exists()
            is_begun = is_begun and (is_path or token == "all")
            if is_begun:
                yield "--prim"
        is_begun, previous = is_begun or token == "--prim", token
        yield token


def _command_in(tokens: list[str]) -> Command | None:
    return command_of(tokens[0]) if tokens and tokens[0] in VERBS else None


def _show(report: Report, command: Command | None, shared: dict[str, bool]) -> None:
    """Prints a report: what was found on standard output, what was done on standard error."""
    if shared.get("json"):
        with printing():
            print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
        return
    output = getattr(report, "output", None)
    if output is None:
        with printing():
            print(*(spelt(line, command) for line in report.lines()), sep="\n")
        return
    lines = filter(None, [report.reason]) if shared.get("quiet") else report.lines()
    try:
        for line in lines:
            print(spelt(f"{output}: {line}", command), file=sys.stderr)
    except OSError:  # nobody reads what was done
        drop(sys.stderr)
