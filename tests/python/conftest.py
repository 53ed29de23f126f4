"""Locations of data and programs, and common fixtures."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from meshes import Mesh, sheet

from dynmesh import _core

REPOSITORY = Path(__file__).parents[2]

LONGER = int(os.environ.get("DYNMESH_FUZZ", "1"))
"""Factor for the number of random examples, which script/fuzz increases."""

# The time of an example depends on the load of the machine, so there is no deadline.
settings.register_profile("dynmesh", deadline=None)
settings.load_profile("dynmesh")


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of recorded sequences, which are not part of the project."""
    folder = Path(os.environ.get("DYNMESH_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("the recorded sequences are not here; DYNMESH_DATA names their folder")
    return folder


@pytest.fixture(scope="session")
def programs() -> Path:
    """The folder of the compiled programs, built with the preset `develop`."""
    folder = Path(os.environ.get("DYNMESH_PROGRAMS", REPOSITORY / "build" / "develop"))
    if not (folder / "dynmesh-complete").exists():
        pytest.skip(
            "dynmesh-complete is not built: cmake --preset develop; cmake --build --preset develop"
        )
    return folder


@pytest.fixture(scope="session")
def shared_library() -> Path:
    """The shared library, built by tests/install/run."""
    default = REPOSITORY / "build" / "install-shared-ON" / "libdynmesh.so"
    path = Path(os.environ.get("DYNMESH_LIBRARY", default))
    if not path.exists():
        pytest.skip("the shared library is not built: tests/install/run builds it")
    return path


@pytest.fixture
def hearing_interrupts() -> Iterator[None]:
    """Child processes receive SIGINT, even if the tests themselves were started with it ignored.

    Child processes inherit that a signal is ignored, for example by nohup, but not handlers.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def mesh() -> Mesh:
    """A small sheet."""
    return sheet(7)


@pytest.fixture
def rng() -> np.random.Generator:
    """A random generator with a fixed seed."""
    return np.random.default_rng(0)


@pytest.fixture
def shared_pieces() -> Iterator[Callable[[], int]]:
    """Returns the number of pieces of work that other threads have done since the test began.

    Completers in the test work in pieces of 64 vertices, and share them if there are two or more.
    Every call waits until another thread takes part.
    """
    usual = _core._set_sharing(chunk=64, short_chunk=64, fewest_pieces=2, patience=100_000)
    before = _core._pieces_done_by_others()
    yield lambda: _core._pieces_done_by_others() - before
    _core._set_sharing(*usual)
