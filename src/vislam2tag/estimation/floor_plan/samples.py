"""Whole paths drawn from the posterior, and the few different ones among them: what a walk may have been."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.estimation.floor_plan.pose_grid import Transition
from vislam2tag.estimation.floor_plan.posterior import ANYWHERE, WalkPosterior
from vislam2tag.estimation.floor_plan.stretches import Stretches

SAMPLES = 200
LIKELIEST = 3000
"""So many poses of a stretch are drawn from, the most probable ones."""
ALIKE_M, UNLIKE_SHARE = 3.0, 0.1
"""Paths are one if at most this share of their stretches is further apart."""


@dataclass(frozen=True)
class PossiblePath:
    """One of the paths that a walk may have taken, with its probability ``weight``: ``place`` (s,) complex, metres, of
    the stretches' middles, and ``yaw_rad`` (s,). ``firm`` (s,) is the share of similar drawn paths that are there.
    """

    weight: float
    place: ComplexArray
    yaw_rad: FloatArray
    firm: FloatArray


def possible_paths(walk: Stretches, posterior: WalkPosterior, most: int) -> tuple[PossiblePath, ...]:
    """The different paths among :data:`SAMPLES` drawn ones, the most probable first, at most this number."""
    place, yaw = _drawn(walk, posterior)
    left = np.arange(len(place))
    found: list[PossiblePath] = []
    while len(left):
        apart = np.abs(place[left][:, None] - place[left]) > ALIKE_M
        alike = apart.mean(axis=2) <= UNLIKE_SHARE
        row = int(np.argmax(alike.sum(axis=1)))
        group = left[alike[row]]
        # The drawn path that is most like the others of its group.
        centre = group[int(np.argmin(np.abs(place[group] - place[group].mean(axis=0)).sum(axis=1)))]
        firm = (np.abs(place[group] - place[centre]) < ALIKE_M).mean(axis=0)
        found.append(PossiblePath(len(group) / SAMPLES, place[centre], yaw[centre], firm))
        left = left[~alike[row]]
    return tuple(sorted(found, key=lambda path: -path.weight))[:most]


LOOSE_NATS = 3.0
"""Cost of asking when a path's own place is not known."""
SAME_PLACE_M = 3.0
"""A tap does not distinguish paths that are closer together there."""


def telling_stretch(paths: Sequence[PossiblePath]) -> int:
    """Number of the stretch at which a known place leaves the fewest possibilities.

    That is the least expected entropy: it cannot distinguish paths that are at the same place then.
    """
    weight = np.array([path.weight for path in paths])
    place = np.stack([path.place for path in paths])  # (paths, s)
    alike = np.abs(place[:, None] - place) < SAME_PLACE_M
    left = np.einsum("j,ijs->is", weight, alike)  # weight of all paths that fit a tap on path i
    loose = 1 - np.stack([path.firm for path in paths])  # a path that is also elsewhere then
    expected = np.einsum("i,is->s", weight, np.log(left) + LOOSE_NATS * loose)
    return int(np.argmin(expected))


def _drawn(walk: Stretches, posterior: WalkPosterior) -> tuple[ComplexArray, FloatArray]:
    """Places (n, s), complex metres, and yaws (n, s) of drawn paths: the last pose first, then each one before it."""
    rng = np.random.default_rng(0)
    grid, count = posterior.grid, len(walk.stretches)
    place, yaw = np.empty((SAMPLES, count), dtype=np.complex128), np.empty((SAMPLES, count))
    poses = posterior.poses[-1]
    chosen = rng.choice(len(poses.cell), SAMPLES, p=poses.weight / poses.weight.sum())
    place[:, -1], yaw[:, -1] = (values[chosen] for values in grid.place(poses.cell))
    for number in range(count - 2, -1, -1):
        ahead = posterior.filtered.poses[number]
        kept = np.argsort(-ahead.weight)[:LIKELIEST]
        here, turn = grid.place(ahead.cell[kept])
        # Equal poses of the next stretch have the same distribution before them.
        key = np.stack((place[:, number + 1].real, place[:, number + 1].imag, yaw[:, number + 1]), axis=1)
        _, first, same = np.unique(key, axis=0, return_index=True, return_inverse=True)
        step = Transition(grid, walk.links[number])
        weight = ahead.weight[kept] * step.density(here, turn, place[first, number + 1], yaw[first, number + 1])
        weight += ANYWHERE / len(kept) * ahead.weight[kept]
        total = np.cumsum(weight, axis=1)
        pick = _picked(total, same.ravel(), rng)
        place[:, number], yaw[:, number] = here[pick], turn[pick]
    return place, wrapped(yaw)


def _picked(total: FloatArray, row: IntArray, rng: np.random.Generator) -> IntArray:
    """Indices (n,) drawn from rows (n,) of running sums (r, k)."""
    drawn = rng.random(len(row)) * total[row, -1]
    picked = [int(np.searchsorted(total[one], value)) for one, value in zip(row.tolist(), drawn.tolist(), strict=True)]
    return np.asarray(np.minimum(np.array(picked, dtype=np.int64), total.shape[1] - 1))
