"""A short walk past many places: which places to stop at, and in which order.

Stops are a greedy set cover; their order is the library's nearest-neighbour tour, improved by reversing stretches
(2-opt, Croes 1958) until none helps. NetworkX's annealing found nothing better than its own start on the same
instances.
"""

from __future__ import annotations

import numpy as np
from networkx import from_numpy_array
from networkx.algorithms.approximation import greedy_tsp
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from vislam2tag.core.arrays import FloatArray, IntArray

WALKING_M_S = 1.0
"""Speed of the collectors in the paper (Table III: 0.92 to 0.99 m/s)."""
_EPSILON = 1e-9


def covering_stops(gaps_m: FloatArray, radius_m: float) -> IntArray:
    """Choose of gaps (g, d) some (indices) so that each lies within the radius of one: the widest reach first."""
    reach = cKDTree(gaps_m).query_pairs(radius_m * (1 + _EPSILON), output_type="ndarray")
    own = np.arange(len(gaps_m))
    a, b = np.concatenate([reach, reach[:, ::-1], np.stack([own, own], axis=1)]).T
    reached = csr_array((np.ones(len(a)), (a, b)), shape=(len(own), len(own)))
    left, chosen = np.ones(len(own)), []
    while left.any():
        chosen.append(int(np.argmax(reached @ left)))
        left[reached[[chosen[-1]]].indices] = 0
    return np.array(chosen, dtype=np.int64)


def short_order(length_m: FloatArray, *, free: bool, tries: int = 8) -> IntArray:
    """Order (s,) of a short walk through places this far apart (s, s), metres; the first stays so unless ``free``.

    So many nearest-neighbour tours are tried, which begin at different places.
    """
    if free:
        # A place that is no way from all others stands for the free beginning.
        length_m = np.pad(length_m, ((1, 0), (1, 0)))
    inner = np.arange(1, len(length_m))
    if len(inner) < 2:
        return (inner if free else np.arange(len(length_m))) - int(free)
    graph = from_numpy_array(length_m[1:, 1:])
    firsts = inner[:: -(-len(inner) // tries)] if free else inner[[int(np.argmin(length_m[0, 1:]))]]
    tours = [np.append(0, 1 + np.array(greedy_tsp(graph, source=int(first - 1))[:-1])) for first in firsts]
    best = min((_without_crossings(tour, length_m) for tour in tours), key=lambda tour: _length(tour, length_m))
    return best[1:] - 1 if free else best


def _without_crossings(order: IntArray, length_m: FloatArray) -> IntArray:
    """Reverse the stretch of the order (s,) that shortens the walk most, until none does; the first stays first."""
    while True:
        here, then = order[:-1], order[1:]
        after = np.append(then[1:], -1)
        # Reversing then[i] ... then[j] replaces the steps here[i]-then[i] and then[j]-after[j], where there is one.
        gain = length_m[here, then][:, None] - length_m[here[:, None], then]
        step = np.where(after >= 0, length_m[then, after], 0.0)
        gain = gain + step - np.where(after >= 0, length_m[then[:, None], after], 0.0)
        gain = np.triu(gain)
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] <= _EPSILON:
            return order
        order = np.concatenate([order[: i + 1], order[i + 1 : j + 2][::-1], order[j + 2 :]])


def _length(order: IntArray, length_m: FloatArray) -> float:
    """Metres of a walk in this order (s,) through places this far apart (s, s)."""
    return float(length_m[order[:-1], order[1:]].sum())
