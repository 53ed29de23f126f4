"""What the command says of an error: a line about bad input, a traceback of a fault of dynmesh."""

import contextlib
import os
import re
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from cyclopts import CycloptsError
from rich.console import Console
from rich.markup import escape

from .._errors import DynmeshError, MissingLibraryError, in_one_line
from .command import Command, refusal

EXPECTED = (CycloptsError, DynmeshError, MissingLibraryError, OSError, MemoryError)
"""Errors of the command line, of its files and of the system; all others are faults of dynmesh."""


def tell(error: Exception, command: Command | None, tokens: list[str], *, trace: bool) -> int:
    """Prints what is wrong on standard error; returns the exit code.

    Args:
        error: what was raised.
        command: that was run; None if there is no such one.
        tokens: the command line.
        trace: whether to print the traceback of every error, not only of faults.
    """
    is_fault = not isinstance(error, EXPECTED)
    message, code = _fault(error) if is_fault else _told(error, command, tokens)
    try:
        if is_fault or trace:
            traceback.print_exception(error)
        console = Console(stderr=True, emoji=False)
        console.print(f"[red]dynmesh:[/red] {escape(message)}", highlight=False, soft_wrap=True)
    except (OSError, SystemExit):  # by which rich ends where nobody reads
        drop(sys.stderr)
    return code


def _fault(error: Exception) -> tuple[str, int]:
    message = f"{type(error).__name__}: {in_one_line(error)}"
    return f"{message}; this is a fault of dynmesh, please report it with the lines above", 1


def _told(error: Exception, command: Command | None, tokens: list[str]) -> tuple[str, int]:
    """What an error says, with options in place of arguments; and the exit code."""
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {in_one_line(error)}", 1
    error, code = (refusal(error, tokens), 2) if isinstance(error, CycloptsError) else (error, 1)
    if not isinstance(error, DynmeshError):
        return spelt(in_one_line(error), command), code
    if error.argument is not None and command is not None:
        option = command.option_of(error.argument)
        is_given = option in {token.partition("=")[0] for token in tokens}
        # Files hold arrays that are called like options.
        is_of_file = error.file is not None and error.argument in ("faces", "known")
        if option is not None and (is_given or not is_of_file):
            return spelt(error.told(option), command), 2
    if error.argument is None and error.file is None:
        code = 2  # what is about no file is about the command line
    return spelt(in_one_line(error), command), code


def spelt(text: str, command: Command | None) -> str:
    """Names arguments of functions, which messages mark as in `threads`, as options.

    Files are named as seen from the current folder, from which they were given.
    """
    with contextlib.suppress(OSError):  # the current folder was removed
        here = re.escape(str(Path.cwd()) + os.sep)
        text = re.sub(rf"(?<![^\s'\"(]){here}(?=\S)", "", text)
    return text if command is None else command.spelt(text)


@contextlib.contextmanager
def printing() -> Iterator[None]:
    """Prints on standard output, whose errors name it; who reads it may have seen enough."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # as which rich raises it
        drop(sys.stdout)
    except OSError as error:
        drop(sys.stdout)
        raise OSError(error.errno, error.strerror, "standard output") from error


def drop(stream: TextIO) -> None:
    """Drops what cannot be printed, or Python would fail at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
