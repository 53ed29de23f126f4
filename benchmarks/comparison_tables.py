"""Tables that compare methods, in Markdown."""

from collections.abc import Iterable
from itertools import groupby

from dynmesh.study.baselines import COPY
from dynmesh.study.methods import DETAIL, MOTION
from dynmesh.study.tables import (
    NMSVE_NAME,
    Line,
    bold_below_one,
    markdown,
    mean,
    median,
    milliseconds,
    nmsve_cell,
    number,
    quartiles,
    ratio,
)

from .comparison import Measurement
from .methods import BY_KEY, SLOW, TWO_THREADS

_SLOW_KEYS = {method.key for method in SLOW}


def is_slow(row: Measurement) -> bool:
    """Return whether a method solves a system for each frame."""
    return row.method in _SLOW_KEYS


def label(row: Measurement) -> str:
    """Return the name of a method in tables."""
    return BY_KEY[row.method].label


def ratios(rows: list[Measurement]) -> str:
    """Tabulate the times relative to motion, and that of motion relative to the copy."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    times = {(row.method, row.mask): median(row.seconds) for row in rows}
    own = [times[MOTION.key, mask] for mask in masks]
    first = rows[0]
    lines: list[Line] = [(f"{first.scene}, {first.n_vertices} vertices", *masks)]
    lines.append((f"{MOTION.label}, ms", *map(milliseconds, own)))
    for key in dict.fromkeys(row.method for row in rows if row.method != MOTION.key):
        theirs = [times[key, mask] for mask in masks]
        if key == COPY.key:
            lines.append((f"motion, times a {COPY.label}", *map(ratio, own, theirs)))
        elif key == TWO_THREADS.key:
            lines.append((f"{TWO_THREADS.label}, times faster", *map(ratio, own, theirs)))
        else:
            lines.append((f"{BY_KEY[key].label}, times motion", *map(ratio, theirs, own)))
    return markdown(lines)


def comparison(rows: list[Measurement]) -> str:
    """Tabulate all measurements on one mesh."""
    columns = ("median, ms", "quartiles, ms", "ns a vertex", "times motion", NMSVE_NAME)
    lines: list[Line] = [("lost by", "method", *columns)]
    for _, group in groupby(rows, key=lambda row: row.mask):
        of_mask = list(group)
        reference = median(of_mask[0].seconds)
        frames = _common_frames(of_mask)
        for row in of_mask:
            usual = median(row.seconds)
            title = f"{row.mask} ({row.known:.0%} known, {row.generations:.3g} generations)"
            lines.append(
                (
                    title if row.method == MOTION.key else "",
                    label(row),
                    milliseconds(usual),
                    quartiles(row.seconds),
                    number(1e9 * usual / row.n_vertices),
                    ratio(usual, reference),
                    nmsve_cell(mean(row.nmsve[:frames])),
                )
            )
    return markdown(lines)


def errors(rows: list[Measurement]) -> str:
    """Tabulate the errors relative to motion, in bold if they are smaller."""
    masks, means = _mean_errors(rows)
    lines: list[Line] = [("NMSVE", *masks)]
    own = [means[MOTION.key, mask] for mask in masks]
    lines.append((f"{MOTION.label}, x 1e4", *map(nmsve_cell, own)))
    for key in _slow(rows):
        cells = _relative_errors(means, key, MOTION.key, masks)
        lines.append((f"{BY_KEY[key].label}, times motion", *cells))
    return markdown(lines)


def beside_detail(rows: list[Measurement]) -> str:
    """Tabulate times and errors relative to detail, in bold if they are smaller."""
    masks, means = _mean_errors(rows)
    times = {(row.method, row.mask): median(row.seconds) for row in rows}
    baselines = [key for key in _slow(rows) if key != DETAIL.key]
    own = [times[DETAIL.key, mask] for mask in masks]
    lines: list[Line] = [("beside detail", *masks)]
    lines.append(("time of detail, ms", *map(milliseconds, own)))
    for key in baselines:
        cells = [bold_below_one(times[key, mask] / times[DETAIL.key, mask]) for mask in masks]
        lines.append((f"time of {BY_KEY[key].label}, times detail", *cells))
    own = [means[DETAIL.key, mask] for mask in masks]
    lines.append(("NMSVE of detail, x 1e4", *map(nmsve_cell, own)))
    for key in (MOTION.key, *baselines):
        cells = _relative_errors(means, key, DETAIL.key, masks)
        lines.append((f"NMSVE of {BY_KEY[key].label}, times detail", *cells))
    return markdown(lines)


def verdict(rows: list[Measurement]) -> str:
    """Say which methods are faster than motion."""
    own = {(row.part, row.mask): median(row.seconds) for row in rows if row.method == MOTION.key}
    faster = [
        f"{label(row)} on {row.scene} ({row.mask})"
        for row in rows
        if is_slow(row) and row.seconds and median(row.seconds) < own[row.part, row.mask]
    ]
    return f"Faster than motion: {', '.join(faster) or 'no other method in this run'}."


def detail_verdict(rows: list[Measurement]) -> str:
    """Say which methods are more accurate than detail."""
    better = []
    for _, group in groupby(rows, key=lambda row: row.part):
        of_part = list(group)
        masks, means = _mean_errors(of_part)
        for key in _slow(of_part):
            lost = [mask for mask in masks if means[key, mask] < means[DETAIL.key, mask]]
            if lost:
                better.append(f"{BY_KEY[key].label} on {of_part[0].scene} ({', '.join(lost)})")
    return f"More accurate than detail: {'; '.join(better) or 'no other method in this run'}."


def numbering(rows: list[Measurement]) -> str:
    """Tabulate the times with vertices in random order and in their own order."""
    times = {(r.n_vertices, r.mask, r.method, r.numbering): median(r.seconds) for r in rows}
    lines: list[Line] = [("vertices", "lost by", "method", "natural, ms", "permuted, ms", "ratio")]
    for row in rows:
        if row.numbering != "permuted" or row.method not in (MOTION.key, TWO_THREADS.key):
            continue
        natural = times[row.n_vertices, row.mask, row.method, "natural"]
        permuted = median(row.seconds)
        times_here = milliseconds(natural), milliseconds(permuted), ratio(permuted, natural)
        lines.append((str(row.n_vertices), row.mask, label(row), *times_here))
    return markdown(lines)


def _common_frames(rows: Iterable[Measurement]) -> int:
    """Return the number of frames, counted from the first, that all methods completed."""
    return min((len(row.nmsve) for row in rows if row.nmsve), default=0)


def _slow(rows: Iterable[Measurement]) -> list[str]:
    return list(dict.fromkeys(row.method for row in rows if is_slow(row)))


def _mean_errors(rows: list[Measurement]) -> tuple[list[str], dict[tuple[str, str], float]]:
    """Return the masks, and the mean NMSVE by method and mask over the common frames."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    means: dict[tuple[str, str], float] = {}
    for mask in masks:
        of_mask = [row for row in rows if row.mask == mask]
        frames = _common_frames(of_mask)
        means |= {(row.method, mask): mean(row.nmsve[:frames]) for row in of_mask}
    return masks, means


def _relative_errors(
    means: dict[tuple[str, str], float], method: str, reference: str, masks: list[str]
) -> list[str]:
    return [bold_below_one(means[method, mask] / means[reference, mask]) for mask in masks]
