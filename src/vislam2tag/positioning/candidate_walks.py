"""Walks of a floor with several possible paths, distinguished by the Wi-Fi that they share and by their compasses.

Each walk is one of its candidates, or none of these. Similar scans of two walks are probably close together, and
compasses agree about the plan's north, which is one unknown of the floor. All combinations of candidates are weighted;
the result for a walk is what the *others* say of it, so that its own evidence does not count twice.

Scans of neighbouring moments share their errors, so there is one vote in :data:`VOTE_M` of way, and votes are
tempered: counting each scan made wrong combinations certain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import i0e

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.radio_scans import RadioScans

VOTE_M = 8.0
ALIKE_M = 7.0
"""Scans count as similar if scans of one walk that are as similar are at most so far apart on average, metres."""
FAR = 2.5
"""A vote costs at most as much as a distance of so many times :data:`ALIKE_M` / 2 (3 nats)."""
VOTE_WEIGHT = 0.25
NONE_SHARE = 0.02
"""Probability that a walk took none of its candidates, at least."""
SHARED_NATS = 1.0
"""Walks share the errors of their plan: what one prefers by less than this, all may prefer wrongly."""
CERTAIN = 0.99
"""A walk with a candidate of this weight has no other."""
COMPASS_CONCENTRATION = 5.25
"""Of von Mises: standard deviation 25 degrees."""
MOST_COMBINATIONS = 300_000
NOT_HEARD_DBM = -100.0


@dataclass(frozen=True)
class CandidateWalk:
    """A walk with ``c`` candidates: ``weight`` (c,), and ``position`` (c, n, 2), metres, at its ``n`` scans (n may be
    0). ``north_rad`` (c,) is ``bcs_R_enu`` by the compass; None if that is unknown, or was used already.
    """

    weight: FloatArray
    position: FloatArray
    scans: RadioScans | None
    north_rad: FloatArray | None

    @property
    def certain(self) -> bool:
        """Whether one candidate is certain."""
        return bool(self.weight.max(initial=0.0) >= CERTAIN)

    @property
    def prior(self) -> FloatArray:
        """(c,) probabilities of the candidates, or (c + 1,) with that of none of them, the last."""
        if self.certain:
            return np.where(self.weight == self.weight.max(), 1.0, 0.0)
        none = max(1 - float(self.weight.sum()), NONE_SHARE)
        behind = np.log(np.maximum(self.weight, 1e-12) / self.weight.max())
        weight = np.exp(np.minimum(behind + SHARED_NATS, 0.0))
        return np.append(weight * (1 - none) / weight.sum(), none)


@dataclass(frozen=True)
class JointCandidates:
    """Joint probabilities of the candidates of some walks: ``weight`` has one axis a walk, in the order of ``walks``
    (w,), indices into all.
    """

    walks: IntArray
    weight: FloatArray
    prior: tuple[FloatArray, ...]

    def marginal(self, axis: int) -> FloatArray:
        """Probabilities of one walk's candidates, and of none of them if it is not certain."""
        others = tuple(other for other in range(self.weight.ndim) if other != axis)
        return np.asarray(self.weight.sum(axis=others))

    def by_others(self, axis: int) -> FloatArray:
        """What the other walks say of one walk's candidates: probabilities with its own evidence divided out."""
        said = self.marginal(axis) / np.maximum(self.prior[axis], 1e-12)
        return np.asarray(said / said.sum())

    def _certain(self, axis: int) -> bool:
        return float(self.marginal(axis).max()) >= CERTAIN

    def settled_by(self, axis: int) -> float:
        """Expected number of walks that are not certain now, and would be if one walk's place were known."""
        own = self.marginal(axis)
        before = sum(self._certain(other) for other in range(self.weight.ndim))
        expected = 0.0
        for number, share in enumerate(own.tolist()):
            if share < NONE_SHARE / 10:
                continue
            given = np.take(self.weight, [number], axis=axis) / share
            known = JointCandidates(self.walks, given, self.prior)
            settled = sum(known._certain(other) for other in range(self.weight.ndim) if other != axis)
            expected += share * (settled + 1)
        return expected - before


def joint_candidates(walks: Sequence[CandidateWalk], sizes: Sequence[int]) -> JointCandidates:
    """Weight all combinations of the candidates of walks (at most :data:`MOST_COMBINATIONS`).

    ``sizes`` are indices into ``walks``: those that are combined, in this order.
    """
    some = [walks[index] for index in sizes]
    prior = tuple(walk.prior for walk in some)
    shape = tuple(len(one) for one in prior)
    total = np.zeros(shape)
    with np.errstate(divide="ignore"):
        for axis, own in enumerate(prior):
            total += _along(np.log(own), (axis,), len(shape))
    limit = alike_limit(some)
    for first in range(len(some)):
        for second in range(first + 1, len(some)):
            votes = pair_votes(some[first], some[second], limit, (shape[first], shape[second]))
            if votes is not None:
                total += _along(votes, (first, second), len(shape))
    total += _compass(some, shape)
    weight = np.exp(total - total.max())
    return JointCandidates(np.asarray(sizes, dtype=np.int64), weight / weight.sum(), prior)


def combined_walks(walks: Sequence[CandidateWalk]) -> list[int]:
    """Indices of the walks that are combined: the most certain ones, as many as can be weighted."""
    sizes = [len(walk.prior) for walk in walks]
    chosen, product = list[int](), 1
    for index in np.argsort(sizes, kind="stable").tolist():
        if len(chosen) < MOST_AXES and product * sizes[index] <= MOST_COMBINATIONS:
            chosen.append(index)
            product *= sizes[index]
    return sorted(chosen)


MOST_AXES = 60
"""NumPy's arrays have at most 64 axes."""


def _along(values: FloatArray, axes: tuple[int, ...], count: int) -> FloatArray:
    """Values over some axes (ascending), to be added to an array of ``count`` axes."""
    shape = [1] * count
    for axis, size in zip(axes, values.shape, strict=True):
        shape[axis] = size
    return values.reshape(shape)


def _levels(scans: RadioScans, columns: dict[str, int]) -> FloatArray:
    """(n, a) levels above the least, with columns of common access points, each scan of length 1."""
    dense = np.asarray(scans.dense(not_heard=NOT_HEARD_DBM), dtype=np.float64) - NOT_HEARD_DBM
    level = np.zeros((len(scans), len(columns)))
    level[:, [columns[name] for name in scans.access_points]] = np.maximum(dense, 0.0)
    return np.asarray(level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9))


def _columns(walks: Sequence[CandidateWalk]) -> dict[str, int]:
    names = sorted({name for walk in walks if walk.scans is not None for name in walk.scans.access_points})
    return {name: column for column, name in enumerate(names)}


def alike_limit(walks: Sequence[CandidateWalk]) -> float:
    """Least likeness (cosine of the levels) of scans that are on average within :data:`ALIKE_M`, from pairs within
    walks, whose distance the tracker knows; infinite if there are none.
    """
    likeness, away_m = [], []
    for walk in walks:
        if walk.scans is None or not len(walk.scans) or not len(walk.weight):
            continue
        level = _levels(walk.scans, _columns([walk]))
        place = walk.position[int(walk.weight.argmax())]
        first, second = np.triu_indices(len(place), 1)
        likeness.append((level @ level.T)[first, second])
        away_m.append(np.linalg.norm(place[first] - place[second], axis=1))
    if not likeness:
        return np.inf
    order = np.argsort(-np.concatenate(likeness))
    mean_m = np.cumsum(np.concatenate(away_m)[order]) / np.arange(1, len(order) + 1)
    enough = np.flatnonzero(mean_m <= ALIKE_M)
    return float(np.concatenate(likeness)[order[enough[-1]]]) if len(enough) else np.inf


def pair_votes(one: CandidateWalk, other: CandidateWalk, limit: float, shape: tuple[int, int]) -> FloatArray | None:
    """Log-likelihoods of pairs of candidates, of the given shape (with none of them), by similar scans; None if none
    are.
    """
    if one.scans is None or other.scans is None or not len(one.scans) or not len(other.scans):
        return None
    columns = _columns([one, other])
    likeness = _levels(one.scans, columns) @ _levels(other.scans, columns).T
    rows, matches = _votes(likeness, one, limit)
    if not len(rows):
        return None
    away = one.position[:, None, rows] - other.position[None][:, :, matches]
    cost = np.minimum(0.5 * (np.linalg.norm(away, axis=3) / (ALIKE_M / 2)) ** 2, 0.5 * FAR**2)
    votes = np.full(shape, -VOTE_WEIGHT * len(rows) * 0.25 * FAR**2)  # none of the candidates: undecided
    votes[: len(one.weight), : len(other.weight)] = -VOTE_WEIGHT * cost.sum(axis=2)
    return votes


def _votes(likeness: FloatArray, walk: CandidateWalk, limit: float) -> tuple[IntArray, IntArray]:
    """Scans (v,) of a walk and their most similar ones (v,) of another, one in :data:`VOTE_M` of way."""
    best = likeness.argmax(axis=1)
    value = likeness[np.arange(len(best)), best]
    path = walk.position[int(walk.weight.argmax())]
    way_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))))
    cell = (way_m // VOTE_M).astype(np.int64)
    rows = [
        int(inside[value[inside].argmax()]) for number in np.unique(cell) for inside in [np.flatnonzero(cell == number)]
    ]
    kept = np.array([row for row in rows if value[row] >= limit], dtype=np.int64)
    return kept, best[kept].astype(np.int64)


def _compass(walks: Sequence[CandidateWalk], shape: tuple[int, ...]) -> FloatArray:
    """Log-likelihood of each combination by how well the compasses agree about north, which is unknown."""
    total = np.zeros(shape, dtype=np.complex128)
    count = np.zeros(shape)
    for axis, walk in enumerate(walks):
        if walk.north_rad is None:
            continue
        said = np.zeros(shape[axis], dtype=np.complex128)
        said[: len(walk.weight)] = np.exp(1j * walk.north_rad)
        total = total + said.reshape(_along(said.real, (axis,), len(shape)).shape)
        count = count + _along(np.abs(said), (axis,), len(shape))
    strength = COMPASS_CONCENTRATION * np.abs(total)
    alone = np.log(i0e(COMPASS_CONCENTRATION)) + COMPASS_CONCENTRATION
    return np.asarray(np.log(i0e(strength)) + strength - count * alone)
