"""What is drawn of a sequence: its frames, its missing vertices, and values of the vertices."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import InitVar, dataclass, field
from functools import cached_property, partial
from itertools import repeat
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, Positions
from .._checks import check_text
from .._errors import InputError, locating, require
from ..formats.conversion import check_same_size, comparable, places_of
from ..frame import FUSED, Frame, Frames, Indices, check_whole, frame_at
from ..losses.losses import round_up
from ..metrics import bounding_box_diagonal
from ..scans import ScanReader
from ..topology import mean_edge_of
from .figures import HEATMAP_RANGE, KNOWN_COLOUR, MISSING_COLOUR
from .scales import Scale, Values, count_scale, measure_scale, step_scale

Alone = Literal["error", "generation", "age", "standard_error", "known", "mesh", "plain"]
"""What the colour of a vertex shows; plain is one colour for all."""

Colour = Literal[Alone, "distance"]
"""The same, or what it shows beside scans."""

_COLOURS_OF_MESHES = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
"""Of Okabe and Ito, which the colour-blind tell apart."""
_SMALLEST_LIMIT = 1e-6  # of the bounding-box diagonal: about what float32 positions resolve
_FARTHEST = 2.0  # mean edges; from one on, a point counts as far from the surface
_POINTS_PER_VERTEX = 10  # of a scan, for distances; between so many, a third of an edge is left


class LengthUnit(NamedTuple):
    """The unit in which lengths are shown, as it follows a number and as words in a title."""

    sign: str
    words: str
    per_unit: float
    """So many are a unit of the positions."""


_MOST_POINTS = 5000
"""Of a scan in a frame; more would make a page large and look the same."""


@dataclass(frozen=True, eq=False)
class ShownFrame:
    """One frame as it is drawn.

    The points, (k, 3), and the values that colours can show, (k,) each, are arbitrary where a
    vertex is not visible. Beside it is the same frame of "input" and "reference", if there are
    any, and some points of the scan, (n, 3), if there are scans.
    """

    number: int
    points: Positions
    visible: Mask
    values: Mapping[Colour, Values]
    beside: Mapping[str, "ShownFrame"]
    cloud: Positions | None = None

    def of(self, vertices: NDArray[np.intp]) -> "ShownFrame":
        """Returns the same frame with only some of its vertices."""
        values = {colour: values[vertices] for colour, values in self.values.items()}
        beside = {name: frame.of(vertices) for name, frame in self.beside.items()}
        return ShownFrame(
            self.number, self.points[vertices], self.visible[vertices], values, beside, self.cloud
        )


@dataclass(eq=False)
class Heatmap:
    """The frames of a sequence with the values that their colours can show.

    It determines what can be shown, and the colour that is shown at first: `wanted`, or else the
    error if there is a reference, otherwise the generation or the known mask if the sequence has
    them, otherwise the distance if there are scans, otherwise "plain". Errors are in millimetres if
    a file states its unit, otherwise in per cent of the bounding-box diagonal of frame 0 of the
    reference.

    Attributes:
        reader: the shown sequence.
        reference: the true one.
        input: that with the vertices that were observed.
        scans: in which it was tracked, in a unit that is `scan_factor` times as long as its own.
        colour_range: of the colours of errors, in the unit in which they are shown; else, it
            follows from them.
        colours: what the colours can show: "plain", which is one colour, comes last.
        colour: what they show at first.
    """

    reader: Frames
    reference: Frames | None = None
    input: Frames | None = None
    scans: ScanReader | None = None
    scan_factor: float = 1.0
    colour_range: tuple[float, float] | None = None
    wanted: InitVar[Colour | None] = None
    colours: tuple[Colour, ...] = field(init=False)
    colour: Colour = field(init=False)

    def __post_init__(self, wanted: Colour | None) -> None:
        self._places: dict[str, Indices] = {"reader": range(self.reader.n_frames)}
        for name in ("reference", "input"):
            if (other := getattr(self, name)) is not None:
                self._places[name] = comparable(self.reader, other)
        if self.scans is not None:
            numbers = np.array(self.scans.numbers, np.float64)
            self._places["scans"] = places_of(self.reader, self.scans.path, numbers)
        if self.reference is not None:
            check_same_size(self.reader, self.reference)
        lacks: dict[Colour, str | None] = {n: row.lacks(self) for n, row in QUANTITIES.items()}
        lacks["plain"] = None
        unknown = f"must be one of {', '.join(lacks)}, not {wanted!r}"
        if wanted is not None:
            check_text("colour", wanted)
        if wanted is not None and (reason := lacks.get(wanted, unknown)) is not None:
            raise InputError(reason, argument="colour", value=wanted)
        self.colours = tuple(name for name, reason in lacks.items() if reason is None)
        self.colour = wanted or self.colours[0]
        if {"error", "standard_error"} & set(self.colours):
            _ = self.unit  # refuses errors without a unit before any frame is read
        elif self.colour_range is not None:
            message = "is that of errors and standard errors, of which there are none"
            raise InputError(message, argument="colour_range", value=self.colour_range)

    def frames(self, numbers: range) -> Iterator[ShownFrame]:
        """Yields frames of ascending numbers."""
        readers = ("reader", "reference", "input", "scans")
        for number, frame, truth, given, scan in zip(
            numbers, *(self._read(name, numbers) for name in readers), strict=False
        ):
            cloud = None
            if self.scans is not None:  # in the unit of the sequence; empty if a scan is missing
                cloud = np.zeros((0, 3)) if scan is None else scan.scaled(self.scan_factor).cloud
            moment = Moment(number, frame, truth, given, cloud)
            values = {
                name: row.values(self, moment)
                for name, row in QUANTITIES.items()
                if name in self.colours
            }
            beside = {
                name: ShownFrame(number, other.points, other.present, {}, {})
                for name, other in (("input", given), ("reference", truth))
                if other is not None
            }
            if cloud is not None:
                cloud = cloud[:: max(1, -(-len(cloud) // _MOST_POINTS))]
            yield ShownFrame(number, frame.points, frame.present, values, beside, cloud)

    def _read(self, name: str, numbers: range) -> Iterator[Any]:
        """Yields what one of the readers has in these frames; None forever without it."""
        places, reader = self._places.get(name), getattr(self, name)
        if places is None:
            return repeat(None)
        return iter(reader.frames_at([places[number] for number in numbers]))

    def scale(self, colour: Colour, frames: Iterable[ShownFrame]) -> Scale | None:
        """Returns the scale of this colour for frames, or None for the colour "plain"."""
        if colour == "plain":
            return None
        # Standard errors are shown on the scale of the errors, so that the two compare.
        source = "error" if colour == "standard_error" and "error" in self.colours else colour
        seen = [frame.values[source][frame.visible] for frame in frames]
        return QUANTITIES[colour].scale(self, seen)

    @cached_property
    def diagonal(self) -> float:
        """Of the bounding box of frame 0, of the reference if there is one."""
        return bounding_box_diagonal(frame_at(self.reference or self.reader, 0).points)

    @cached_property
    def mean_edge(self) -> float:
        """Of frame 0 of the sequence."""
        return mean_edge_of(frame_at(self.reader, 0).points, self.reader.faces)

    @cached_property
    def unit(self) -> LengthUnit:
        """Millimetres if a file states its unit, otherwise per cent of the diagonal."""
        for reader in (self.reader, self.reference):
            if reader is not None and reader.header.metres_per_unit is not None:
                return LengthUnit("mm", "mm", 1000 * reader.header.metres_per_unit)
        if not self.diagonal > 0:
            path = (self.reference or self.reader).path
            raise InputError(
                "errors have no unit, as all of the first frame is at one point", file=path
            )
        return LengthUnit("%", "% of the bounding-box diagonal", 100 / self.diagonal)


class Moment(NamedTuple):
    """A frame of each of the :class:`Heatmap`; the cloud is in the unit of the sequence."""

    number: int
    frame: Frame
    truth: Frame | None
    given: Frame | None
    cloud: Positions | None


Seen: TypeAlias = list[Values]
"""The values of the visible vertices of each frame."""


class Quantity(NamedTuple):
    """A value of each vertex that colours can show.

    Attributes:
        lacks: returns what the heatmap lack to have it, as a sentence, or None.
        values: returns the (k,) values of a moment, arbitrary where the vertex is missing.
        scale: returns a colour scale for what is seen in all frames.
    """

    lacks: Callable[[Heatmap], str | None]
    values: Callable[[Heatmap, Moment], Values]
    scale: Callable[[Heatmap, Seen], Scale]


def _lacks_reference(heatmap: Heatmap) -> str | None:
    return "error requires a `reference`" if heatmap.reference is None else None


def _lacks(name: str, by: str, heatmap: Heatmap) -> str | None:
    """Tells of a sequence without an attribute, and what writes it."""
    if name in heatmap.reader.header.attributes:
        return None
    return f"{heatmap.reader.path}: holds no {name}; {by}"


def _lacks_masks(heatmap: Heatmap) -> str | None:
    reader = heatmap.reader
    if reader.header.has_known or reader.header.has_provenance or heatmap.input is not None:
        return None
    return f"{reader.path}: holds no known masks"


def _lacks_scans(heatmap: Heatmap) -> str | None:
    return "colour: distance requires scans" if heatmap.scans is None else None


def _lacks_meshes(heatmap: Heatmap) -> str | None:
    return None if heatmap.reader.each else f"{heatmap.reader.path}: shows a single mesh"


def _mesh(heatmap: Heatmap, _: Moment) -> Values:
    sizes = [one.n_vertices for one in heatmap.reader.each.values()]
    return np.repeat(np.arange(len(sizes)), sizes)


def _mesh_scale(heatmap: Heatmap, _: Seen) -> Scale:
    names = short_names([*heatmap.reader.each])
    colours = [_COLOURS_OF_MESHES[n % len(_COLOURS_OF_MESHES)] for n in range(len(names))]
    return step_scale("meshes", range(len(names)), names, colours)


def short_names(paths: Sequence[str]) -> list[str]:
    """The last parts of paths of meshes, if they tell them apart, else the paths."""
    last = [path.rpartition("/")[2] for path in paths]
    return last if len({*last}) == len(last) else [*paths]


def _error(heatmap: Heatmap, moment: Moment) -> Values:
    truth, frame = moment.truth, moment.frame
    assert truth is not None  # as _lacks_reference says
    assert heatmap.reference is not None
    place = heatmap._places["reference"][moment.number]
    number = heatmap.reference.header.number(place)
    with locating(file=heatmap.reference.path, frame=number):
        check_whole(truth, "; errors require a complete reference")
    with np.errstate(invalid="ignore"):  # missing positions may be infinite
        difference = frame.points.astype(np.float64) - truth.points
    return np.asarray(np.linalg.norm(difference, axis=1) * heatmap.unit.per_unit)


def _attribute(name: str, _: Heatmap, moment: Moment) -> Values:
    return moment.frame.attributes()[name]


def _known(_: Heatmap, moment: Moment) -> Values:
    frame, given = moment.frame, moment.given
    if frame.known is None and frame.generation is None:
        assert given is not None  # as _lacks_masks says
        return given.observed.astype(np.int8)
    return frame.claimed.astype(np.int8)


def _distance(heatmap: Heatmap, moment: Moment) -> Values:
    points, cloud = moment.frame.points.astype(np.float64), moment.cloud
    distances = np.full(len(points), np.inf)
    assert cloud is not None  # as _lacks_scans says
    if len(cloud):
        some = cloud[:: max(1, len(cloud) // (_POINTS_PER_VERTEX * len(points)))]
        seen = moment.frame.present
        locator = require("vtkmodules.vtkCommonDataModel", extra="view").vtkStaticPointLocator()
        locator.SetDataSet(require("pyvista", extra="view").PolyData(some))
        locator.BuildLocator()
        nearest = some[[locator.FindClosestPoint(point) for point in points[seen]]]
        distances[seen] = np.linalg.norm(points[seen] - nearest, axis=1) / heatmap.mean_edge
    return distances


def _standard_error(heatmap: Heatmap, moment: Moment) -> Values:
    """Returns those of distances, to compare with errors; the largest where disconnected."""
    bars = moment.frame.standard_error
    assert bars is not None
    coordinates = 3 if heatmap.reader.header.standard_error_of == "position" else 1
    of_distances = math.sqrt(coordinates) * bars.astype(np.float64) * heatmap.unit.per_unit
    finite = np.isfinite(of_distances)
    return np.where(finite, of_distances, of_distances.max(initial=0.0, where=finite))


def _length_scale(name: str, heatmap: Heatmap, seen: Seen) -> Scale:
    unit = heatmap.unit
    if heatmap.colour_range is not None:
        return measure_scale(f"{name} in {unit.words}", unit.sign, *heatmap.colour_range)
    # Less than the maximum: with one outlier, everything else would have one colour.
    most = max((float(np.percentile(values, 99)) for values in seen if len(values)), default=0.0)
    smallest = _SMALLEST_LIMIT * heatmap.diagonal * unit.per_unit or math.ulp(0.0)
    high = round_up(max(most, smallest))
    return measure_scale(f"{name} in {unit.words}", unit.sign, HEATMAP_RANGE * high, high)


def _standard_error_scale(heatmap: Heatmap, seen: Seen) -> Scale:
    is_of_surface = heatmap.reader.header.standard_error_of == "surface"
    name = "standard error from the surface" if is_of_surface else "standard error"
    return _length_scale(name, heatmap, seen)


def _count_scale(title: str, _: Heatmap, seen: Seen) -> Scale:
    values = np.unique(np.concatenate([[0], *seen]))
    below = "disconnected" if -1 in values else None
    if FUSED in values:
        below = "not from this frame" if below else "put together"
    return count_scale(title, int(values[-1]), zero="observed", minus_one=below)


def _known_scale(heatmap: Heatmap, _: Seen) -> Scale:
    labels, colours = ["observed"], [KNOWN_COLOUR]
    if heatmap.reader.header.has_provenance or heatmap.input is not None:
        labels, colours = ["filled in", "observed"], [MISSING_COLOUR, KNOWN_COLOUR]
    return step_scale("known vertices", range(len(labels)), labels, colours)


def _distance_scale(_: Heatmap, __: Seen) -> Scale:
    return measure_scale("distance from the nearest point in mean edges", "edges", 0.0, _FARTHEST)


_COMPLETION = "a completion with `provenance` writes it"
_UNCERTAINTY = "completion and tracking write it with `uncertainty`"

QUANTITIES: dict[Colour, Quantity] = {
    "error": Quantity(_lacks_reference, _error, partial(_length_scale, "error")),
    "generation": Quantity(
        partial(_lacks, "generation", _COMPLETION),
        partial(_attribute, "generation"),
        partial(_count_scale, "generation: steps from the observed"),
    ),
    "age": Quantity(
        partial(_lacks, "age", _COMPLETION),
        partial(_attribute, "age"),
        partial(_count_scale, "age: frames since last observed"),
    ),
    "standard_error": Quantity(
        partial(_lacks, "standard_error", _UNCERTAINTY), _standard_error, _standard_error_scale
    ),
    "known": Quantity(_lacks_masks, _known, _known_scale),
    "mesh": Quantity(_lacks_meshes, _mesh, _mesh_scale),
    "distance": Quantity(_lacks_scans, _distance, _distance_scale),
}
"""By colour; without a choice, colours show the first that the heatmap have."""


def stated_up(*readers: Frames | None) -> str | None:
    """Returns the up axis that the first of these files states that states one."""
    axes = (None if reader is None else reader.header.up_axis for reader in readers)
    return next((axis for axis in axes if axis is not None), None)


def whole_faces(
    faces: NDArray[np.integer[Any]], visible: Mask
) -> tuple[NDArray[np.integer[Any]], Mask]:
    """Returns the triangles without missing vertices, and the visible vertices in none of them."""
    whole = faces[visible[faces].all(axis=1)]
    alone = visible.copy()
    alone[whole] = False
    return whole, alone
