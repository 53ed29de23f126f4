"""The layers of the C++ code: includes go one way."""

import re

import pytest
from conftest import REPOSITORY

SOURCES = REPOSITORY / "cpp" / "src"

MAY_INCLUDE = {
    "support": set[str](),
    "kernels": {"support"},
    "mesh": {"support"},
    "generations": {"support"},
    "factor": {"kernels", "support"},
    "motion": {"generations", "kernels", "support"},
    "detail": {"factor", "mesh", "generations", "kernels", "support"},
    "tracking": {"detail", "factor", "mesh", "generations", "kernels", "support"},
    "disconnected": {"generations", "support"},
    "stream": {"mesh", "disconnected", "generations", "kernels", "support"},
    "completer": {"stream", "mesh", "motion", "detail", "disconnected", "generations", "support"},
    "scans": {"stream", "tracking", "support"},
    "registration": {
        "scans",
        "stream",
        "tracking",
        "detail",
        "mesh",
        "disconnected",
        "generations",
        "kernels",
        "support",
    },
    "tracker": {"registration", "scans", "stream", "mesh", "tracking", "support"},
    "whole_frame": {
        "stream",
        "factor",
        "mesh",
        "disconnected",
        "generations",
        "support",
    },
    "evaluation": {"support"},
    "c": {"stream", "support"},
}
"""What each folder may include beside itself and the public headers."""


def test_every_folder_is_a_layer() -> None:
    assert {path.name for path in SOURCES.iterdir()} == set(MAY_INCLUDE)


@pytest.mark.parametrize("layer", MAY_INCLUDE)
def test_a_layer_includes_only_layers_before_it(layer: str) -> None:
    files = list((SOURCES / layer).iterdir())
    assert files
    for file in files:
        for folder in re.findall(r'^#include "(\w+)/', file.read_text(), flags=re.MULTILINE):
            assert folder == layer or folder in MAY_INCLUDE[layer], f"{file.name}: {folder}"


def test_public_headers_need_the_standard_library_only() -> None:
    for header in (REPOSITORY / "cpp" / "include" / "dynmesh").iterdir():
        assert not re.findall(r'^#include "', header.read_text(), flags=re.MULTILINE), header.name


def test_only_the_mesh_layer_includes_openmesh() -> None:
    including = {
        path.parent.name for path in SOURCES.rglob("*.?pp") if "<OpenMesh/" in path.read_text()
    }
    assert including == {"mesh"}
