"""Properties of eq. 4: translations are exact, rotations are not, and iterations converge."""

import numpy as np

import dynmesh

sea = dynmesh.synth.ocean(2, grid=20)
before, after = sea.vertices.astype(float)
known = np.random.default_rng(0).random(len(before)) < 0.1


def completed(points, **settings):
    """Returns the completed frame."""
    return dynmesh.Completer(sea.faces, before, method="motion", **settings).push(points, known)


k = len(before)
towards_origin = before - [30, 20, 10]
assert np.abs(completed(towards_origin) - towards_origin).max() < 1e-12
turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
assert np.abs(completed(before @ turn) - before @ turn).max() > 0.1

offsets, neighbours = dynmesh.topology.cells(sea.faces, k)
j = np.repeat(np.arange(k), np.diff(offsets))
s = np.zeros((k, k))
s[j, neighbours] = 1 / ((before[j] - before[neighbours]) ** 2).sum(axis=1)
laplacian = np.diag(s.sum(axis=1)) - s
pull = laplacian[np.ix_(~known, known)] @ (after - before)[known]
harmonic = after.copy()
harmonic[~known] = before[~known] - np.linalg.solve(laplacian[np.ix_(~known, ~known)], pull)
for extra in (10, 100, 1000):
    distance = np.abs(completed(after, extra_iterations=extra) - harmonic).max()
    assert distance < 0.05 / extra
