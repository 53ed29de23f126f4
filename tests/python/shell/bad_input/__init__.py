"""All tested kinds of bad input: `case.py` says what a case is, and runs one."""

from . import commands, files, memory
from .case import Case

CASES: list[Case] = [*memory.cases, *files.cases, *commands.shell]
