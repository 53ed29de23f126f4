"""The built-in sequences, written to files."""

from pathlib import Path
from typing import Literal

from .. import files, synth
from .._command import Output, What
from .._report import Written
from ..files import PathLike


def synth_file(
    name: Literal["ocean", "walker"],
    output: PathLike,
    *,
    frames: What[int | None] = None,
    seed: What[int] = 0,
    overwrite: Output[bool] = False,
) -> Written:
    """Makes a built-in sequence: an ocean, or a figure that walks and does a handstand.

    Args:
        name: which sequence: ocean or walker.
        output: the result.
        frames: number of frames; with fewer, the walker moves faster.
        seed: equal seeds give equal results.
        overwrite: whether to replace an existing output.

    Raises:
        FileExistsError: the output exists.
        OSError, ImportError, TypeError, ValueError: the file cannot be written, or an argument is
            refused.
    """
    target = files.target_of(output)
    target.check(overwrite=overwrite)
    make = {"ocean": synth.ocean, "walker": synth.walker}[name]
    sequence = make(seed=seed) if frames is None else make(frames, seed=seed)
    remarks = target.write(sequence, overwrite=overwrite)
    n_frames, n_vertices, _ = sequence.vertices.shape
    return Written(
        output=Path(output), frames=n_frames, vertices=n_vertices, remarks=tuple(remarks)
    )
