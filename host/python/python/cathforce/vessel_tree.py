"""Ways through the branches of a vessel."""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from typing import Any

import numpy as np

from .errors import UsageError


class VesselTree:
    """Stations of all branches of a centre line, joined where one branch leaves another.

    ``positions_m``: (stations, 3) [m]; ``radii_m``: (stations,) [m]; ``branch``: name of each station's branch.
    """

    def __init__(self, centreline: Mapping[str, Any]) -> None:
        if not centreline:
            raise UsageError(
                "the bundle has no centreline.csv, and targets lie on the centre line\n  fix: add it to the bundle"
            )
        arrays = {name: np.asarray(of, dtype=float) for name, of in centreline.items()}
        self.branch = [name for name, of in arrays.items() for _ in of]
        stations = np.concatenate(list(arrays.values()))
        self.arc_m = stations[:, 0]
        self.positions_m = stations[:, 1:4]
        self.radii_m = stations[:, 4]
        self._neighbours: list[list[tuple[int, float]]] = [[] for _ in stations]
        spans: dict[str, range] = {}
        begin = 0
        for name, of in arrays.items():
            spans[name] = range(begin, begin + len(of))
            begin += len(of)
            for i in spans[name][:-1]:
                self._join(i, i + 1)
        self._join_branches(spans)

    def _join_branches(self, spans: Mapping[str, range]) -> None:
        """An end of each branch at the nearest station of another one, the closest pairs first, as a tree."""
        pairs = []
        for name, span in spans.items():
            for other, others in spans.items():
                if other != name:
                    ends = ((self._nearest(end, list(others)), end) for end in (span[0], span[-1]))
                    at, end = min(ends, key=lambda pair: self._distance_m(*pair))
                    pairs.append((self._distance_m(at, end), name, other, at, end))
        joined = {name: {name} for name in spans}
        for _, name, other, at, end in sorted(pairs):
            if joined[name] is not joined[other]:
                self._join(at, end)
                joined[name] |= joined[other]
                for member in joined[name]:
                    joined[member] = joined[name]

    def _distance_m(self, a: int, b: int) -> float:
        return float(np.linalg.norm(self.positions_m[a] - self.positions_m[b]))

    def _nearest(self, station: int, others: list[int]) -> int:
        apart = self.positions_m[others] - self.positions_m[station]
        return others[int(np.argmin((apart**2).sum(axis=1)))]

    def _join(self, a: int, b: int) -> None:
        distance_m = self._distance_m(a, b)
        self._neighbours[a].append((b, distance_m))
        self._neighbours[b].append((a, distance_m))

    def ways_m(self, goal: int) -> tuple[np.ndarray, np.ndarray]:
        """Length of the way from every station to one of them, (stations,) [m], and its direction, (stations, 3)."""
        ways = np.full(len(self.branch), np.inf)
        towards = np.zeros_like(self.positions_m)
        ways[goal] = 0.0
        queue = [(0.0, goal)]
        while queue:
            way, at = heapq.heappop(queue)
            if way > ways[at]:
                continue
            for other, step in self._neighbours[at]:
                if way + step < ways[other]:
                    ways[other] = way + step
                    along = self.positions_m[at] - self.positions_m[other]
                    towards[other] = along / max(step, 1e-12)
                    heapq.heappush(queue, (way + step, other))
        return ways, towards

    def stations_at(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest station to each point, (n,), and its distance (n,) [m]. ``points_m``: (n, 3)."""
        apart = points_m[:, None, :] - self.positions_m[None, :, :]
        squared = (apart**2).sum(axis=2)
        nearest = squared.argmin(axis=1)
        return nearest, np.sqrt(squared[np.arange(len(points_m)), nearest])
