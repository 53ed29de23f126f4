"""All tested kinds of bad input.

`case.py` says what a case is and runs one; the modules beside it hold the cases of one interface
each.
"""

from . import commands, completer, files, functions, losses, scans, tracking, training
from .case import Case

MODULES = (completer, tracking, functions, losses, files, training, scans)
CASES: list[Case] = [*(case for module in MODULES for case in module.cases), *commands.shell]
PREPARING = (files, commands, training, scans)
"""Those that write files, which later ones and all cases read."""
