"""Starts the command `dynmesh`: Ctrl+C while its modules load ends it without a traceback."""

import os
import signal
import sys


def main() -> None:
    """Loads the command and runs it."""
    _open_closed_streams()
    heard = signal.getsignal(signal.SIGINT)
    if heard is signal.default_int_handler:  # not ignored, as in the background of a script
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        from .cli import main as run
    finally:
        signal.signal(signal.SIGINT, heard)
    run()


def _open_closed_streams() -> None:
    """Gives the numbers of closed standard streams to the null device, and not to an output.

    Messages are lost; standard output is opened for reading, so that printing to it is an error.
    """
    for name, mode in (("stdin", os.O_RDONLY), ("stdout", os.O_RDONLY), ("stderr", os.O_WRONLY)):
        if getattr(sys, name) is None:
            number = os.open(os.devnull, mode)
            setattr(sys, name, os.fdopen(number, "r" if name == "stdin" else "w"))


if __name__ == "__main__":
    main()
