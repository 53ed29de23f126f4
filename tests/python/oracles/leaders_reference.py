"""Which components of a mesh others move with, in NumPy, slow and simple, for comparison."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from reference import Array, Edges, best_rotations, components, mean_edge, order_of, rigid_motion


class Share(NamedTuple):
    """What leads a component with others: its vertices beside it, with weights, and its share."""

    vertices: NDArray[np.int64]
    weights: Array
    measured: list[int]
    trust: float
    share: float


class Lead(NamedTuple):
    """A component moves as others do."""

    follower: int
    shares: list[Share]

    @property
    def vertices(self) -> NDArray[np.int64]:
        return np.concatenate([one.vertices for one in self.shares])

    @property
    def weights(self) -> Array:
        return np.concatenate([one.share * one.weights for one in self.shares])


class Pair(NamedTuple):
    """How near each is to the other, places (n, 2) with weights, and vertices that are measured."""

    nearness: Array
    places: NDArray[np.int64]
    weights: Array
    measured: list[list[int]]


def spread(vertices: list[int], n: int, frame: Array) -> list[int]:
    """At most n of the vertices, each the farthest from those before it."""
    if len(vertices) <= n:
        return vertices
    chosen = vertices[:1]
    while len(chosen) < n:
        apart = np.linalg.norm(frame[vertices][:, None] - frame[chosen], axis=2).min(axis=1)
        chosen.append(vertices[int(apart.argmax())])
    return chosen


class Leaders:
    """Pairs of components, and how far they departed."""

    def __init__(self, edges: Edges, frame: Array) -> None:
        self.frame, self.h = frame, mean_edge(edges, frame)
        self.label = components(edges, len(frame))
        order = order_of(edges, frame)
        self.parts = list(dict.fromkeys(self.label[order].tolist()))
        found: dict[tuple[int, int], dict[int, tuple[float, NDArray[np.int64]]]] = {}
        for part in self.parts:
            own = order[self.label[order] == part]
            for other, nearness, places in self._beside(own, order):
                first = part if self.parts.index(part) < self.parts.index(other) else other
                key = (first, other if first == part else part)
                places = places if first == part else places[:, ::-1]
                found.setdefault(key, {})[part] = (nearness, places)
        self.pairs = {key: self._pair(key, sides) for key, sides in found.items()}
        self.departures = dict.fromkeys(self.pairs, 0.0)

    def _beside(
        self, own: NDArray[np.int64], order: NDArray[np.int64]
    ) -> list[tuple[int, float, NDArray[np.int64]]]:
        """The components beside one, how near it is to them, and its and their vertices."""
        others = [part for part in self.parts if part != self.label[own[0]]]
        most = min(len(others), max(2, min(32, 32768 // len(self.parts))))
        samples = spread(own.tolist(), 32, self.frame)
        found: dict[int, list[tuple[float, int, int]]] = {}
        for v in samples:
            nearest = []
            for part in others:
                members = order[self.label[order] == part]
                apart = np.linalg.norm(self.frame[members] - self.frame[v], axis=1) / self.h
                nearest.append((float(apart.min()), part, int(members[apart.argmin()])))
            for distance, part, vertex in sorted(nearest)[:most]:
                found.setdefault(part, []).append((1 / (1 + distance**2), v, vertex))
        result = []
        for part in sorted(found, key=self.parts.index):
            weights, *places = zip(*found[part], strict=True)
            result.append((part, sum(weights) / len(samples), np.array(places).T))
        return sorted(result, key=lambda beside: -beside[1])[:most]

    def _pair(
        self, key: tuple[int, int], sides: dict[int, tuple[float, NDArray[np.int64]]]
    ) -> Pair:
        nearness = np.array([sides[part][0] if part in sides else 0.0 for part in key])
        places = np.concatenate([sides[part][1] for part in self.parts if part in sides])
        apart = np.linalg.norm(self.frame[places[:, 0]] - self.frame[places[:, 1]], axis=1) / self.h
        order = np.argsort(apart, kind="stable")
        near = order[: max(int((apart <= apart.min() + 1.5).sum()), 4)]
        measured = [spread(list(dict.fromkeys(v)), 4, self.frame) for v in places[near].T.tolist()]
        return Pair(nearness, places, 1 / (1 + apart**2), measured)

    def learn(self, frame: Array, known: NDArray[np.bool_]) -> None:
        """Remembers how far components that are seen are from where they were to each other."""
        seen = set(self.label[known].tolist())
        for (a, b), pair in self.pairs.items():
            if {a, b} <= seen:
                i, j = pair.measured
                was, now = (
                    np.linalg.norm(x[i][:, None] - x[j], axis=2) for x in (self.frame, frame)
                )
                found = float((((now - was) / self.h) ** 2).mean())
                self.departures[a, b] = max(0.9 * self.departures[a, b], found)

    def _weights(self) -> Iterator[tuple[int, int, float, Pair, int]]:
        for (a, b), pair in self.pairs.items():
            far = (1 + self.departures[a, b] / 0.25) ** 2
            for side, (follower, leader) in enumerate(((a, b), (b, a))):
                near = pair.nearness[side] + 0.1 * pair.nearness[1 - side]
                yield follower, leader, near / far, pair, 1 - side

    def find(self, may_lead: set[int], previous: Array) -> list[Lead]:
        """Leads all components that do not lead themselves, as far as there is a way."""
        best: dict[int, tuple[float, int]] = {}
        for _ in self.parts:
            for follower, leader, weight, *_ in self._weights():
                if follower in may_lead or (leader not in may_lead and leader not in best):
                    continue
                trust = weight if leader in may_lead else 0.1 * weight * best[leader][0]
                last, rank = best.get(follower, (0.0, 0))
                here = self.parts.index(leader)
                is_equal = abs(trust - last) <= 1e-9 * trust
                if here < rank if is_equal else trust > last:
                    best[follower] = (trust, here)
        leads = {part: Lead(part, []) for part in sorted(best, key=lambda part: -best[part][0])}
        for follower, leader, weight, pair, side in self._weights():
            if follower not in best:
                continue
            if leader in may_lead:
                share = weight / best[follower][0]
            elif leader in best and best[leader][0] > best[follower][0]:
                share = 0.1 * weight * best[leader][0] / best[follower][0]
            else:
                continue
            beside = Share(pair.places[:, side], pair.weights, pair.measured[side], share, share)
            leads[follower].shares.append(beside)
        return [self.agreed(lead, previous) for lead in leads.values()]

    def agreed(self, lead: Lead, frame: Array) -> Lead:
        """Lowers the shares of what moved otherwise since frame 0 than others."""
        shares = [one for one in lead.shares if one.share >= 0.15]
        shares = [one._replace(trust=one.share) for one in shares]
        for _ in range(5 if len(shares) > 1 else 0):
            v = np.concatenate([one.measured for one in shares])
            w = np.concatenate(
                [[one.share / len(one.measured)] * len(one.measured) for one in shares]
            )
            w /= w.sum()
            before, after = self.frame[v] / self.h, frame[v] / self.h
            p, q = before - w @ before, after - w @ after
            covariance = (w[:, None] * q).T @ p
            spread = np.linalg.svd(covariance)[1]
            is_line = spread[1] <= 1e-10 * spread[0]
            turn = np.eye(3) if is_line else best_rotations(covariance[None])[0]
            off = ((p @ turn.T - q) ** 2).sum(axis=1)
            ends = np.cumsum([0, *(len(one.measured) for one in shares)])
            squares = [off[a:b].mean() for a, b in itertools.pairwise(ends)]
            found = [
                one.trust / (1 + square / (0.25 + min(squares))) ** 2
                for one, square in zip(shares, squares, strict=True)
            ]
            shares = [
                one._replace(share=share / max(found))
                for one, share in zip(shares, found, strict=True)
            ]
        return Lead(lead.follower, shares)

    def follow(self, previous: Array, completed: Array, known: NDArray[np.bool_]) -> Array:
        """Moves the components without known vertices of a frame of method motion."""
        result = completed.copy()
        counts = {part: int(known[self.label == part].sum()) for part in self.parts}
        missing = [part for part in self.parts if counts[part] == 0]
        if not known.any():
            return result
        for part in missing:
            own = self.label == part
            result[own] = rigid_motion(previous[known], completed[known], previous[own])
        for found in self.find({part for part in self.parts if counts[part] >= 4}, previous):
            if counts[found.follower] == 0:
                lead = self.agreed(found, result)
                own, w = self.label == lead.follower, lead.weights / lead.weights.sum()
                before, after = previous[lead.vertices], result[lead.vertices]
                p, q = before - w @ before, after - w @ after
                covariance = (w[:, None] * q).T @ p
                across = np.linalg.svd(covariance)[1][1]
                turn = np.eye(3)
                if across > (0.1 * self.h) ** 2:
                    turn = best_rotations(covariance[None])[0]
                result[own] = (previous[own] - w @ before) @ turn.T + w @ after
        return result
