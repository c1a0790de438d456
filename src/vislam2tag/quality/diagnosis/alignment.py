"""One walk laid onto places on the plan: which of its passes fit, and where the walk puts those that do not.

A walk is turned and shifted as most of its passes say. A pass that fits badly is left out for a price, and the walk is
cut for another where the tracker seems to have slipped, so that neither bends the rest. What remains is the sum of
squared residuals, weighted by their joint covariance along the walk (Baarda's data snooping).

How far the tracker may have drifted from pass to pass follows from its usual noise
(:mod:`vislam2tag.estimation.tracker_errors`) and not from how the walk was mapped: a wrong landmark would have made
that worse.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_AT_ONCE, MAX_DIAGNOSED_PASSES, MAX_PAIRS
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.factors import LinearWalk, Model, sighting_variance
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.tracker_errors import SCALE_SIGMA, STATES, USUAL, VarianceFactors, transitions
from vislam2tag.intake.ids import IdShift
from vislam2tag.site.model import SessionKey


@dataclass(frozen=True)
class WalkPasses:
    """``p`` passes of one walk in the order of time, in the tracker's continuous frame.

    ``landmark`` (p,) ids as logged. ``time_s`` (p,) from the first frame. ``camera`` (p,) complex, metres, where the
    camera was. ``offset`` (p,) complex, metres, from there to the landmark. ``sighting_m2`` (p,) variance per axis of
    each pass. ``drift`` (p - 1, 4, 4) covariances of the drift from pass to pass (states as in
    :mod:`vislam2tag.estimation.tracker_errors`). ``id_shift`` is what to add to the ids, None if nothing.
    """

    key: SessionKey
    landmark: tuple[str, ...]
    time_s: FloatArray
    camera: ComplexArray
    offset: ComplexArray
    sighting_m2: FloatArray
    drift: FloatArray
    id_shift: IdShift | None = None

    @classmethod
    def of(cls, key: SessionKey, observations: WalkObservations, id_shift: IdShift | None = None) -> WalkPasses:
        """Reduce what was observed on a walk."""
        observations = observations.first(MAX_DIAGNOSED_PASSES)
        odometry, passes = observations.odometry, observations.passes
        model = Model(observations, odometry.path, np.ones_like(odometry.path), rough=False)
        even = VarianceFactors.even(USUAL, len(passes.at), len(observations.ids))
        drift = LinearWalk(model, LandmarkPriors.nothing(len(observations.ids)), even).drift_factor
        return cls(
            key=key,
            landmark=tuple(observations.ids[i] for i in passes.landmark),
            time_s=odometry.time_s[passes.at],
            camera=odometry.path[passes.at],
            offset=passes.offset,
            sighting_m2=sighting_variance(model, USUAL),
            drift=drift.covariance[1:-1] if len(passes.at) else np.empty((0, STATES, STATES)),
            id_shift=id_shift,
        )

    @cached_property
    def landmark_number(self) -> IntArray:
        """(p,) equal for passes of one landmark."""
        return np.unique(np.array(self.landmark, dtype=str), return_inverse=True)[1]

    @cached_property
    def place(self) -> ComplexArray:
        """(p,) complex, metres, where the tracker put each landmark."""
        return np.asarray(self.camera + self.offset)

    @cached_property
    def covariance(self) -> FloatArray:
        """(2p, 2p) of x and y of each :attr:`place`, m^2, from the first pass on."""
        count = len(self.camera)
        state = np.zeros((count, count, STATES, STATES))
        if count:
            state[0, 0, 2, 2] = SCALE_SIGMA**2
        here = np.arange(count)
        carry = transitions(self.camera, here[:-1], here[1:])
        for k in range(1, count):
            state[k, :k] = carry[k - 1] @ state[k - 1, :k]
            state[:k, k] = state[k, :k].transpose(0, 2, 1)
            state[k, k] = carry[k - 1] @ state[k - 1, k - 1] @ carry[k - 1].T + self.drift[k - 1]
        sight = np.zeros((count, 2, STATES))
        sight[:, :, :2] = np.eye(2)
        sight[:, :, 2] = as_points(self.offset)
        sight[:, :, 3] = as_points(1j * self.offset)
        total = np.einsum("pis,prst,rjt->pirj", sight, state, sight).reshape(2 * count, 2 * count)
        return np.asarray(total + np.diag(np.repeat(self.sighting_m2, 2)))


LEFT_OUT_PRICE, AGAIN_PRICE = 24.0, 14.0
"""A pass is left out where that lowers the squared residuals by more than this; by less is enough where another pass of
that landmark is: the second one shows less."""
CUT_PRICE = 30.0
"""... and the walk is cut between two passes where that lowers them by more than this."""
LEAST_APART_M = 1.5
"""Two landmarks determine the rotation of a walk if they are this far apart ..."""
SAME_DISTANCE_M, SAME_DISTANCE_SHARE = 0.7, 0.06
"""... and as far apart as the tracker says, within this and this share."""
NEAR_M, NEAR_SHARE = 0.35, 0.035
"""Roughly, a place fits within three times this, and this share of how far it is from the pair that determines the
rotation."""
TRIED = 3
"""So many turns are tried in full."""
FREE_M = 1e3
CUT_TURN_RAD = 0.3
"""A slip leads anywhere, but turns the tracker's map by no more than about this."""
MOST_TURN_RAD = 0.5
"""A step of linearisation turns no further."""
MANY_LEFT_OUT = 3
"""Where so many passes do not fit, the tracker may have slipped amid the walk."""
DIFFERENT_RAD = 0.3
"""Turns closer than this lead to one fit."""
MOST_STEPS = 60
"""Passes left out, taken back and cuts, one a step; more never were needed."""


@dataclass(frozen=True)
class Alignment:
    """A walk of ``p`` passes on the plan, of which those with a finite ``target`` (p,) take part.

    ``turn`` (complex, unit) and ``origin``: the plan's ``origin + turn * place``; ``left_out`` (p,) passes that do not
    fit; ``cuts``: passes before which the walk is cut; ``cost`` of it all.
    """

    walk: WalkPasses
    target: ComplexArray
    turn: complex
    origin: complex
    left_out: BoolArray
    cuts: tuple[int, ...]
    cost: float

    @property
    def fits(self) -> BoolArray:
        """(p,) passes that take part and fit."""
        return np.isfinite(self.target) & ~self.left_out

    def predicted(self, passes: IntArray) -> tuple[ComplexArray, FloatArray]:
        """Where the other passes put some passes (k,): complex metres on the plan, and covariances (k, 2, 2)."""
        others = self.fits.copy()
        others[passes] = False
        target = np.where(others, self.target, np.nan)
        target[passes] = self.origin + self.turn * self.walk.place[passes]
        system = _System(self.walk, target, self.turn, self.origin)
        free = np.isin(system.rows, passes)
        found = system.solved(free, self.cuts)
        place = target[passes] + as_complex(found.shift[np.flatnonzero(free)])
        return place, found.shift_covariance[np.flatnonzero(free)]


def align(walk: WalkPasses, target: ComplexArray, *, anyhow: bool = False) -> Alignment:
    """Lay a walk onto the places (p,) that its passes are said to have, complex metres, NaN where no one says.

    None of them fits where that costs less, unless it is to be laid onto them ``anyhow``, as far as it can be.
    """
    known = np.isfinite(target)
    nothing = Alignment(walk, target, 1 + 0j, 0j, known, (), _price_of_nothing(walk.landmark_number[known]))
    tried = [_from_what_is_near(walk, target, turn, origin) for turn, origin in _turns(walk, target)]
    if tried and min(one.left_out.sum() for one in tried) >= MANY_LEFT_OUT and known.sum() > MANY_LEFT_OUT:
        tried.append(_from_a_cut(min(tried, key=lambda one: one.cost)))
    return min(tried if anyhow and tried else [*tried, nothing], key=lambda one: one.cost)


def left_out_price(landmark: IntArray) -> float:
    """Price of leaving passes of these landmarks (k,) out."""
    different = len(np.unique(landmark))
    return LEFT_OUT_PRICE * different + AGAIN_PRICE * (len(landmark) - different)


def _price_of_nothing(landmark: IntArray) -> float:
    """Price where no place is believed; two landmarks fit onto any two places as far apart, which proves nothing."""
    count = np.bincount(landmark)
    told = np.sort(count[count > 0])[:-2]
    return float(np.sum(LEFT_OUT_PRICE + AGAIN_PRICE * (told - 1)))


def _turns(walk: WalkPasses, target: ComplexArray) -> Iterator[tuple[complex, complex]]:
    """Turns and origins by which most places fit, roughly, the best first; a pair of passes suggests each."""
    rows = np.flatnonzero(np.isfinite(target))
    place, wanted = walk.place[rows], target[rows]
    first, second = _some_pairs(len(rows))
    logged, true = place[second] - place[first], wanted[second] - wanted[first]
    apart = np.minimum(np.abs(logged), np.abs(true))
    alike = np.abs(np.abs(logged) - np.abs(true)) < SAME_DISTANCE_M + SAME_DISTANCE_SHARE * apart
    pairs = np.flatnonzero((apart > LEAST_APART_M) & alike)
    if pairs.size == 0:
        return
    turn = true[pairs] / logged[pairs]
    turn /= np.abs(turn)
    first, second = first[pairs], second[pairs]
    one, other = place[first], place[second]
    origin = (wanted[first] + wanted[second]) / 2 - turn * ((one + other) / 2)
    parts = np.array_split(np.arange(len(pairs)), -(-len(pairs) * len(rows) // MAX_AT_ONCE))
    cost = np.concatenate([_cost(place, wanted, origin[at], turn[at], (one[at], other[at])) for at in parts])
    yielded: list[tuple[complex, complex]] = []
    for pair in np.argsort(cost, kind="stable").tolist():
        candidate = complex(turn[pair]), complex(origin[pair])
        if all(_differs(candidate, earlier, complex(place.mean())) for earlier in yielded):
            yielded.append(candidate)
            yield candidate
        if len(yielded) == TRIED:
            return


def _some_pairs(count: int) -> tuple[IntArray, IntArray]:
    """All pairs of so many passes; evenly some of them where there are more than can be tried."""
    most = int(np.sqrt(2 * MAX_PAIRS))
    rows = np.arange(count) if count <= most else np.linspace(0, count - 1, most).astype(np.int64)
    first, second = np.triu_indices(len(rows), 1)
    return rows[first], rows[second]


def _cost(
    place: ComplexArray, wanted: ComplexArray, origin: ComplexArray, turn: ComplexArray, pair: Sequence[ComplexArray]
) -> FloatArray:
    """How badly all places fit with each origin and turn (q,), which the two places of each ``pair`` (q,) suggest."""
    off = np.abs(origin[:, None] + turn[:, None] * place - wanted)
    near = np.minimum(*(np.abs(place - one[:, None]) for one in pair))
    return np.asarray(np.minimum((off / (NEAR_M + NEAR_SHARE * near)) ** 2, 9.0).sum(axis=1))


def _differs(one: tuple[complex, complex], other: tuple[complex, complex], middle: complex) -> bool:
    moved = one[1] + one[0] * middle - other[1] - other[0] * middle
    return bool(abs(np.angle(one[0] / other[0])) > DIFFERENT_RAD or abs(moved) > LEAST_APART_M)


@dataclass(frozen=True)
class _Solved:
    """``shift`` (k, 2) of every place off its target as the passes that fit say, with ``shift_covariance`` (k, 2, 2).
    ``gain`` (k,) by how much the squared residuals fall when a pass is left out (or would rise were it taken back).
    """

    squares: float
    shift: FloatArray
    shift_covariance: FloatArray
    gain: FloatArray
    frame: FloatArray
    """(3,) by how much to move and turn the walk."""
    worth: FloatArray
    """(2k, 2k) precision once everything that is free has adapted itself."""


class _System:
    """The linear equations of a walk of which ``k`` passes have a target, about one turn and origin."""

    def __init__(self, walk: WalkPasses, target: ComplexArray, turn: complex, origin: complex) -> None:
        self.walk, self.target, self.turn, self.origin = walk, target, turn, origin
        self.rows = np.flatnonzero(np.isfinite(target))
        columns = (2 * self.rows[:, None] + (0, 1)).ravel()
        self._worth = np.linalg.inv(walk.covariance[np.ix_(columns, columns)])
        self._rotate()

    def _rotate(self) -> None:
        """Take residuals and precision to the plan's axes."""
        place = self.turn * self.walk.place[self.rows]
        self.residual = as_points(place + self.origin - self.target[self.rows]).ravel()
        rotation = np.array([[self.turn.real, -self.turn.imag], [self.turn.imag, self.turn.real]])
        count = len(self.rows)
        blocks = self._worth.reshape(count, 2, count, 2)
        self.worth = np.einsum("ai,piqj,bj->paqb", rotation, blocks, rotation).reshape(2 * count, 2 * count)
        self.arm = place - place.mean()
        columns = np.tile(np.eye(2, 3), (count, 1, 1))
        columns[:, :, 2] = as_points(1j * self.arm)
        self.frame = columns.reshape(-1, 3)
        """(2k, 3) by x, y and turn of the walk's frame."""

    def cut_columns(self, before: IntArray | int) -> FloatArray:
        """(..., 2k, 3) of cuts before these passes (...)."""
        moved = self.rows >= np.asarray(before)[..., None]
        return np.asarray(np.repeat(moved, 2, axis=-1)[..., None] * self.frame)

    def moved(self, frame: FloatArray) -> None:
        """Move and turn the walk, and linearise again."""
        turn = float(np.clip(frame[2], -MOST_TURN_RAD, MOST_TURN_RAD))
        place = self.turn * self.walk.place[self.rows]
        middle = complex(place.mean())
        turned = np.exp(1j * turn)
        self.origin = middle + complex(frame[0], frame[1]) + self.origin - turned * middle
        self.turn *= turned
        self._rotate()

    def solved(self, free: BoolArray, cuts: tuple[int, ...]) -> _Solved:
        """Solve with the passes ``free`` (k,) left out, and the walk cut."""
        chosen = np.flatnonzero(np.repeat(free, 2))
        blocks = [self.frame, np.eye(len(self.residual))[:, chosen], *(self.cut_columns(cut) for cut in cuts)]
        design = np.concatenate(blocks, axis=1)
        pull = design.T @ self.worth
        free_numbers = np.full(design.shape[1], FREE_M**-2)
        free_numbers[3 + len(chosen) + 2 :: 3] = CUT_TURN_RAD**-2
        covariance = np.linalg.inv(pull @ design + np.diag(free_numbers))
        gain = covariance @ pull
        worth = self.worth - pull.T @ gain
        solution = gain @ self.residual
        count = len(self.rows)
        weighted = (worth @ self.residual).reshape(count, 2)
        own = worth.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count)] + FREE_M**-2 * np.eye(2)
        spread = np.linalg.inv(own)
        shift = np.einsum("kij,kj->ki", spread, weighted)
        left_out = np.flatnonzero(free)
        for number, row in enumerate(left_out.tolist()):
            at = 3 + 2 * number
            shift[row], spread[row] = solution[at : at + 2], covariance[at : at + 2, at : at + 2]
        change = np.einsum("ki,kij,kj->k", shift, np.linalg.inv(spread), shift)
        squares = float(self.residual @ worth @ self.residual)
        return _Solved(squares, shift, spread, change, -solution[:3], worth)

    def cut_gains(self, solved: _Solved, out: BoolArray) -> dict[int, float]:
        """By how much the squared residuals fall with a cut before each pass that has two kept ones on either side."""
        before = self.rows[~out][2:-1]
        columns = self.cut_columns(before)
        pull = columns.transpose(0, 2, 1) @ solved.worth
        weighted = pull @ self.residual
        free = np.diag([FREE_M**-2, FREE_M**-2, CUT_TURN_RAD**-2])
        solution = np.linalg.solve(pull @ columns + free, weighted[..., None])[..., 0]
        return dict(zip(before.tolist(), (weighted * solution).sum(axis=1).tolist(), strict=True))


def _refined(system: _System, free: BoolArray, cuts: tuple[int, ...]) -> Alignment:
    """Leave out, take back and cut, the most worthwhile first, until nothing lowers the cost."""
    landmark = system.walk.landmark_number[system.rows]
    for _ in range(MOST_STEPS):
        system.moved(system.solved(free, cuts).frame)
        solved = system.solved(free, cuts)
        others = np.bincount(landmark[free], minlength=landmark.max() + 1)[landmark] - free
        price = np.where(others > 0, AGAIN_PRICE, LEFT_OUT_PRICE)
        change = np.where(free, price - solved.gain, solved.gain - price)
        change[~free] = np.where((~free).sum() > 2, change[~free], -np.inf)
        best = int(np.argmax(change))
        cut_gains = system.cut_gains(solved, free)
        cut = max(cut_gains, key=cut_gains.__getitem__, default=0)
        if cut_gains and cut not in cuts and cut_gains[cut] - CUT_PRICE > max(change[best], 0):
            cuts = (*cuts, cut)
        elif change[best] > 1e-6:
            free[best] = not free[best]
        else:
            break
    left_out = np.zeros(len(system.target), dtype=bool)
    left_out[system.rows[free]] = True
    cost = solved.squares + left_out_price(landmark[free]) + CUT_PRICE * len(cuts)
    return Alignment(system.walk, system.target, system.turn, system.origin, left_out, cuts, cost)


def _from_what_is_near(walk: WalkPasses, target: ComplexArray, turn: complex, origin: complex) -> Alignment:
    """Refine from a rough turn and origin, all that is far off left out at first."""
    system = _System(walk, target, turn, origin)
    off = np.abs(as_complex(system.residual.reshape(-1, 2)))
    free = off > 3 * (NEAR_M + NEAR_SHARE * np.abs(system.arm))
    if (~free).sum() < 2:
        free[np.argsort(off)[:2]] = False
    return _refined(system, free, ())


def _from_a_cut(start: Alignment) -> Alignment:
    """Refine from the one cut that fits best with nothing left out: where a tracker slipped amid a walk."""
    system = _System(start.walk, start.target, start.turn, start.origin)
    nothing = np.zeros(len(system.rows), dtype=bool)
    places = system.rows[2:-1].tolist()
    squares = {cut: system.solved(nothing, (cut,)).squares for cut in places}
    return _refined(system, nothing, (min(places, key=squares.__getitem__),))
