"""Method motion of the paper in NumPy, compared with the library."""

import numpy as np

import dynmesh

sea = dynmesh.synth.ocean(2, grid=20)
before, after = sea.vertices.astype(float)
known = np.random.default_rng(0).random(len(before)) < 0.1
offsets, neighbours = dynmesh.topology.cells(sea.faces, len(before))


def complete(previous, points, known, revisit):
    """Returns the completed frame."""
    generation = np.where(known, 0, -1)
    motion = np.where(known[:, None], points - previous, 0)
    t = 0
    while (generation < 0).any():  # the sheet is in one piece: nothing is disconnected
        t += 1
        g, d = generation.copy(), motion.copy()
        for j in np.flatnonzero(~known if revisit else g < 0):
            i = neighbours[offsets[j] : offsets[j + 1]]
            i = i[g[i] >= 0]  # known before this iteration
            if len(i) > 0:
                weight = (t - g[i]) / ((previous[i] - previous[j]) ** 2).sum(axis=1)
                motion[j] = weight @ d[i] / weight.sum()  # eq. 4
                generation[j] = t if g[j] < 0 else g[j]
    return previous + motion  # eq. 3


for revisit in (True, False):
    ours = dynmesh.Completer(sea.faces, before, revisit=revisit, method="motion").push(after, known)
    assert np.abs(ours - complete(before, after, known, revisit)).max() < 1e-12
