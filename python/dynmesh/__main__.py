"""`python -m dynmesh` is the command `dynmesh`."""

from .cli import main

main()
