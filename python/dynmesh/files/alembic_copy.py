"""Copies a scene from one Alembic archive to another, except for what is written anew.

Objects, properties and samples are copied as they are, whatever their meaning, so that transforms,
texture coordinates, face sets, materials, cameras and the data of users are kept.
"""

import contextlib
from collections.abc import Collection, Iterator
from itertools import chain, islice
from typing import Any

from .alembic_archive import AlembicScene, library, translating
from .alembic_output import OutputArchive, metadata_of

_bounds = ".childBnds"
"""Boxes around the objects below, which no longer fit if a mesh changes; programs compute them."""


class SceneCopy:
    """The scene of an archive in another one.

    All objects are created at once, and the properties of each when they are asked for: first, if
    at all, by :meth:`copy_mesh`, and otherwise by :meth:`copy_share` or :meth:`copy_rest`.

    Attributes:
        scene: what is copied.
        dropped: the paths of the properties that the library cannot copy.
    """

    def __init__(
        self, scene: AlembicScene, meshes: Collection[str], output: OutputArchive, pace: float
    ) -> None:
        """Creates the objects, of which :meth:`copy_mesh` may ask for `meshes`.

        All times are multiplied by `pace`.
        """
        self.dropped: list[str] = []
        self.scene = scene
        self._output = output
        self._pace = pace
        self._changed = {above for mesh in meshes for above in paths_above(mesh)}
        self._pairs: dict[str, tuple[Any, Any]] = {}
        instances: list[tuple[Any, Any]] = []
        with self._reading():
            self._create(scene.archive.getTop(), output.top, instances)
            for parent, child in instances:
                _, source = self._pairs[child.instanceSourcePath()]
                parent.addChildInstance(source, child.getName())
        self._left = [path for path in self._pairs if path not in meshes]
        self._n_others = len(self._left)

    def _create(self, original: Any, copy: Any, instances: list[tuple[Any, Any]]) -> None:
        self._pairs[original.getFullName()] = (original, copy)
        for number in range(original.getNumChildren()):
            child = original.getChild(number)
            if child.isInstanceRoot():
                instances.append((copy, child))
            else:
                made = self._output.object(copy, child.getName(), metadata_of(child))
                self._create(child, made, instances)

    def copy_mesh(self, path: str, *, without: Collection[str]) -> dict[str, Any]:
        """Copies the properties of a mesh, except those with paths such as ".geom/P" in `without`.

        Returns its compound properties by their paths, such as ".geom".
        """
        with self._reading():
            return self._copy_object(path, without)

    def copy_share(self, share: float) -> None:
        """Copies other objects until this share of them, from 0 to 1, is copied."""
        with self._reading():
            while self._left and 1 - len(self._left) / self._n_others < share:
                self._copy_object(self._left.pop(), ())

    def copy_rest(self) -> None:
        """Copies all objects that are left, the meshes included."""
        self.copy_share(1)
        with self._reading():
            for path in list(self._pairs):
                self._copy_object(path, ())

    def sampling(self, original: Any) -> int:
        """Returns the number of the copied time sampling of a property."""
        sampling = original.getTimeSampling()
        if self._pace != 1 and not (original.getNumSamples() < 2 and _is_default(sampling)):
            sampling = _slower(sampling, self._pace)
        return self._output.sampling(sampling)

    def close(self) -> None:
        """Releases all objects."""
        self._pairs.clear()

    def _copy_object(self, path: str, without: Collection[str]) -> dict[str, Any]:
        if path not in self._pairs:
            return {}
        original, copy = self._pairs.pop(path)
        if path in self._changed:
            without = {*without, _bounds, f".geom/{_bounds}", f".xform/{_bounds}"}
        made: dict[str, Any] = {}
        self._copy_compound(original.getProperties(), copy.getProperties(), "", without, made)
        self.dropped += [f"{path} {inner}" for inner, compound in made.items() if compound is None]
        return made

    def _copy_compound(
        self, original: Any, copy: Any, inside: str, without: Collection[str], made: dict[str, Any]
    ) -> None:
        """Copies all properties in a compound; properties without a copy are None in `made`."""
        made[inside] = copy
        for header in original.propertyheaders:
            name = header.getName()
            inner = f"{inside}/{name}" if inside else name
            if inner in without:
                continue
            if header.isCompound():
                nested = library("Abc").ICompoundProperty(original, name)
                compound = self._output.property(
                    "OCompoundProperty", copy, name, metadata=metadata_of(header)
                )
                self._copy_compound(nested, compound, inner, without, made)
            elif not self._copy_samples(original, header, copy):
                made[inner] = None

    def _copy_samples(self, original: Any, header: Any, copy: Any) -> bool:
        """Copies a property with all its samples; returns whether the library can do that."""
        kind, name = "ScalarProperty" if header.isScalar() else "ArrayProperty", header.getName()
        source = getattr(library("Abc"), f"I{kind}")(original, name)
        values = map(source.getValue, range(source.getNumSamples()))
        try:
            first = list(islice(values, 1))  # before anything is made
            target = self._output.property(
                f"O{kind}",
                copy,
                name,
                source.getDataType(),
                metadata=metadata_of(header),
                sampling=self.sampling(source),
            )
            for value in chain(first, values):
                self._output.add(target, value)
        except (RuntimeError, TypeError) as error:
            if isinstance(error, TypeError) or "Unhandled type" in str(error):
                return False
            raise
        return True

    def _reading(self) -> contextlib.AbstractContextManager[None]:
        return translating(ValueError, f"{self.scene.path}: is damaged")


def paths_above(path: str) -> Iterator[str]:
    """Yields the paths of an object and of all objects above it."""
    while path:
        yield path
        path = path.rpartition("/")[0]
    yield "/"


def _is_default(sampling: Any) -> bool:
    kind = sampling.getTimeSamplingType()
    return bool(kind.isUniform() and kind.getTimePerCycle() == 1 and sampling.getSampleTime(0) == 0)


def _slower(sampling: Any, pace: float) -> Any:
    """Returns the sampling with all times multiplied by `pace`."""
    core = library("AbcCoreAbstract")
    kind = sampling.getTimeSamplingType()
    stored = [pace * time for time in sampling.getStoredTimes()]
    if kind.isUniform():
        return core.TimeSampling(pace * kind.getTimePerCycle(), stored[0])
    times = core.TimeVector()
    times[:] = stored
    if kind.isCyclic():
        cycle = core.TimeSamplingType(kind.getNumSamplesPerCycle(), pace * kind.getTimePerCycle())
        return core.TimeSampling(cycle, times)
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)
