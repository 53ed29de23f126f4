"""Runs the command `dynmesh` as `python -m dynmesh`."""

from .cli import main

main()
