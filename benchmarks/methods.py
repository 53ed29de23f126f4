"""The methods whose speed is measured: those of every comparison, and what only concerns speed."""

from dynmesh.study.completion import Method
from dynmesh.study.methods import DETAIL, MOTION, dynmesh_method

from .baselines import BASELINES, COPY, HARMONIC, SCIPY
from .compiled import CppMethod


def varied_detail(constant: str, factor: float) -> Method:
    """Return method detail with one of its constants multiplied by a factor."""
    name = f"detail, {constant} x {factor:g}"
    return Method(
        name,
        name,
        DETAIL.colour,
        "--",
        lambda faces, first: CppMethod(faces, first, constant, factor),
    )


TWO_THREADS = dynmesh_method(
    "motion_two_threads", "motion, two threads", "#56b4e9", "--", method="motion", threads=2
)
PLAIN = Method("plain", "plain C++", "#e69f00", "-", CppMethod)

FAST = (MOTION, TWO_THREADS, PLAIN, COPY)
SLOW = (DETAIL, SCIPY, HARMONIC, *BASELINES)
"""The methods that solve a system for each frame. They take ten to two thousand times as long."""

SHARED_FROM = 23_553
"""The number of vertices from which on method motion uses more than one thread."""

ALL = (*FAST, *SLOW)
ON_ONE_THREAD = tuple(method for method in ALL if method is not TWO_THREADS)
BY_KEY = {method.key: method for method in ALL}
