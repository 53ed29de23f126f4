"""What can be asked of a completion, said once.

The Python functions, the command and tables of jobs take it from here.
"""

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self, cast

import numpy as np

from .._checks import check_path, check_positive
from .._errors import InputError, KindError, SettingError
from ..files import PathLike, Source, Target, format_of, target_of
from ..frames.header import Header
from ..settings import Settings, all_settings
from .option import (
    HOW,
    OUTPUT,
    OUTPUT_FORMAT,
    SOURCE,
    STARTS,
    TRAINING,
    WHAT,
    Start,
    TrainingFiles,
    given,
    offered,
    paths_of,
    start_of,
)


@dataclass(frozen=True, kw_only=True)
class CompletionOptions:
    """What can be asked of the completion of a file.

    :func:`dynmesh.complete_file` explains the options; `settings` are its other keywords.
    """

    settings: Settings = field(default_factory=Settings)
    source: Source = field(default_factory=Source, metadata={"source": SOURCE})
    start: Start = given(
        "auto",
        "The frame from which completion starts. Frames before it are completed backwards. auto: "
        "the first frame without missing vertices, else the best one; whole: the same, but it must "
        "exist; best: the frame that knows most; N: its number in IN. "
        "What the frame lacks is put together from all others. clean: as auto, without outliers.",
        WHAT,
        metavar="auto|best|clean|whole|N",
        parse=start_of,
    )
    template: PathLike | None = given(
        None, "A file with the whole mesh, which stands before frame 0.", WHAT, Path, metavar="FILE"
    )
    training: TrainingFiles | None = offered(TRAINING)
    bidirectional: bool = given(
        False,
        "Complete each frame from both sides: from the frame where completion starts outwards, and "
        "back from the end. Errors are a quarter smaller on average, and it takes three to "
        "four times as long. Implies --uncertainty and, without --training, --learn.",
        f"{HOW}: method detail",
        bool,
    )
    provenance: bool = given(
        False,
        "Also write how far each vertex is from an observed one (generation) and the frames "
        "since it was last observed (age); with --uncertainty, its standard error.",
        OUTPUT,
        bool,
    )
    drop_above: float | None = given(
        None,
        "Leave vertices missing whose standard error exceeds this, in the unit of IN. Implies "
        "--uncertainty.",
        OUTPUT,
        float,
        metavar="DISTANCE",
    )
    output_format: str | None = offered(OUTPUT_FORMAT)
    overlay: bool | None = given(
        None,
        "Write OUT as a USD layer over IN, which keeps transforms, materials and all else, or the "
        "mesh alone. [a layer if both are USD]",
        OUTPUT,
        bool,
        flags=("--overlay/--no-overlay",),
    )

    def checked(self) -> Self:
        """Returns the options with all settings, and the training files as paths.

        Raises:
            TypeError, ValueError: an option is refused, or cannot be combined with another.
        """
        check_start(self.start, self.template)
        settings = all_settings(self.settings)
        if self.bidirectional:
            if settings["method"] != "detail":
                raise SettingError("requires method='detail'", argument="bidirectional")
            settings = {**settings, "uncertainty": True, "learn": self.training is None}
        if self.drop_above is not None:
            try:
                check_positive("drop_above", self.drop_above)
            except InputError as error:
                raise SettingError(error.reason, argument=error.argument) from None
            if settings["method"] != "detail":
                raise SettingError("requires method='detail'", argument="drop_above")
            settings = {**settings, "uncertainty": True}
        return replace(
            self, settings=settings, training=check_training(self.training, settings) or None
        )

    def target(self, path: PathLike, output: PathLike) -> Target:
        """Where the completed sequence is written: a layer over its input where both are USD.

        Raises:
            ImportError, ValueError: see :func:`target_of`; or the input is no USD stage, but the
                output is to be a layer over it.
        """
        over_usd = format_of(path, self.source.get("format")).name in ("usd", "usdz")
        if self.overlay and not over_usd:
            raise InputError(
                "an overlay changes a mesh in a USD stage, so the input must be USD (.usd, .usda, "
                ".usdc or .usdz)",
                argument="overlay",
                file=Path(path),
            )
        return target_of(output, self.output_format, overlay=self.overlay if over_usd else False)

    def header(self, read: Header) -> Header:
        """The header of the completed sequence."""
        return replace(
            read,
            has_known=self.drop_above is not None,
            has_provenance=self.provenance,
            has_standard_error=self.provenance and self.settings["uncertainty"],
            standard_error_of="position",
        )


class CompletionKeywords(Settings, total=False):
    """The types of the options as keywords, for editors and type checkers."""

    start: Start
    training: TrainingFiles | None
    source: Source | None
    output_format: str | None
    overlay: bool | None
    bidirectional: bool
    provenance: bool
    drop_above: float | None
    template: PathLike | None


def check_start(start: object, template: object) -> None:
    """Refuses what cannot name a whole frame."""
    names = ", ".join(map(repr, STARTS))
    if isinstance(start, str):
        if start not in STARTS:
            raise InputError(f"must be {names} or a frame, not {start!r}", argument="start")
    elif not isinstance(start, int | np.integer) or isinstance(start, bool):
        raise KindError(f"must be {names} or a whole number, not {start!r}", argument="start")
    if template is not None:
        check_path("template", template)
        if start != "auto":
            raise InputError(
                "stands before frame 0, so completion cannot also start at a frame: leave out one "
                "of start and template",
                argument="template",
            )


def check_training(training: TrainingFiles | None, settings: Settings) -> tuple[Path, ...]:
    """Returns the paths of the training files.

    Raises:
        TypeError, ValueError: they are not paths, there are none, or the method has no training.
    """
    training_files = paths_of(training)
    if training_files and settings["method"] != "detail":
        raise SettingError("requires method='detail'", argument="training")
    return training_files


def completion_options(given: CompletionKeywords) -> CompletionOptions:
    """The options for the keywords of a function; what is no option is taken as a setting."""
    names = {one.name for one in fields(CompletionOptions)} - {"settings"}
    own: dict[str, Any] = {name: value for name, value in given.items() if name in names}
    own["source"] = own.get("source") or {}
    settings = {name: value for name, value in given.items() if name not in names}
    for name in settings.keys() & SOURCE.keys():
        raise KindError(f"belongs to the source: source={{'{name}': ...}}", argument=name)
    return CompletionOptions(**own, settings=cast(Settings, settings))
