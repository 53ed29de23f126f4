"""The file of the cameras: what is written comes back, and anything else is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import given, settings
from hypothesis import strategies as st
from scan_files import a_rig

from dynmesh._errors import DynmeshError
from dynmesh.scans import Rig, ScanCamera, read_cameras, write_cameras


@pytest.mark.parametrize("unit", [None, 1.0, 0.01, 0.001, 0.0254])
def test_cameras_come_back(tmp_path: Path, unit: float | None) -> None:
    rig = a_rig(3, unit=unit)
    bare = ScanCamera("bare", rig.cameras[0].camera_to_world)
    write_cameras(tmp_path / "c.json", Rig((*rig.cameras, bare), unit))
    found = read_cameras(tmp_path / "c.json")
    assert found.metres_per_unit == unit
    for ours, theirs in zip((*rig.cameras, bare), found.cameras, strict=True):
        assert (ours.name, ours.depth_scale, ours.size) == (
            theirs.name, theirs.depth_scale, theirs.size
        )  # fmt: skip
        np.testing.assert_array_equal(ours.camera_to_world, theirs.camera_to_world)
        if ours.intrinsics is not None:
            np.testing.assert_array_equal(ours.intrinsics, np.asarray(theirs.intrinsics))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["unit", "cameras", "name", "camera_to_world", "intrinsics", "depth_scale", "x"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(JSON)
@settings(max_examples=60 * LONGER)
def test_any_json_is_refused_as_cameras(
    tmp_path_factory: pytest.TempPathFactory, found: Any
) -> None:
    file = tmp_path_factory.getbasetemp() / "cameras.json"
    file.write_text(json.dumps(found))
    with pytest.raises(DynmeshError, match=r"cameras\.json: "):
        read_cameras(file)


@given(st.data())
@settings(max_examples=100 * LONGER)
def test_a_changed_field_of_a_camera_is_refused_or_kept(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    file = tmp_path_factory.getbasetemp() / "changed.json"
    write_cameras(file, a_rig(1))
    told = json.loads(file.read_text())
    camera = told["cameras"][0]
    name = data.draw(st.sampled_from(sorted(camera)))
    value = data.draw(JSON)
    camera[name] = value
    file.write_text(json.dumps(told))
    try:
        (read,) = read_cameras(file).cameras
    except DynmeshError as error:
        found = str(error)
    else:
        kept = {"name": read.name, "depth_scale": read.depth_scale}
        kept |= dict(zip(("width", "height"), read.size or (), strict=False))
        assert kept[name] == value
        return
    assert f"camera 0: {name}: " in found
