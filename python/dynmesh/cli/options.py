"""Arguments, options and checks that several commands share."""

import functools
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer

from .. import files
from .._errors import SettingError
from ..files import Source
from ..jobs.option import OUTPUT, OUTPUT_FORMAT, SOURCE, Option, options_of
from ..settings import SETTINGS, Settings
from .terminal import be_quiet

format_names = files.listed(files.formats)
"""The names of all formats, as text."""


def typer_option(name: str, option: Option) -> Any:
    """What typer needs to know of an option."""
    formats = (lambda: list(files.formats)) if name in ("format", "output_format") else None
    flags = option.flags or (f"--{(option.name or name).replace('_', '-')}",)
    return typer.Option(
        *(() if option.default is True else flags),  # typer itself adds a --no-... to a flag
        help=option.help,
        min=option.least,
        metavar=option.metavar or None,
        autocompletion=formats,
        parser=None if option.parse is None else parser(option.parse),
        rich_help_panel=option.group,
    )


def parser(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Reports what a value cannot be as a usage error."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None

    return parsed


def _parameter(name: str, option: Option) -> inspect.Parameter:
    """The parameter of a command for an option."""
    kind: Any = Literal[option.choices] if option.choices else option.kind
    kind = list[kind] if option.several else kind
    default = option.default
    if default is None:
        kind = kind | None
    if option.parse is not None and default is not None:
        default = str(default)
    return inspect.Parameter(
        option.name or name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if default is MISSING else default,
        annotation=Annotated[kind, typer_option(name, option)],
    )


InputPath = Annotated[
    Path,
    typer.Argument(
        metavar="IN", help="A sequence: a file, a folder, or a pattern in quotes ('*.ply')."
    ),
]
OutputPath = Annotated[Path, typer.Argument(metavar="OUT", help="The result.")]
OutputFormat = Annotated[str | None, typer_option("output_format", OUTPUT_FORMAT)]
Seed = Annotated[int, typer.Option(metavar="N", help="Equal seeds give equal results.", min=0)]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace OUT if it exists.", rich_help_panel=OUTPUT)
]


class Axis(StrEnum):
    """A coordinate axis."""

    x = "x"
    y = "y"
    z = "z"

    @property
    def vector(self) -> tuple[float, float, float]:
        """The unit vector along the axis."""
        return float(self == Axis.x), float(self == Axis.y), float(self == Axis.z)


def with_options(
    kind: type[Any], collect: Callable[..., Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Replaces the parameter `options` of a command by the options of this class.

    `collect` makes the parameter of their values, by name.
    """
    return lambda command: _replaced(command, "options", options_of(kind), collect)


def with_source(
    command: Callable[..., None] | None = None, *, only: Iterable[str] = tuple(SOURCE)
) -> Callable[..., Any]:
    """Replaces the parameter `source` of a command by the options of reading a sequence."""
    if command is None:
        return functools.partial(with_source, only=only)
    return _replaced(command, "source", {name: SOURCE[name] for name in only}, dict)


def _replaced(
    command: Callable[..., None],
    name: str,
    options: Mapping[str, Option],
    collect: Callable[..., Any],
) -> Callable[..., None]:
    """The command with `options`, which `collect` makes into its parameter `name`."""
    signature = inspect.signature(command)
    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        own = [_parameter(*row) for row in options.items()]
        parameters += own if parameter.name == name else [parameter]

    @functools.wraps(command)
    def run(**given: Any) -> None:
        values = {field: given.pop(option.name or field) for field, option in options.items()}
        for field, value in values.items():
            values[field] = None if value == [] else value  # typer's value if none is given
        command(**given, **{name: collect(**values)})

    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def quietly(command: Callable[..., None]) -> Callable[..., None]:
    """Adds --quiet to a command."""
    signature = inspect.signature(command)
    option = typer.Option("--quiet", "-q", help="Print errors alone.", rich_help_panel=OUTPUT)
    added = inspect.Parameter(
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, option]
    )

    @functools.wraps(command)
    def run(*, quiet: bool, **given: Any) -> None:
        be_quiet(quiet)
        command(**given)

    parameters = [*signature.parameters.values(), added]
    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def share_out(source: Source, path: Path, reference: Path) -> tuple[Source, Source]:
    """Assigns --faces, --prim and --gaps to the sequence, its reference or both, by their formats.

    An option that neither format supports is passed to the sequence, whose reader refuses it.
    """
    ours, theirs = files.format_of(path, source.get("format")), files.format_of(reference)
    # Of formats with one file per frame, most files hold their faces.
    own, lendable = (
        one.takes - {"faces"} if "gaps" in one.takes else one.takes for one in (ours, theirs)
    )
    kept = {n: value for n, value in source.items() if n in own or n not in lendable}
    lent = {n: value for n, value in source.items() if n in lendable}
    return (
        cast(Source, {**kept, "format": ours.name}),
        cast(Source, {**lent, "format": theirs.name}),
    )


def share(text: str) -> float:
    """Parses a share above 0 and below 1, such as 0.3 or 30%."""
    number = text.strip().removesuffix("%")
    in_percent = number != text.strip()
    try:
        value = float(number)
    except ValueError:
        raise typer.BadParameter(f"must be a share such as 0.3 or 30%, not '{text}'") from None
    if not 0 < value < (100 if in_percent else 1):
        limits = "0% and below 100%" if in_percent else "0 and below 1"
        advice = f"; for {value:g} per cent, write {value:g}%" if 1 <= value < 100 else ""
        raise typer.BadParameter(f"must be above {limits}, not {text}{advice}")
    return value / 100 if in_percent else value


def usage_error(error: SettingError, settings: Settings) -> typer.BadParameter:
    """Returns the usage error of the option that stands for a refused setting."""
    name = str(error.argument)
    method = "detail" if name in ("training", "drop_above", "bidirectional") else None
    method = SETTINGS[name].method if name in SETTINGS else method
    other = method is not None and method != settings["method"]
    reason = f"requires --method {method}" if other else error.reason
    negation = "no-" if settings.get(name) is False else ""
    return typer.BadParameter(reason, param_hint=f"'--{negation}{name.replace('_', '-')}'")


@contextmanager
def as_usage(option: str) -> Iterator[None]:
    """Reports a value that the library refuses as a usage error of this option."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"'{option}'") from error
