"""The time of the C++ calls, measured by Google Benchmark in cpp/push_benchmark.cpp."""

import json
import subprocess
from dataclasses import dataclass

from .plan import SpeedPlan
from .subjects import require

CALLS = ("push_mask", "push_nan", "push_sparse", "plain", "copy")


@dataclass
class CppCall:
    """The times of one C++ call.

    Attributes:
        call: the name of the call, one of `CALLS`.
        n_vertices: the number of vertices.
        known: the share of known vertices in per cent.
        seconds: the time of a call, for each repetition.
    """

    call: str
    n_vertices: int
    known: int
    seconds: list[float]


def measure(plan: SpeedPlan) -> list[CppCall]:
    """Measure all calls, with their repetitions in random order.

    Raises:
        ImportError: the C++ benchmarks are not built.
    """
    command = [
        str(require("dynmesh-benchmark")),
        "--benchmark_format=json",
        f"--benchmark_filter={plan.cpp_filter}",
        f"--benchmark_repetitions={plan.cpp_repetitions}",
        "--benchmark_enable_random_interleaving=true",
        "--benchmark_min_time=0.1",
    ]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    calls: dict[str, CppCall] = {}
    for run in json.loads(printed)["benchmarks"]:
        if run["run_type"] != "iteration":
            continue
        call, side, known, *_ = run["run_name"].split("/")
        n_vertices = int(side.removeprefix("side:")) ** 2
        empty = CppCall(call, n_vertices, int(known.removeprefix("known:")), [])
        calls.setdefault(run["run_name"], empty).seconds.append(1e-6 * run["real_time"])
    return sorted(calls.values(), key=lambda c: (c.n_vertices, c.known, CALLS.index(c.call)))
