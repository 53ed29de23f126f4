"""All tables of a run, in Markdown."""

from itertools import groupby

from dynmesh.study.tables import ABSENT, Line, markdown, median, milliseconds, number, quartiles

from . import comparison_tables, instructions, training
from .comparison import Measurement
from .cpp_calls import CppCall
from .latency import Latency
from .methods import BY_KEY
from .overhead import Overhead
from .results import Results
from .sizes import fit_line, fit_power_law, unknown_vertices


def tables(results: Results) -> dict[str, str]:
    """Return the tables by name; those of sections that were not run are left out."""
    made = {"machine": results.machine} if results.machine else {}
    natural = [m for m in results.comparison if m.numbering == "natural"]
    for part, rows in groupby(natural, key=lambda m: m.part):
        of_part = list(rows)
        made[f"{part}-ratios"] = comparison_tables.ratios(of_part)
        if any(comparison_tables.is_slow(row) for row in of_part):
            made[f"{part}-errors"] = comparison_tables.errors(of_part)
            made[f"{part}-detail"] = comparison_tables.beside_detail(of_part)
        made[part] = comparison_tables.comparison(of_part)
    if natural:
        made["verdict"] = comparison_tables.verdict(natural)
        made["detail-verdict"] = comparison_tables.detail_verdict(natural)
        made["numbering"] = comparison_tables.numbering(results.comparison)
    if results.training:
        made["training-speed"] = training.table(results.training)
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


def sizes(rows: list[Measurement]) -> str:
    """Tabulate time against size, and the fitted exponents."""
    counts = list(dict.fromkeys(row.n_vertices for row in rows))
    times = {(row.method, row.mask, row.n_vertices): row for row in rows}
    lines: list[Line] = [("ms at so many vertices", *map(str, counts), "exponent")]
    for mask in dict.fromkeys(row.mask for row in rows):
        for method in dict.fromkeys(row.method for row in rows):
            found = [times.get((method, mask, count)) for count in counts]
            measured = [row for row in found if row is not None and row.seconds]
            cells = [milliseconds(median(row.seconds)) if row else ABSENT for row in found]
            fitted = f"{fit_power_law(measured).exponent:.2f}" if len(measured) > 2 else ABSENT
            lines.append((f"{BY_KEY[method].label}, {mask} known", *cells, fitted))
    return markdown(lines)


def unknown(rows: list[Measurement]) -> str:
    """Tabulate time against the number of unknown vertices, and give the fitted line."""
    lines: list[Line] = [("unknown vertices", "generations", "median, ms", "quartiles, ms")]
    for row in sorted(rows, key=unknown_vertices):
        count, generations = str(unknown_vertices(row)), f"{row.generations:.3g}"
        lines.append(
            (count, generations, milliseconds(median(row.seconds)), quartiles(row.seconds))
        )
    line = fit_line(rows)
    return (
        f"{markdown(lines)}\n\nThe fitted line is {1e9 * line.slope:.3g} ns for each unknown "
        f"vertex plus {1e3 * line.intercept:.3g} ms, with R² {line.r_squared:.3f}."
    )


def overhead(rows: list[Overhead]) -> str:
    """Tabulate what Python adds to the time of a call."""
    lines: list[Line] = [
        ("mesh", "vertices", "call", "Python, µs", "C++, µs", "difference, µs", "difference")
    ]
    for row in rows:
        python, cpp = median(row.python), median(row.cpp)
        cells = [number(1e6 * seconds) for seconds in (python, cpp, python - cpp)]
        share = f"{(python - cpp) / cpp:+.1%}"
        lines.append((row.mesh, str(row.n_vertices), row.call, *cells, share))
    return markdown(lines)


def latency(rows: list[Latency]) -> str:
    """Tabulate percentiles of the time, and page faults."""
    shares = ("50", "90", "99", "99.9", "100")
    columns = ("50 %, ms", "90 %", "99 %", "99.9 %", "longest")
    head = ("vertices", "lost by", "threads", "other cores", "frames")
    lines: list[Line] = [(*head, *columns, "page faults")]
    for row in rows:
        times = [milliseconds(row.percentiles[share]) for share in shares]
        faults = str(row.minor_faults + row.major_faults)
        case = (str(row.n_vertices), row.mask, str(row.threads), row.others, str(row.n_frames))
        lines.append((*case, *times, faults))
    return markdown(lines)


def cpp(rows: list[CppCall]) -> str:
    """Tabulate the times that Google Benchmark measured."""
    lines: list[Line] = [
        ("call", "vertices", "known", "median, ms", "quartiles, ms", "ns a vertex")
    ]
    for row in rows:
        usual = median(row.seconds)
        shown = (
            milliseconds(usual),
            quartiles(row.seconds),
            number(1e9 * usual / row.n_vertices),
        )
        lines.append((f"`{row.call}`", str(row.n_vertices), f"{row.known} %", *shown))
    return markdown(lines)


def instruction_counts(counts: instructions.Counts) -> str:
    """Tabulate the counted instructions, and their change relative to the reference."""
    reference = instructions.references().get(counts.build, {})
    lines: list[Line] = [("lost by", "instructions a frame", "a vertex", "against the reference")]
    for mask, count in counts.per_frame.items():
        expected = reference.get(mask)
        change = f"{count / expected - 1:+.1%}" if expected else ABSENT
        lines.append((mask.replace("%", " %"), str(count), f"{count / 10_000:.0f}", change))
    return f"{markdown(lines)}\n\nBuild: {counts.build}."
