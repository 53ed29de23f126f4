"""Where the tests find data and programs."""

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
"""Times the usual number of examples of what is drawn at random: script/fuzz asks for more."""

# How long an example takes depends on what else the machine does.
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
    """The folder of the compiled programs, as the preset `develop` builds them."""
    folder = Path(os.environ.get("DYNMESH_PROGRAMS", REPOSITORY / "build" / "develop"))
    if not (folder / "dynmesh-complete").exists():
        pytest.skip(
            "dynmesh-complete is not built: cmake --preset develop; cmake --build --preset develop"
        )
    return folder


@pytest.fixture(scope="session")
def shared_library() -> Path:
    """The shared library, as tests/install/run builds it."""
    default = REPOSITORY / "build" / "install-shared-ON" / "libdynmesh.so"
    path = Path(os.environ.get("DYNMESH_LIBRARY", default))
    if not path.exists():
        pytest.skip("the shared library is not built: tests/install/run builds it")
    return path


@pytest.fixture
def hearing_interrupts() -> Iterator[None]:
    """What the test starts hears SIGINT, even if the tests themselves were told to ignore it.

    A process inherits that a signal is ignored, as by nohup, but not that it is handled.
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
    """The same numbers every time."""
    return np.random.default_rng(0)


@pytest.fixture
def shared_pieces() -> Iterator[Callable[[], int]]:
    """How many pieces of work threads other than the caller's have done since the test began.

    Completers that the test makes work in pieces of 64 vertices, and share them where there are two
    or more: every call waits until another thread has come.
    """
    usual = _core._set_sharing(chunk=64, short_chunk=64, fewest_pieces=2, patience=100_000)
    before = _core._pieces_done_by_others()
    yield lambda: _core._pieces_done_by_others() - before
    _core._set_sharing(*usual)
