"""dynmesh beside its rivals, as tables in Markdown."""

from collections.abc import Iterable
from itertools import groupby

from .comparison import Measurement
from .markdown import (
    Line,
    bold_below_one,
    mean,
    median,
    milliseconds,
    number,
    quartiles,
    ratio,
    table,
)
from .rivals import COPY, DETAIL, DYNMESH, SLOW, TWO_THREADS


def ratios(rows: list[Measurement]) -> str:
    """The times of all methods over each other: dynmesh against the copy, the rest against it."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    times = {(row.method, row.mask): median(row.seconds) for row in rows}
    first = rows[0]
    lines: list[Line] = [(f"{first.scene}, {first.n_vertices} vertices", *masks)]
    lines.append(("dynmesh, ms", *(milliseconds(times[DYNMESH, mask]) for mask in masks)))
    for method in dict.fromkeys(row.method for row in rows if row.method != DYNMESH):
        slower = [ratio(times[method, mask], times[DYNMESH, mask]) for mask in masks]
        faster = [ratio(times[DYNMESH, mask], times[method, mask]) for mask in masks]
        if method == COPY:
            lines.append((f"dynmesh, times a {COPY}", *faster))
        elif method == TWO_THREADS:
            lines.append((f"{TWO_THREADS}, times faster", *faster))
        else:
            lines.append((f"{method}, times dynmesh", *slower))
    return table(lines)


def comparison(rows: list[Measurement]) -> str:
    """Everything about one mesh."""
    lines: list[Line] = [
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
        reference = median(of_mask[0].seconds)
        frames = _common_frames(of_mask)
        for row in of_mask:
            usual = median(row.seconds)
            title = f"{row.mask} ({row.known:.0%} known, {row.generations:.3g} generations)"
            lines.append(
                (
                    title if row.method == DYNMESH else "",
                    row.method,
                    milliseconds(usual),
                    quartiles(row.seconds),
                    number(1e9 * usual / row.n_vertices),
                    ratio(usual, reference),
                    number(1e4 * mean(row.nmsve[:frames])),
                )
            )
    return table(lines)


def errors(rows: list[Measurement]) -> str:
    """The rivals' errors over dynmesh's; bold where a rival is better."""
    masks, means = _mean_errors(rows)
    lines: list[Line] = [("NMSVE", *masks)]
    lines.append(("dynmesh, x 1e4", *(number(1e4 * means[DYNMESH, mask]) for mask in masks)))
    for method in _slow(rows):
        lines.append((f"{method}, times dynmesh", *_rival_errors(means, method, DYNMESH, masks)))
    return table(lines)


def beside_detail(rows: list[Measurement]) -> str:
    """Times and errors over those of method detail; bold where a rival is better."""
    masks, means = _mean_errors(rows)
    times = {(row.method, row.mask): median(row.seconds) for row in rows}
    rivals = [method for method in _slow(rows) if method != DETAIL]
    lines: list[Line] = [("beside detail", *masks)]
    lines.append(("time of detail, ms", *(milliseconds(times[DETAIL, mask]) for mask in masks)))
    for method in rivals:
        longer = [times[method, mask] / times[DETAIL, mask] for mask in masks]
        lines.append((f"time of {method}, times detail", *map(bold_below_one, longer)))
    lines.append(("NMSVE of detail, x 1e4", *(number(1e4 * means[DETAIL, mask]) for mask in masks)))
    for method in (DYNMESH, *rivals):
        name = "motion" if method == DYNMESH else method
        cells = _rival_errors(means, method, DETAIL, masks)
        lines.append((f"NMSVE of {name}, times detail", *cells))
    return table(lines)


def verdict(rows: list[Measurement]) -> str:
    """Which rivals are faster, in a sentence."""
    own = {(row.part, row.mask): median(row.seconds) for row in rows if row.method == DYNMESH}
    faster = [
        f"{row.method} on {row.scene} ({row.mask})"
        for row in rows
        if row.method in SLOW and row.seconds and median(row.seconds) < own[row.part, row.mask]
    ]
    return f"Faster than dynmesh: {', '.join(faster) or 'none of them, anywhere in this run'}."


def detail_verdict(rows: list[Measurement]) -> str:
    """Which rivals are more accurate than detail, in a sentence."""
    better = []
    for _, group in groupby(rows, key=lambda row: row.part):
        of_part = list(group)
        masks, means = _mean_errors(of_part)
        for method in _slow(of_part):
            lost = [mask for mask in masks if means[method, mask] < means[DETAIL, mask]]
            if lost:
                better.append(f"{method} on {of_part[0].scene} ({', '.join(lost)})")
    return (
        f"More accurate than detail: {'; '.join(better) or 'none of them, anywhere in this run'}."
    )


def numbering(rows: list[Measurement]) -> str:
    """Vertices numbered at random against their own numbers."""
    times = {(r.n_vertices, r.mask, r.method, r.numbering): median(r.seconds) for r in rows}
    lines: list[Line] = [("vertices", "lost by", "method", "natural, ms", "permuted, ms", "ratio")]
    for row in rows:
        if row.numbering != "permuted" or row.method not in (DYNMESH, TWO_THREADS):
            continue
        natural = times[row.n_vertices, row.mask, row.method, "natural"]
        permuted = median(row.seconds)
        times_here = milliseconds(natural), milliseconds(permuted), ratio(permuted, natural)
        lines.append((str(row.n_vertices), row.mask, row.method, *times_here))
    return table(lines)


def _common_frames(rows: Iterable[Measurement]) -> int:
    """How many first frames all methods completed."""
    return min((len(row.nmsve) for row in rows if row.nmsve), default=0)


def _slow(rows: Iterable[Measurement]) -> list[str]:
    return list(dict.fromkeys(row.method for row in rows if row.method in SLOW))


def _mean_errors(rows: list[Measurement]) -> tuple[list[str], dict[tuple[str, str], float]]:
    """The masks, and the mean NMSVE by method and mask, over the frames all methods completed."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    means: dict[tuple[str, str], float] = {}
    for mask in masks:
        of_mask = [row for row in rows if row.mask == mask]
        frames = _common_frames(of_mask)
        means |= {(row.method, mask): mean(row.nmsve[:frames]) for row in of_mask}
    return masks, means


def _rival_errors(
    means: dict[tuple[str, str], float], method: str, reference: str, masks: list[str]
) -> list[str]:
    return [bold_below_one(means[method, mask] / means[reference, mask]) for mask in masks]
