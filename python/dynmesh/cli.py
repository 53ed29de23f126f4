"""The command `dynmesh`: the package for people with a shell and a file."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from . import degrade as degradation
from . import evaluation, files
from . import synth as built_in
from ._core import Completer, __version__
from ._terminal import WorkBar, fail, say, track
from .sequence import Mask, Positions
from .streaming import Settings, complete_pairs

app = typer.Typer(
    name="dynmesh",
    help="Completes dynamic meshes: one connectivity, a whole first frame, holes in the others.\n\n"
    "A sequence is an .npz file with vertices (n, k, 3), faces (m, 3) and, optionally, fps and "
    "known (n, k), True where a position was observed.",
    rich_markup_mode="markdown",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

InputPath = Annotated[Path, typer.Argument(metavar="IN", help="A sequence, .npz.")]
OutputPath = Annotated[Path, typer.Argument(metavar="OUT", help="The result, .npz.")]
Seed = Annotated[int, typer.Option(help="Equal seeds give equal results.", min=0)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")]


class BuiltIn(StrEnum):
    """The built-in sequences."""

    ocean = "ocean"
    walker = "walker"


class Axis(StrEnum):
    """A coordinate axis."""

    x = "x"
    y = "y"
    z = "z"

    @property
    def vector(self) -> tuple[float, float, float]:
        """Its unit vector."""
        return float(self == Axis.x), float(self == Axis.y), float(self == Axis.z)


class Unseen(StrEnum):
    """What becomes of vertices that no edges tie to a known one."""

    follow = "follow"
    hold = "hold"


@contextmanager
def _as_usage() -> Iterator[None]:
    """A value that the library refuses is a wrong call."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"dynmesh {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    pass


@app.command()
def info(path: InputPath) -> None:
    """Say what a sequence holds, and what is odd about its mesh."""
    with files.open(path) as reader:
        shares = list(track(_known_shares(reader), reader.n_frames, "reading"))
        first = next(iter(reader)).points
        topology = Completer(reader.faces, first).topology
        table = Table.grid(padding=(0, 2))
        table.add_row("frames", str(reader.n_frames))
        table.add_row("frames per second", "not said" if reader.fps is None else f"{reader.fps:g}")
        table.add_row("vertices", f"{reader.n_vertices}, {reader.dtype}")
        table.add_row("faces", str(len(reader.faces)))
        table.add_row("known after frame 0", _describe_shares(shares[1:]))
        table.add_row(
            "bounding-box diagonal", f"{evaluation.bounding_box_diagonal(first):g}, of frame 0"
        )
        table.add_row("components", str(topology.components))
        table.add_row("isolated vertices", str(topology.isolated_vertices))
        table.add_row("boundary edges", str(topology.boundary_edges))
        table.add_row("refused faces", str(len(topology.refused_faces)))
        for index, reason in topology.refused_faces[:10]:
            table.add_row("", f"face {index}: {reason}")
        if len(topology.refused_faces) > 10:
            table.add_row("", f"and {len(topology.refused_faces) - 10} more")
    Console().print(table)


@app.command()
def synth(
    name: Annotated[BuiltIn, typer.Argument(metavar="NAME", help="ocean or walker.")],
    output: OutputPath,
    frames: Annotated[int | None, typer.Option(help="How many frames.", min=1)] = None,
    seed: Seed = 0,
    overwrite: Overwrite = False,
) -> None:
    """Make a built-in sequence: a simulated ocean, or a figure that walks and does a handstand."""
    _check_output(output, overwrite)
    make = {BuiltIn.ocean: built_in.ocean, BuiltIn.walker: built_in.walker}[name]
    sequence = make(seed=seed) if frames is None else make(frames, seed=seed)
    files.write(output, sequence)
    n_frames, n_vertices, _ = sequence.vertices.shape
    say(f"{output}: {n_frames} frames of {n_vertices} vertices")


@app.command()
def degrade(
    path: InputPath,
    output: OutputPath,
    known: Annotated[
        float | None,
        typer.Option(metavar="SHARE", help="Keep this share of the vertices, picked at random."),
    ] = None,
    camera: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Keep what N cameras see that circle around --up."),
    ] = None,
    patches: Annotated[
        float | None,
        typer.Option(metavar="SHARE", help="Hide this share under patches that stay for a while."),
    ] = None,
    dropout: Annotated[
        float | None, typer.Option(metavar="SHARE", help="Lose this share of the frames whole.")
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(metavar="SIGMA", help="Add Gaussian noise; SIGMA in mean edges of frame 0."),
    ] = None,
    outliers: Annotated[
        float | None,
        typer.Option(metavar="SHARE", help="Put this share of the vertices far from where it is."),
    ] = None,
    up: Annotated[Axis, typer.Option(help="The axis that cameras circle around.")] = Axis.z,
    seed: Seed = 0,
    overwrite: Overwrite = False,
) -> None:
    """Take vertices away, and add noise, as sensors do; frame 0 stays whole.

    Options add up. A share is above 0 and below 1.
    """
    if all(o is None for o in (known, camera, patches, dropout, noise, outliers)):
        raise typer.BadParameter(
            "say what to do: --known, --camera, --patches, --dropout, --noise or --outliers"
        )
    _check_output(output, overwrite, path)
    with files.open(path) as reader:
        shape = (reader.n_frames, reader.n_vertices)
        masks: list[Iterator[Mask]] = []
        points: Iterator[Positions] = (frame.points for frame in reader)
        with _as_usage():
            if known is not None:
                masks.append(degradation.random_known(*shape, known, seed=seed))
            if camera is not None:
                cameras = degradation.orbit(_bounding_box(reader), camera, up=up.vector)
                frames = (frame.points for frame in reader)
                masks.append(degradation.camera_known(frames, reader.faces, cameras))
            if patches is not None:
                masks.append(degradation.patch_known(reader.faces, *shape, patches, seed=seed))
            if dropout is not None:
                masks.append(degradation.dropout(*shape, dropout, seed=seed))
            if noise is not None:
                points = degradation.add_noise(points, reader.faces, noise, seed=seed)
            if outliers is not None:
                points = degradation.add_outliers(points, reader.faces, outliers, seed=seed)
        with files.create_like(reader, output, with_known=True) as writer:
            frames_known = (frame.known for frame in reader)
            rows = zip(
                track(points, reader.n_frames, "degrading"), frames_known, *masks, strict=True
            )
            n_known = -reader.n_vertices  # frame 0 is whole in any case
            for position, *observed in rows:
                seen = [mask for mask in observed if mask is not None]
                kept = np.logical_and.reduce(seen) if seen else np.ones(len(position), np.bool_)
                # What is not known must not be there to be peeked at.
                writer.append(np.where(kept[:, None], position, reader.dtype.type(np.nan)), kept)
                n_known += int(kept.sum())
        share = n_known / max(1, (reader.n_frames - 1) * reader.n_vertices)
    say(f"{output}: {100 * share:.1f} % of the vertices known after frame 0")


@app.command()
def complete(
    path: InputPath,
    output: OutputPath,
    revisit: Annotated[
        bool, typer.Option(help="Estimate a satellite again at every iteration, or only once.")
    ] = True,
    extra_iterations: Annotated[
        int, typer.Option(help="Iterations after the last satellite is reached.", min=0)
    ] = 0,
    unseen: Annotated[
        Unseen, typer.Option(help="What parts of the mesh without any known vertex do.")
    ] = Unseen.follow,
    overwrite: Overwrite = False,
) -> None:
    """Fill in the missing vertices of every frame, from that frame and the past alone."""
    settings: Settings = {
        "revisit": revisit,
        "extra_iterations": extra_iterations,
        "unseen": unseen.value,
    }
    _check_output(output, overwrite, path)
    seconds = []
    with files.open(path) as reader, files.create_like(reader, output) as writer:
        frames = track(reader, reader.n_frames, "completing")
        with files.naming(path):
            for completed, report in complete_pairs(reader.faces, frames, **settings):
                writer.append(completed)
                seconds.append(report.seconds)
    _say_how_fast(output, seconds[1:])


@app.command()
def reproduce(
    output: Annotated[Path, typer.Argument(metavar="OUT", help="A folder for the results.")],
    data: Annotated[
        list[Path] | None,
        typer.Option(help="A sequence, or a folder of them; may be given again. [built-in ones]"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Two minutes instead of many.")] = False,
    seed: Seed = 0,
    up: Annotated[
        Axis | None, typer.Option(help="The axis that is up in pictures of DATA. [y; z if flat]")
    ] = None,
    azimuth: Annotated[
        float | None, typer.Option(help="Degrees around it that pictures are taken from. [60]")
    ] = None,
) -> None:
    """Reproduce the paper's evaluation: figures 7 to 11, its claims, and what lies beyond.

    Writes figures as PNG and SVG, results.json, and report.html, which stands alone.
    """
    from .reproduce import reproduce as run

    with WorkBar() as progress:
        page = run(
            output,
            data=data or (),
            quick=quick,
            seed=seed,
            up=None if up is None else up.value,
            azimuth=azimuth,
            progress=progress,
        )
    say(f"{page}: open it in a browser")


@app.command()
def evaluate(
    completed: Annotated[Path, typer.Argument(metavar="COMPLETED", help="What was filled in.")],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The truth.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Measure the error of a completed sequence.

    All figures are in bounding-box diagonals of the reference's first frame. NMSVE is the paper's
    normalised mean square visual error; the others are of the distance between a vertex and its
    true position: mean, root mean square and 99th percentile in the mean frame, and the largest of
    all. Frame 0 is left out.
    """
    with files.open(completed) as ours, files.open(reference) as truth:
        result = evaluation.evaluate(ours, truth, track(ours, ours.n_frames, "measuring"))
    if as_json:
        print(json.dumps(_as_json(result), indent=2))
        return
    table = Table.grid(padding=(0, 2))
    table.add_row("NMSVE", f"{result.nmsve:.4g}")
    table.add_row("mean error", f"{result.mean:.4g}")
    table.add_row("root mean square", f"{result.rms:.4g}")
    table.add_row("99th percentile", f"{result.p99:.4g}")
    table.add_row("maximum", f"{result.maximum:.4g}")
    table.add_row("frames", str(result.frames))
    table.add_row("unit", f"bounding-box diagonal of frame 0, {result.bounding_box_diagonal:g}")
    Console().print(table)


def main() -> None:
    """Runs the command line; one line says what went wrong."""
    try:
        app()
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except (ValueError, TypeError, ImportError) as error:
        fail(str(error))


def _as_json(result: evaluation.Evaluation) -> dict[str, Any]:
    summary = {name: getattr(result, name) for name in ("mean", "rms", "p99", "maximum")}
    return {
        "nmsve": result.nmsve,
        "summary": summary,
        "frames": result.frames,
        "bounding_box_diagonal": result.bounding_box_diagonal,
    }


def _check_output(path: Path, overwrite: bool, source: Path | None = None) -> None:
    if source is not None and path.exists() and source.exists() and path.samefile(source):
        raise ValueError(f"{path}: is the input; writing over it would lose it")
    if path.exists() and not overwrite:
        raise ValueError(f"{path}: exists already; --overwrite replaces it")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")


def _say_how_fast(output: Path, seconds: list[float]) -> None:
    if not seconds:
        say(f"{output}: frame 0 alone; there was nothing to complete")
        return
    middle = float(np.median(seconds))
    say(
        f"{output}: {len(seconds)} frames completed in {1e3 * middle:.3g} ms each (median), "
        f"{1 / middle:.0f} frames per second beside reading and writing"
    )


def _bounding_box(reader: files.Reader) -> Positions:
    """Both corners of the box around all frames."""
    corners = np.array([[np.inf] * 3, [-np.inf] * 3])
    for points, _ in reader:
        finite = points[np.isfinite(points).all(axis=1)]
        if len(finite):
            corners[0] = np.minimum(corners[0], finite.min(axis=0))
            corners[1] = np.maximum(corners[1], finite.max(axis=0))
    return corners


def _known_shares(reader: files.Reader) -> Iterator[float]:
    for points, known in reader:
        observed = np.isfinite(points).all(axis=1)
        if known is not None:
            observed &= known
        yield float(observed.mean())


def _describe_shares(shares: list[float]) -> str:
    if not shares:
        return "there is no other frame"
    return f"{100 * np.mean(shares):.1f} % ({100 * min(shares):.1f} to {100 * max(shares):.1f} %)"
