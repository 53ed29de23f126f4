"""HDF5 files that refer to others: which references are followed, and which are refused."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynmesh

h5py = pytest.importorskip("h5py", reason="h5py is not installed")

N, K = 3, 4
VERTICES = np.random.default_rng(0).random((N, K, 3)).astype(np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """The folder of the file that is read, beside a secret file."""
    folder = tmp_path / "own"
    (folder / "parts").mkdir(parents=True)
    for place in (tmp_path / "secret.h5", folder / "part.h5", folder / "parts" / "part.h5"):
        with h5py.File(place, "w") as file:
            file["deep/vertices"] = VERTICES
            file["link"] = h5py.SoftLink("/deep/vertices")
    VERTICES.tofile(tmp_path / "secret.bin")
    VERTICES.tofile(folder / "part.bin")
    return folder


Make = Callable[[Any, Path], None]


def external(file: str, path: str = "/deep/vertices") -> Make:
    return lambda h5, own: h5.__setitem__("vertices", h5py.ExternalLink(absolute(file, own), path))


def virtual(file: str, path: str = "/deep/vertices") -> Make:
    def make(h5: Any, own: Path) -> None:
        layout = h5py.VirtualLayout(VERTICES.shape, "f4")
        for i in range(N):
            source = h5py.VirtualSource(absolute(file, own), path, VERTICES.shape)
            layout[i] = source[i]
        h5.create_virtual_dataset("vertices", layout)

    return make


def raw(file: str) -> Make:
    def make(h5: Any, own: Path) -> None:
        places = [(absolute(file, own), 0, VERTICES.nbytes)]
        h5.create_dataset("vertices", VERTICES.shape, "f4", external=places)

    return make


def absolute(file: str, own: Path) -> str:
    return file.replace("OWN", str(own))


def soft_to_nested(file: str) -> Make:
    """Adds a link to a dataset in a group, which is a link to another file."""

    def make(h5: Any, own: Path) -> None:
        h5["scene/mesh"] = h5py.ExternalLink(absolute(file, own), "/deep")
        h5["vertices"] = h5py.SoftLink("/scene/mesh/vertices")

    return make


def in_part(make: Make, then: Make) -> Make:
    """Adds a reference to a file that itself refers to another one."""

    def both(h5: Any, own: Path) -> None:
        with h5py.File(own / "parts" / "between.h5", "w") as between:
            make(between, own)
        then(h5, own)

    return both


def written(own: Path, make: Make) -> Path:
    path = own / "a.h5"
    with h5py.File(path, "w") as file:
        file["faces"] = FACES
        make(file, own)
    return path


def pattern(h5: Any, own: Path) -> None:  # noqa: ARG001
    """Adds virtual sources with numbered names."""
    shape = (N, K, 3)
    part = h5py.h5s.create_simple((K, 3))
    space = h5py.h5s.create_simple(shape, (h5py.h5s.UNLIMITED, K, 3))
    space.select_hyperslab((0, 0, 0), (h5py.h5s.UNLIMITED, 1, 1), block=(1, K, 3))
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_layout(h5py.h5d.VIRTUAL)
    plist.set_virtual(space, b"../secret-%b.h5", b"/deep/vertices", part)
    whole = h5py.h5s.create_simple(shape, (h5py.h5s.UNLIMITED, K, 3))
    h5py.h5d.create(h5.id, b"vertices", h5py.h5t.IEEE_F32LE, whole, plist)


@pytest.mark.parametrize(
    "make",
    [
        external("part.h5"),
        external("./parts/../part.h5", "/link"),
        external("OWN/parts/part.h5"),
        virtual("part.h5"),
        virtual("parts/part.h5", "/link"),
        virtual("OWN/part.h5", "deep/vertices"),
        soft_to_nested("parts/part.h5"),
        in_part(external("part.h5"), external("parts/between.h5", "/vertices")),
        in_part(virtual("part.h5"), virtual("parts/between.h5", "/vertices")),
        in_part(external("../part.h5"), virtual("parts/between.h5", "/vertices")),
    ],
)
def test_links_within_the_folder_are_followed(own: Path, make: Make) -> None:
    path = written(own, make)
    np.testing.assert_array_equal(dynmesh.read(path).vertices, VERTICES)
    with dynmesh.open(path) as reader:
        assert len(reader.files) >= 2
        assert {file.resolve() for file in reader.files} <= set(own.rglob("*.h5"))
        with pytest.raises(ValueError, match="is the input"):
            dynmesh.complete_file(path, reader.files[-1], overwrite=True)


def test_a_virtual_dataset_of_its_own_file_is_followed(own: Path) -> None:
    def make(h5: Any, folder: Path) -> None:
        h5["deep/vertices"] = VERTICES
        virtual(".")(h5, folder)

    np.testing.assert_array_equal(dynmesh.read(written(own, make)).vertices, VERTICES)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (raw("../secret.bin"), "vertices: .*secret.bin.* which is not read"),
        (raw("part.bin"), "vertices: .*part.bin.* which is not read"),
        (external("../secret.h5"), r"vertices: .*'\.\./secret.h5'.* outside of the folder"),
        (external("OWN/../secret.h5"), r"vertices: .*secret.h5'.* outside of the folder"),
        (external("parts/../../secret.h5"), r"vertices: .*secret.h5'.* outside of the folder"),
        (external("symbolic.h5"), r"vertices: .*'symbolic.h5'.* outside of the folder"),
        (external("inside.h5"), r"vertices: .*'inside.h5'.* a symbolic link"),
        (external("elsewhere/secret.h5"), r"vertices: .*'elsewhere/s.* outside of the folder"),
        (virtual("../secret.h5"), r"vertices: .*'\.\./secret.h5'.* outside of the folder"),
        (pattern, r"vertices: has its data in files with the pattern '\.\./secret-%b.h5'"),
        (soft_to_nested("../secret.h5"), r"vertices: .*'\.\./secret.h5'.* outside of the folder"),
        (
            in_part(raw("../../secret.bin"), external("parts/between.h5", "/vertices")),
            "vertices: .*secret.bin.* which is not read",
        ),
        (
            in_part(external("../../secret.h5"), virtual("parts/between.h5", "/vertices")),
            "vertices: .*secret.h5.* outside of the folder",
        ),
        (
            in_part(virtual("../../secret.h5"), external("parts/between.h5", "/vertices")),
            "vertices: .*secret.h5.* outside of the folder",
        ),
        # HDF5 would look for it in the current folder
        (external("secret.h5"), "vertices: .*'secret.h5'.* does not exist in that folder"),
        (virtual("broken.h5"), "cannot be read as HDF5"),
        (external("pipe.h5"), "vertices: .*'pipe.h5'.* does not exist in that folder"),
        (
            external("part.h5", "/nothing"),
            "vertices: leads to '/nothing' in part.h5, which does not exist",
        ),
        (external("part.h5", "/deep"), "vertices: must be a dataset, not a group"),
        (external("a.h5", "/vertices"), "vertices: leads in a circle"),
        (virtual("a.h5", "/vertices"), "vertices: leads in a circle"),
        (
            lambda h5, _: h5.__setitem__("vertices", h5py.SoftLink("vertices")),
            "vertices: leads in a circle",
        ),
        (
            lambda h5, _: h5.__setitem__("vertices", h5py.SoftLink("/no")),
            "vertices: leads to '/no' in a.h5, which",
        ),
    ],
)
def test_links_to_other_places_are_refused(
    own: Path, make: Make, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (own / "symbolic.h5").symlink_to("../secret.h5")
    (own / "inside.h5").symlink_to("parts/part.h5")
    (own / "elsewhere").symlink_to("..")
    (own / "broken.h5").write_bytes(b"no HDF5")
    (own.parent / "broken.h5").write_bytes((own.parent / "secret.h5").read_bytes())
    os.mkfifo(own / "pipe.h5")
    path = written(own, make)
    monkeypatch.chdir(own.parent)
    for place in (path, path.relative_to(own.parent)):
        with pytest.raises(ValueError, match=message) as caught:
            dynmesh.read(place)
        assert str(caught.value).startswith(f"{place}: ")
        assert "\n" not in str(caught.value)


def test_unused_links_are_not_opened(own: Path) -> None:
    """Existence of a name is checked without following its link."""

    def make(h5: Any, _: Path) -> None:
        h5["vertices"] = VERTICES
        h5["camera"] = h5py.ExternalLink("../secret.h5", "/camera")
        h5["mesh/vertices"] = h5py.ExternalLink("../secret.h5", "/deep/vertices")

    np.testing.assert_array_equal(dynmesh.read(written(own, make)).vertices, VERTICES)


def test_the_folder_is_that_of_the_resolved_path(own: Path) -> None:
    path = written(own, external("part.h5"))
    (own.parent / "link.h5").symlink_to(path)
    np.testing.assert_array_equal(dynmesh.read(own.parent / "link.h5").vertices, VERTICES)
