"""Makes the figures and tables of the documentation: ``script/reproduce``."""

import sys
from collections.abc import Callable
from functools import partial

from . import (
    both_sides,
    calibration,
    cases,
    paper,
    tracking_baselines,
    tracking_conditions,
    whole_frame,
)

TABLES: dict[str, Callable[[], None]] = {
    "paper": paper.main,
    **{name: partial(cases.main, name) for name in cases.CASES},
    "both-sides": both_sides.main,
    "calibration": calibration.main,
    "tracking": tracking_baselines.main,
    "tracking-conditions": tracking_conditions.main,
    "whole-frame": whole_frame.main,
}
"""What makes each table, with arguments of its own."""


def main() -> None:
    """Make what the first argument names, without one the figures and tables of the paper."""
    rest = sys.argv[1:]
    if rest[:1] in (["-h"], ["--help"]):
        print(
            "usage: script/reproduce [TABLE] [ARGUMENTS]; TABLE --help lists the arguments of one"
        )
        print(f"The tables are {', '.join(TABLES)}; without one, it makes paper.")
        return
    name = rest.pop(0) if rest and not rest[0].startswith("-") else "paper"
    if name not in TABLES:
        sys.exit(f"{name}: is no table; there are {', '.join(TABLES)}")
    sys.argv = [f"script/reproduce {name}", *rest]
    TABLES[name]()


if __name__ == "__main__":
    main()
