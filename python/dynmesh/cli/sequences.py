"""The commands that make, change and describe sequences."""

from collections.abc import Iterator
from dataclasses import replace
from enum import StrEnum
from typing import Annotated

import numpy as np
import typer

from .. import degrade as degradation
from .. import files
from .. import synth as built_in
from ..degrade.shared import mean_edge_of
from ..jobs.checkpoint import Source
from ..sequence import Mask, Positions
from .options import (
    Axis,
    FramesPerSecond,
    InputPath,
    OutputFormat,
    OutputPath,
    Overwrite,
    Seed,
    as_usage,
    share,
    with_source,
)
from .scans import SCANS, axis_of, bounding_box, simulate, size_of
from .terminal import say, say_remarks, track

_LOSS = "Loss and noise"


class BuiltIn(StrEnum):
    """The built-in sequences."""

    ocean = "ocean"
    walker = "walker"


def synth(
    name: Annotated[BuiltIn, typer.Argument(metavar="NAME", help="Which sequence.")],
    output: OutputPath,
    frames: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Number of frames. With fewer frames, the walker moves faster.",
            min=1,
        ),
    ] = None,
    seed: Seed = 0,
    overwrite: Overwrite = False,
) -> None:
    """Make a built-in sequence: an ocean, or a figure that walks.

    The ocean is a simulated surface; the walker walks and does a handstand. Example:

    ```text
    dynmesh synth walker walker.npz
    ```
    """
    target = files.target_of(output)
    target.check(overwrite=overwrite)
    make = {BuiltIn.ocean: built_in.ocean, BuiltIn.walker: built_in.walker}[name]
    sequence = make(seed=seed) if frames is None else make(frames, seed=seed)
    remarks = target.write(sequence, overwrite=overwrite)
    n_frames, n_vertices, _ = sequence.vertices.shape
    say_remarks(output, remarks)
    say(f"{output}: {n_frames} frames of {n_vertices} vertices")


@with_source
def degrade(
    path: InputPath,
    output: OutputPath,
    *,
    known: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            parser=share,
            help="Keep this share of the vertices, at random in every frame.",
            rich_help_panel=_LOSS,
        ),
    ] = None,
    camera: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Keep what N circling cameras see.", rich_help_panel=_LOSS
        ),
    ] = None,
    patches: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            parser=share,
            help="Hide this share under patches, for several frames.",
            rich_help_panel=_LOSS,
        ),
    ] = None,
    dropout: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            parser=share,
            help="Drop this share of the frames entirely.",
            rich_help_panel=_LOSS,
        ),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            metavar="SIGMA",
            help="Add Gaussian noise of this standard deviation, in mean edges of frame 0. [0.02 "
            "for scans]",
            rich_help_panel=_LOSS,
        ),
    ] = None,
    outliers: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            parser=share,
            help="Move this share of the vertices by 10 mean edges of frame 0.",
            rich_help_panel=_LOSS,
        ),
    ] = None,
    scan: Annotated[
        bool,
        typer.Option(
            "--scan",
            help="Write loose points with normals, as scanners deliver them, into the folder OUT.",
            rich_help_panel=SCANS,
        ),
    ] = False,
    depth: Annotated[
        str | None,
        typer.Option(
            metavar="WxH",
            help="Write depth images of this size into the folder OUT, such as 640x480.",
            rich_help_panel=SCANS,
        ),
    ] = None,
    cameras: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, help="Number of cameras around the subject.", rich_help_panel=SCANS
        ),
    ] = 4,
    n_points: Annotated[
        int,
        typer.Option(
            "--points", metavar="N", min=1, help="Points per frame.", rich_help_panel=SCANS
        ),
    ] = 20_000,
    flying: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            parser=share,
            help="Share of flying pixels, which lie between a silhouette and what is behind it.",
            rich_help_panel=SCANS,
        ),
    ] = None,
    up: Annotated[
        Axis | None,
        typer.Option(
            help="The axis that cameras circle around. [as in IN, else z]", rich_help_panel=_LOSS
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="Equal seeds remove the same vertices: use another one to degrade a file twice.",
            min=0,
            rich_help_panel=_LOSS,
        ),
    ] = 0,
    source: Source,
    output_format: OutputFormat = None,
    overwrite: Overwrite = False,
) -> None:
    """Remove vertices and add noise, or make scans, as real sensors do.

    Frame 0 remains complete. Options can be combined. A share is a number between 0 and 1 or a
    percentage: 0.3 means 30%. Examples:

    ```text
    dynmesh degrade walker.npz partial.npz --known 0.3
    dynmesh degrade walker.npz scans/frame_%04d.ply --camera 1 --noise 0.1
    dynmesh degrade walker.npz scans --scan --cameras 4 --points 20000 --noise 0.02
    ```

    The last one writes points that belong to no vertex, for `dynmesh track`; frame 0 is scanned,
    too. --known, --patches and --outliers then apply to the points or pixels.
    """
    if scan or depth is not None:
        refused = {"--camera": camera, "--dropout": dropout, "--output-format": output_format}
        simulate(
            path, output, source, depth=size_of(depth, scan), cameras=cameras, points=n_points,
            noise=noise, flying=flying, known=known, patches=patches, outliers=outliers, up=up,
            seed=seed, overwrite=overwrite, refused=refused,
        )  # fmt: skip
        return
    if flying is not None:
        raise typer.BadParameter("--flying is for --scan and --depth")
    if all(o is None for o in (known, camera, patches, dropout, noise, outliers)):
        raise typer.BadParameter(
            "nothing to do: give --known, --camera, --patches, --dropout, --noise, --outliers, "
            "--scan or --depth"
        )
    target = files.target_of(output, output_format)
    with files.open(path, **source) as reader:
        target.check(overwrite=overwrite, reader=reader)
        shape = (reader.n_frames, reader.n_vertices)
        masks: list[Iterator[Mask]] = []
        points: Iterator[Positions] = (frame.points for frame in reader)
        if known is not None:
            with as_usage("--known"):
                masks.append(degradation.random_known(*shape, known, seed=seed))
        if camera is not None:
            axis = axis_of(reader, up)
            with as_usage("--camera"):
                circling = degradation.orbit(bounding_box(reader), camera, up=axis.vector)
                frames = (frame.points for frame in reader)
                masks.append(degradation.camera_known(frames, reader.faces, circling))
        if patches is not None:
            with as_usage("--patches"):
                masks.append(degradation.patch_known(reader.faces, *shape, patches, seed=seed))
        if dropout is not None:
            with as_usage("--dropout"):
                masks.append(degradation.dropout(*shape, dropout, seed=seed))
        sigma = 0.0
        if noise is not None:
            with as_usage("--noise"):
                points = degradation.add_noise(points, reader.faces, noise, seed=seed)
        if outliers is not None:
            with as_usage("--outliers"):
                points = degradation.add_outliers(points, reader.faces, outliers, seed=seed)
        header = replace(
            reader.header, has_known=True, has_provenance=False, has_standard_error=False
        )
        origin = target.kept_of(reader)
        with target.create(header, origin=origin, overwrite=overwrite) as writer:
            frames_known = (frame.known for frame in reader)
            rows = zip(
                track(points, reader.n_frames, "degrading"), frames_known, *masks, strict=True
            )
            n_known = -reader.n_vertices  # frame 0 is always complete and is not counted
            for number, (position, *observed) in enumerate(rows):
                if number == 0 and noise:
                    sigma = noise * mean_edge_of(position, reader.faces)
                seen = [mask for mask in observed if mask is not None]
                kept = np.logical_and.reduce(seen) if seen else np.ones(len(position), np.bool_)
                # Unknown positions are erased, so that no method can use them.
                writer.append(np.where(kept[:, None], position, reader.dtype.type(np.nan)), kept)
                n_known += int(kept.sum())
        say_remarks(output, writer.remarks)
        known_share = n_known / max(1, (reader.n_frames - 1) * reader.n_vertices)
    say(f"{output}: {100 * known_share:.1f} % of the vertices are known after frame 0")
    if sigma:
        told = f"{sigma:.3g}"
        say(f"{output}: noise of {told} added; complete with --noise {told}")


@with_source
def convert(
    path: InputPath,
    output: OutputPath,
    *,
    source: Source,
    output_format: OutputFormat = None,
    fps: FramesPerSecond = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a sequence in another format.

    docs/formats.md lists what each format keeps. Example:

    ```text
    dynmesh convert scans/frame_%04d.ply sequence.npz
    ```
    """
    target = files.target_of(output, output_format)
    with files.open(path, **source) as reader:
        target.check(overwrite=overwrite, reader=reader)
        dropped = reader.has_provenance and not target.writer.keeps_provenance
        header = replace(
            reader.header,
            fps=fps or reader.fps,
            has_provenance=reader.has_provenance and not dropped,
            has_standard_error=reader.header.has_standard_error and not dropped,
        )
        origin = target.kept_of(reader)
        with target.create(header, origin=origin, overwrite=overwrite) as writer:
            for frame in track(reader, reader.n_frames, "converting"):
                traces = {} if dropped else frame.provenance()
                writer.append(frame.points, frame.known, **traces)
    say_remarks(output, writer.remarks)
    if dropped:
        say(f"{output}: generation and age are not written; this format cannot hold them")
    say(f"{output}: {reader.n_frames} frames of {reader.n_vertices} vertices")
