"""Comparing sequences."""

import numpy as np

import dynmesh


def assert_same(one: dynmesh.Sequence, other: dynmesh.Sequence, *names: str) -> None:
    for name in ("vertices", "faces", *names):
        left, right = getattr(one, name), getattr(other, name)
        if isinstance(left, np.ndarray):
            assert right.dtype == left.dtype, name
            np.testing.assert_array_equal(right, left, err_msg=name)
        else:
            assert right == left, name


HISTORY = ("known", "generation", "age")
