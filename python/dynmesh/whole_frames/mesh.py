"""What is beside what on a mesh."""

import numpy as np

from .._arrays import Integers, Mask
from .._errors import InputError
from ..topology import cells


class Mesh:
    """The triangles of a mesh, and the vertices beside each vertex."""

    def __init__(self, triangles: Integers, n_vertices: int) -> None:
        if len(triangles) == 0:
            message = "is empty; completion needs the connectivity of the mesh"
            raise InputError(message, argument="faces")
        self.triangles = triangles
        self.offsets, self.neighbours = cells(triangles, n_vertices)
        vertices = np.repeat(np.arange(n_vertices), np.diff(self.offsets))
        self.edges = np.stack([vertices, self.neighbours], axis=1)[vertices < self.neighbours]

    def beside(self, vertices: Integers) -> tuple[Integers, Integers]:
        """The neighbours of some vertices: for each, its place among them and the neighbour."""
        counts = (self.offsets[1:] - self.offsets[:-1])[vertices]
        place = np.repeat(np.arange(len(vertices)), counts)
        within = np.arange(len(place)) - (np.cumsum(counts) - counts)[place]
        return place, self.neighbours[self.offsets[vertices][place] + within]

    def edges_to(self, marked: Mask) -> Integers:
        """(k,) the number of edges to the nearest marked vertex, -1 where none leads to one."""
        distance = np.where(marked, 0, -1)
        reached: Integers = np.flatnonzero(marked)
        while len(reached):
            near = np.unique(self.beside(reached)[1])
            near = near[distance[near] < 0]
            distance[near] = distance[reached[0]] + 1
            reached = near
        return distance

    def components(self) -> Integers:
        """(k,) the smallest vertex of the component of each vertex."""
        smallest = np.arange(len(self.offsets) - 1)
        while True:
            lower = smallest.copy()
            for a, b in (self.edges.T, self.edges.T[::-1]):
                np.minimum.at(lower, smallest[a], smallest[b])
            lower = lower[lower]
            if np.array_equal(lower, smallest):
                return smallest
            smallest = lower

    def pairs_two_edges_apart(self) -> Integers:
        """(p, 2) pairs of vertices that share a neighbour but no edge, each once."""
        k = len(self.offsets) - 1
        place, far = self.beside(self.neighbours)
        near = np.repeat(np.arange(k), np.diff(self.offsets))[place]
        codes = np.unique((near * k + far)[near < far])
        codes = np.setdiff1d(codes, self.edges[:, 0] * k + self.edges[:, 1], assume_unique=True)
        return np.stack(np.divmod(codes, k), axis=1)
