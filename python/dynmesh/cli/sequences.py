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
from ..files import Source
from ..frames.naming import numbering
from ..jobs.conversion_options import ConversionKeywords, ConversionOptions
from ..jobs.converting import convert_file
from ..sequence import Mask, Positions
from .options import (
    InputPath,
    OutputFormat,
    OutputPath,
    Overwrite,
    Seed,
    as_usage,
    with_options,
    with_source,
)
from .scans import Degradation, axis_of, bounding_box, simulate
from .terminal import say, say_remarks, track


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


@with_options(Degradation, Degradation)
@with_source
def degrade(
    path: InputPath,
    output: OutputPath,
    *,
    options: Degradation,
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
    if options.scan or options.depth is not None:
        refused = {
            "--camera": options.camera,
            "--dropout": options.dropout,
            "--output-format": output_format,
        }
        simulate(path, output, source, options, overwrite=overwrite, refused=refused)
        return
    for name, value in (("flying", options.flying), ("room", options.room or None)):
        if value is not None:
            raise typer.BadParameter(f"--{name} is for --scan and --depth")
    noise, outliers, seed = options.noise, options.outliers, options.seed
    ways = ("known", "camera", "patches", "dropout", "noise", "outliers")
    if all(getattr(options, way) is None for way in ways):
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
        if options.known is not None:
            with as_usage("--known"):
                masks.append(degradation.random_known(*shape, options.known, seed=seed))
        if options.camera is not None:
            axis = axis_of(reader, options.up)
            with as_usage("--camera"):
                box = bounding_box(reader)
                circling = degradation.orbit(box, options.camera, up=axis.vector)
                frames = (frame.points for frame in reader)
                masks.append(degradation.camera_known(frames, reader.faces, circling))
        if options.patches is not None:
            with as_usage("--patches"):
                share = options.patches
                masks.append(degradation.patch_known(reader.faces, *shape, share, seed=seed))
        if options.dropout is not None:
            with as_usage("--dropout"):
                masks.append(degradation.dropout(*shape, options.dropout, seed=seed))
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
        with (
            numbering(reader.path, header),
            target.create(header, overwrite=overwrite) as writer,
        ):
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
        first = reader.header.number(0)
    say(f"{output}: {100 * known_share:.1f} % of the vertices are known after frame {first}")
    if sigma:
        told = f"{sigma:.3g}"
        say(f"{output}: noise of {told} added; complete with --noise {told}")


@with_options(ConversionOptions, dict)
@with_source
def convert(
    path: InputPath,
    output: OutputPath,
    *,
    options: ConversionKeywords,
    source: Source,
    output_format: OutputFormat = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a sequence in another format, or with other frames, axes, units or rates.

    docs/formats.md lists what each format keeps. Points are turned and scaled only by --to-up,
    --to-unit and --scale. Examples:

    ```text
    dynmesh convert scans/frame_%04d.ply sequence.npz
    dynmesh convert shot.obj shot.usd --up z --unit cm --fps 24
    dynmesh convert shot.usd part.abc --frames 1001:1050 --to-unit m --retime 30
    ```
    """
    report = convert_file(
        path,
        output,
        source=source,
        output_format=output_format,
        overwrite=overwrite,
        watch=lambda frames, n: track(frames, n, "converting"),
        **options,
    )
    say_remarks(output, report.remarks)
    say(f"{output}: {report.frames} frames of {report.vertices} vertices")
