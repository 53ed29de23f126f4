"""Runs the command `dynmesh` as `python -m dynmesh`."""

from dynmesh_command import main

main()
