"""Starts the command `dynmesh`: Ctrl+C while its modules load ends it without a traceback."""

import signal


def main() -> None:
    """Loads the command and runs it."""
    heard = signal.getsignal(signal.SIGINT)
    if heard is signal.default_int_handler:  # not ignored, as in the background of a script
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        from .cli import main as run
    finally:
        signal.signal(signal.SIGINT, heard)
    run()


if __name__ == "__main__":
    main()
