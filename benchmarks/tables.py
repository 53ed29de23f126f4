"""What was measured, as tables in Markdown."""

from collections.abc import Iterable
from itertools import groupby

import numpy as np

from . import instructions
from .comparison import Measurement
from .cpp_calls import CppCall
from .latency import Latency
from .overhead import Overhead
from .results import Results
from .rivals import COPY, DYNMESH, SLOW, TWO_THREADS
from .sizes import fit_line, fit_power_law, unknown_vertices

ABSENT = "-"

_Line = tuple[str, ...]


def tables(results: Results) -> dict[str, str]:
    """By name; those of sections that were not run are left out."""
    made = {"machine": results.machine} if results.machine else {}
    natural = [m for m in results.comparison if m.numbering == "natural"]
    for part, rows in groupby(natural, key=lambda m: m.part):
        of_part = list(rows)
        made[f"{part}-ratios"] = ratios(of_part)
        if any(row.method in SLOW for row in of_part):
            made[f"{part}-errors"] = errors(of_part)
        made[part] = comparison(of_part)
    if natural:
        made["verdict"] = verdict(natural)
        made["numbering"] = numbering(results.comparison)
    if results.sizes:
        made["sizes"] = sizes(results.sizes)
    if results.unknown:
        made["unknown"] = unknown(results.unknown)
    if results.overhead:
        made["overhead"] = overhead(results.overhead)
    if results.latency:
        made["latency"] = latency(results.latency)
    if results.cpp:
        made["cpp"] = cpp(results.cpp)
    if results.instructions is not None:
        made["instructions"] = instruction_counts(results.instructions)
    return made


def ratios(rows: list[Measurement]) -> str:
    """The times of all methods over each other: dynmesh against the copy, the rest against it."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    times = {(row.method, row.mask): _median(row.seconds) for row in rows}
    first = rows[0]
    lines: list[_Line] = [(f"{first.scene}, {first.n_vertices} vertices", *masks)]
    lines.append(("dynmesh, ms", *(_milliseconds(times[DYNMESH, mask]) for mask in masks)))
    for method in dict.fromkeys(row.method for row in rows if row.method != DYNMESH):
        slower = [_ratio(times[method, mask], times[DYNMESH, mask]) for mask in masks]
        faster = [_ratio(times[DYNMESH, mask], times[method, mask]) for mask in masks]
        if method == COPY:
            lines.append((f"dynmesh, times a {COPY}", *faster))
        elif method == TWO_THREADS:
            lines.append((f"{TWO_THREADS}, times faster", *faster))
        else:
            lines.append((f"{method}, times dynmesh", *slower))
    return _table(lines)


def comparison(rows: list[Measurement]) -> str:
    """Everything about one mesh."""
    lines: list[_Line] = [
        (
            "lost by",
            "method",
            "median, ms",
            "quartiles, ms",
            "ns a vertex",
            "times dynmesh",
            "NMSVE x 1e4",
        )
    ]
    for _, group in groupby(rows, key=lambda row: row.mask):
        of_mask = list(group)
        reference = _median(of_mask[0].seconds)
        frames = _common_frames(of_mask)
        for row in of_mask:
            median = _median(row.seconds)
            title = f"{row.mask} ({row.known:.0%} known, {row.generations:.3g} generations)"
            lines.append(
                (
                    title if row.method == DYNMESH else "",
                    row.method,
                    _milliseconds(median),
                    _quartiles(row.seconds),
                    _number(1e9 * median / row.n_vertices),
                    _ratio(median, reference),
                    _number(1e4 * _mean(row.nmsve[:frames])),
                )
            )
    return _table(lines)


def errors(rows: list[Measurement]) -> str:
    """The rivals' errors over dynmesh's; bold where a rival is better."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    means: dict[tuple[str, str], float] = {}
    for mask in masks:
        of_mask = [row for row in rows if row.mask == mask]
        frames = _common_frames(of_mask)
        means |= {(row.method, mask): _mean(row.nmsve[:frames]) for row in of_mask}
    lines: list[_Line] = [("NMSVE", *masks)]
    lines.append(("dynmesh, x 1e4", *(_number(1e4 * means[DYNMESH, mask]) for mask in masks)))
    for method in dict.fromkeys(row.method for row in rows if row.method in SLOW):
        ratios_here = [means[method, mask] / means[DYNMESH, mask] for mask in masks]
        cells = [f"**{ratio:.2f}**" if ratio < 1 else _number(ratio) for ratio in ratios_here]
        lines.append((f"{method}, times dynmesh", *cells))
    return _table(lines)


def verdict(rows: list[Measurement]) -> str:
    """Which rivals are faster, in a sentence."""
    own = {(row.part, row.mask): _median(row.seconds) for row in rows if row.method == DYNMESH}
    rivals = [row for row in rows if row.method in SLOW and row.seconds]
    faster = [
        f"{row.method} on {row.scene} ({row.mask})"
        for row in rivals
        if _median(row.seconds) < own[row.part, row.mask]
    ]
    return f"Faster than dynmesh: {', '.join(faster) or 'none of them, anywhere in this run'}."


def numbering(rows: list[Measurement]) -> str:
    """Vertices numbered at random against their own numbers."""
    times = {(r.n_vertices, r.mask, r.method, r.numbering): _median(r.seconds) for r in rows}
    lines: list[_Line] = [("vertices", "lost by", "method", "natural, ms", "permuted, ms", "ratio")]
    for row in rows:
        if row.numbering != "permuted" or row.method not in (DYNMESH, TWO_THREADS):
            continue
        natural = times[row.n_vertices, row.mask, row.method, "natural"]
        permuted = _median(row.seconds)
        times_here = _milliseconds(natural), _milliseconds(permuted), _ratio(permuted, natural)
        lines.append((str(row.n_vertices), row.mask, row.method, *times_here))
    return _table(lines)


def sizes(rows: list[Measurement]) -> str:
    """Time against size, and the exponents of the fits."""
    counts = list(dict.fromkeys(row.n_vertices for row in rows))
    times = {(row.method, row.mask, row.n_vertices): row for row in rows}
    lines: list[_Line] = [("ms at so many vertices", *map(str, counts), "exponent")]
    for mask in dict.fromkeys(row.mask for row in rows):
        for method in dict.fromkeys(row.method for row in rows):
            found = [times.get((method, mask, count)) for count in counts]
            measured = [row for row in found if row is not None and row.seconds]
            cells = [_milliseconds(_median(row.seconds)) if row else ABSENT for row in found]
            fitted = f"{fit_power_law(measured).exponent:.2f}" if len(measured) > 2 else ABSENT
            lines.append((f"{method}, {mask} known", *cells, fitted))
    return _table(lines)


def unknown(rows: list[Measurement]) -> str:
    """Time against the number of unknown vertices, and the line through it."""
    lines: list[_Line] = [("unknown vertices", "generations", "median, ms", "quartiles, ms")]
    for row in sorted(rows, key=unknown_vertices):
        count, generations = str(unknown_vertices(row)), f"{row.generations:.3g}"
        lines.append(
            (count, generations, _milliseconds(_median(row.seconds)), _quartiles(row.seconds))
        )
    line = fit_line(rows)
    return (
        f"{_table(lines)}\n\nThe line: {1e9 * line.slope:.3g} ns for each unknown vertex and "
        f"{1e3 * line.intercept:.3g} ms besides; R² {line.r_squared:.3f}."
    )


def overhead(rows: list[Overhead]) -> str:
    """Python's part."""
    lines: list[_Line] = [
        ("mesh", "vertices", "call", "Python, µs", "C++, µs", "difference, µs", "difference")
    ]
    for row in rows:
        python, cpp = _median(row.python), _median(row.cpp)
        cells = [_number(1e6 * seconds) for seconds in (python, cpp, python - cpp)]
        share = f"{(python - cpp) / cpp:+.1%}"
        lines.append((row.mesh, str(row.n_vertices), row.call, *cells, share))
    return _table(lines)


def latency(rows: list[Latency]) -> str:
    """Percentiles and page faults."""
    shares = ("50", "90", "99", "99.9", "100")
    columns = ("50 %, ms", "90 %", "99 %", "99.9 %", "longest")
    lines: list[_Line] = [("lost by", "threads", "other cores", "frames", *columns, "page faults")]
    for row in rows:
        times = [_milliseconds(row.percentiles[share]) for share in shares]
        faults = str(row.minor_faults + row.major_faults)
        lines.append((row.mask, str(row.threads), row.others, str(row.n_frames), *times, faults))
    return _table(lines)


def cpp(rows: list[CppCall]) -> str:
    """Google Benchmark's."""
    lines: list[_Line] = [
        ("call", "vertices", "known", "median, ms", "quartiles, ms", "ns a vertex")
    ]
    for row in rows:
        median = _median(row.seconds)
        shown = (
            _milliseconds(median),
            _quartiles(row.seconds),
            _number(1e9 * median / row.n_vertices),
        )
        lines.append((f"`{row.call}`", str(row.n_vertices), f"{row.known} %", *shown))
    return _table(lines)


def instruction_counts(counts: instructions.Counts) -> str:
    """callgrind's, beside the reference."""
    reference = instructions.references().get(counts.build, {})
    lines: list[_Line] = [("lost by", "instructions a frame", "a vertex", "against the reference")]
    for mask, count in counts.per_frame.items():
        expected = reference.get(mask)
        change = f"{count / expected - 1:+.1%}" if expected else ABSENT
        lines.append((mask.replace("%", " %"), str(count), f"{count / 10_000:.0f}", change))
    return f"{_table(lines)}\n\nBuild: {counts.build}."


def _common_frames(rows: Iterable[Measurement]) -> int:
    """How many first frames all methods completed."""
    return min((len(row.nmsve) for row in rows if row.nmsve), default=0)


def _table(lines: list[_Line]) -> str:
    head, *body = lines
    rows = [head, ("---",) * len(head), *body]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def _milliseconds(seconds: float) -> str:
    return _number(1e3 * seconds)


def _quartiles(seconds: list[float]) -> str:
    if not seconds:
        return ABSENT
    first, third = 1e3 * np.percentile(seconds, [25, 75])
    return f"{_number(first)} to {_number(third)}"


def _ratio(seconds: float, reference: float) -> str:
    return _number(seconds / reference)


def _number(value: float) -> str:
    """Three digits, and no powers of ten."""
    if np.isnan(value):
        return ABSENT
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
