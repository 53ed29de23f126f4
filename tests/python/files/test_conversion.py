"""Conversion to other axes and units, of sequences and point clouds, which replace older ones."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from sequences import sea

import dynmesh

FIRST = 1001
ABOUT: Any = {"start": FIRST, "fps": 24.0, "up_axis": "z", "metres_per_unit": 0.01}
SCALED = sea(10, **ABOUT)
HOLED = sea(10, share=0.6, whole=[0, 2], **ABOUT)


@pytest.mark.parametrize(("one", "other"), list(product("xyz", "xyz")))
def test_a_turn_takes_one_axis_to_the_other(one: Any, other: Any) -> None:
    made = dynmesh.read(dynmesh.convert(replace(SCALED, up_axis=one), to_up=other))
    assert made.up_axis == other
    a, b = "xyz".index(one), "xyz".index(other)
    np.testing.assert_array_equal(made.vertices[..., b], SCALED.vertices[..., a])
    # A rotation keeps distances, and which side of a triangle is its front.
    frame, turned = (s.vertices[3][SCALED.faces[0]].astype(float) for s in (SCALED, made))
    before, after = (np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (frame, turned))
    np.testing.assert_allclose(after, before, rtol=1e-6)
    assert np.linalg.det(turned) == pytest.approx(np.linalg.det(frame))
    back = dynmesh.read(dynmesh.convert(made, to_up=one))
    np.testing.assert_array_equal(back.vertices, SCALED.vertices)


def test_units_and_scale() -> None:
    made = dynmesh.read(dynmesh.complete(HOLED, uncertainty=True))
    inches = dynmesh.read(dynmesh.convert(made, to_unit="inch", scale=2))
    assert inches.metres_per_unit == 0.0254
    factor = 2 * 0.01 / 0.0254
    np.testing.assert_allclose(inches.vertices, factor * made.vertices, rtol=1e-6)
    assert inches.standard_error is not None
    assert made.standard_error is not None
    np.testing.assert_allclose(inches.standard_error, factor * made.standard_error, rtol=1e-6)
    np.testing.assert_array_equal(inches.age, made.age)
    with pytest.raises(ValueError, match=r"scale: .*float32"):
        dynmesh.read(dynmesh.convert(made, scale=1e38))
