"""The command `dynmesh`: each verb is a function, whose signature and docstring are the command."""

import inspect
import json
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from cyclopts import App, CycloptsError
from rich.console import Console
from rich.markup import escape

from ._command import as_command, option_of, refusal, takes
from ._core import __version__
from ._errors import DynmeshError
from ._report import Report

VERBS = {
    "info": "info:info",
    "synth": "synth:synth_file",
    "degrade": "degrade:degrade_file",
    "complete": "complete:complete_file",
    "rig": "rig:rig",
    "track": "track:track_file",
    "register": "register:register_file",
    "evaluate": "evaluate:evaluate",
    "view": "show:view",
    "picture": "show:picture",
    "convert": "convert:convert_file",
    "batch": "batch:batch",
}
"""The module in `verbs` and the function of each command. Only the one that is run is loaded."""

_EXIT_CODES = {"good": 0, "failed": 1}
"""Of the qualities of reports; of others, whose outputs are written but doubtful, it is 3."""

app = App(
    name="dynmesh",
    help="Completes dynamic meshes: frames that share one connectivity, of which some vertices are "
    "missing.\n\n"
    "A sequence is an animated mesh in one of the formats npz, hdf5, npy, pc2, ply, obj, usd, "
    "usdz, alembic and model, recognised by its suffix. A vertex is missing in a frame if its "
    "known mask says so or, in a file without masks, if its position is not finite.\n\n"
    "Every command also takes --quiet (-q), which prints errors alone, and --json, which prints "
    "its report as JSON. The exit code is 0 if all is well, 1 after an error, 2 if the command "
    "line is wrong, and 3 if a result was written but is doubtful.",
    help_flags=("--help", "-h"),
    help_format="plaintext",
    version=f"dynmesh {__version__}",
    version_flags=("--version",),
)


def function_of(verb: str) -> Callable[..., Any]:
    """The function of a command."""
    module, _, name = VERBS[verb].partition(":")
    found: Callable[..., Any] = getattr(import_module(f".verbs.{module}", __package__), name)
    return found


def _description(verb: str) -> str:
    """The docstring of a verb up to its arguments, read without loading its module."""
    module, _, name = VERBS[verb].partition(":")
    source = Path(__file__).with_name("verbs") / f"{module}.py"
    text = source.read_text(encoding="utf-8").partition(f"\ndef {name}(")[2]
    return inspect.cleandoc(text.partition('"""')[2].partition("Args:")[0])


def __getattr__(name: str) -> Any:
    """The commands, by the names of the verbs, for the app to load."""
    if name in VERBS:
        command = App(name=name, default_command=as_command(function_of(name)))
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
    except CycloptsError as error:
        _fail(_told(refusal(error), tokens)[0], 2)
    except DynmeshError as error:
        told, is_usage = _told(error, tokens)
        _fail(told, 2 if is_usage else 1)
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error), 1)
    except (ValueError, TypeError, ImportError) as error:
        _fail(str(error), 1)
    except KeyboardInterrupt:
        sys.exit(130)
    if isinstance(report, Report):
        try:
            _show(report, quiet, as_json)
            sys.stdout.flush()
        except BrokenPipeError:  # who reads it has seen enough
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(_EXIT_CODES.get(report.quality, 3))


def run(tokens: Sequence[str], *, quiet: bool = False) -> Any:
    """Runs a command line, and shows how far it is in a terminal; returns what it returns.

    Raises:
        CycloptsError: the command line is wrong.
        OSError, ImportError, TypeError, ValueError: what the command raises.
    """
    command, given, unset = app.parse_args(tokens, exit_on_error=False, print_error=False)
    if "progress" in unset:
        given.arguments["progress"] = sys.stderr.isatty() and not quiet
    return command(*given.args, **given.kwargs)


def _told(error: DynmeshError, tokens: Sequence[str]) -> tuple[str, bool]:
    """What an error says, with the option that is at fault; whether it is about that alone."""
    verb = function_of(tokens[0]) if tokens and tokens[0] in VERBS else None
    if verb is None or error.argument is None or not takes(verb, error.argument):
        return str(error), False
    is_alone = error.file is None and error.frame is None
    return error.told(option_of(verb, error.argument)), is_alone


def _common(tokens: list[str]) -> tuple[bool, bool, list[str]]:
    """Takes the options of all commands out of a command line."""
    ours = ("--quiet", "-q", "--json")
    own, others = (
        [token for token in tokens if (token in ours) == wanted] for wanted in (True, False)
    )
    return "--quiet" in own or "-q" in own, "--json" in own, others


def _show(report: Report, quiet: bool, as_json: bool) -> None:
    """Prints a report: what was found on standard output, what was done on standard error."""
    if as_json:
        print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
        return
    output = getattr(report, "output", None)
    for line in report.lines():
        if not hasattr(report, "output"):
            print(line)
        elif not quiet:
            print(line if output is None else f"{output}: {line}", file=sys.stderr)


def _fail(why: str, code: int) -> NoReturn:
    console = Console(stderr=True, emoji=False)
    console.print(f"[red]dynmesh:[/red] {escape(why)}", highlight=False, soft_wrap=True)
    sys.exit(code)
