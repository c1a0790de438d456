"""The least-squares problem of a walk, linearised: unknown at each node are position, scale, heading and offset.

``z[k+1] = z[k] + exp(s[k] + i (h[k] + o[k])) u[k] + noise``, with ``u`` the sensors' motion between nodes, ``s`` the
logarithm of the walker's scale, which begins near 0 and wanders, ``h`` the heading of the gyroscope's frame, which
drifts, and ``o`` how far the walker goes beside where the phone points: a body and a phone do not turn as one, but soon
they agree again. Fixes tie ``z``, the phone's own heading ties ``h`` loosely, and walls keep ``z`` away. These, and
where ``s`` begins, have Student-t tails: few walkers differ much from those of whom the speed was learned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.orientation import wrapped
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.chain import NormalEquations
from vislam2tag.estimation.dead_reckoning.gait import WindowFeatures
from vislam2tag.estimation.dead_reckoning.maps import MEMORY_S, SharedLines, Walls
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, Headings, WalkSignals
from vislam2tag.estimation.settings import DeadReckoningSettings

STATES = 5
FIX_TAIL = 5.0
NORTH_TAIL = 3.0
WALL_TAIL = 3.0
SCALE_TAIL = 3.0
"""Degrees of freedom of the Student-t distributions."""
STANDING_NOISE_M = 0.01
"""Random part of the motion of somebody who stands, metres per square root of a second."""
LEAST_NOISE_M = 1e-3
OFFSET_RAD = 0.1
"""How far a walker goes beside where the phone points when a recording begins, one standard deviation."""
UNKNOWN_M_S = 1.5
"""How fast somebody may walk while there are no readings."""
LOOSE = np.diag((1e-8, 1e-8, 0.0, 1e-4, 0.0))
"""Weights that keep what nothing ties regular: 10 km, 100 rad."""
HOP_S = 0.5
CLOSE_S = 0.05
"""So near to a fix no further node is made: stretches must not be short."""


@dataclass(frozen=True)
class Nodes:
    """``k`` moments of a walk and the k - 1 stretches between them.

    ``time_s`` (k,); ``motion`` (k - 1,) complex metres, in a frame that the gyroscope holds still; ``length_m``
    (k - 1,) of the way; ``turn_rad`` (k - 1,) how far the phone turned, either way; ``known`` (k - 1,) mask of the
    stretches without a gap in the readings; ``drift_rad`` (k,) the phone's own heading less the gyroscope's, NaN where
    it has none; ``swinging`` (k - 1,) from 0, the phone is held still, to 1.
    """

    time_s: FloatArray
    motion: ComplexArray
    length_m: FloatArray
    turn_rad: FloatArray
    known: BoolArray
    drift_rad: FloatArray
    swinging: FloatArray

    @classmethod
    def of(
        cls,
        signals: WalkSignals,
        headings: Headings,
        features: WindowFeatures,
        speed_m_s: FloatArray,
        at_s: FloatArray,
    ) -> Nodes:
        """Sum the motion up between nodes: two a second, and one at each of the moments ``at_s`` within the walk."""
        end_s = signals.time_s[-1]
        regular = np.concatenate((np.arange(0, end_s - CLOSE_S, HOP_S), [end_s]))
        apart = np.abs(regular[:, None] - at_s).min(axis=1, initial=np.inf) > CLOSE_S
        time_s = np.unique(np.concatenate((regular[apart], at_s)))
        way = np.concatenate(([0.0], np.cumsum(speed_m_s[:-1]))) / RATE_HZ
        velocity = speed_m_s * np.exp(1j * headings.turned_rad)
        path = np.concatenate(([0.0], np.cumsum(velocity[:-1]))) / RATE_HZ
        unknown = np.concatenate(([0], np.cumsum(~signals.known[:-1])))
        return cls(
            time_s,
            np.diff(np.interp(time_s, signals.time_s, path.real) + 1j * np.interp(time_s, signals.time_s, path.imag)),
            np.diff(np.interp(time_s, signals.time_s, way)),
            np.abs(np.diff(np.interp(time_s, signals.time_s, headings.turned_rad))),
            np.diff(np.interp(time_s, signals.time_s, unknown)) == 0,
            np.interp(time_s, signals.time_s, headings.drift_rad),
            np.interp((time_s[1:] + time_s[:-1]) / 2, features.time_s, features.swinging),
        )

    @property
    def raw(self) -> ComplexArray:
        """(k,) the path from the start as the sensors have it, complex metres."""
        return np.concatenate(([0.0], np.cumsum(self.motion)))

    def index_of(self, time_s: FloatArray) -> IntArray:
        """Index (f,) of the nodes at these moments (f,), which are nodes."""
        return np.asarray(np.searchsorted(self.time_s, time_s))


@dataclass(frozen=True)
class PathState:
    """Unknowns at ``k`` nodes: ``position`` (k,) complex metres in the BCS, ``scale`` (k,) its logarithm,
    ``heading_rad`` (k,) of the gyroscope's frame in the BCS, ``offset_rad`` (k,) how far to the left of it the walker
    goes.
    """

    position: ComplexArray
    scale: FloatArray
    heading_rad: FloatArray
    offset_rad: FloatArray

    @classmethod
    def of_columns(cls, columns: FloatArray) -> PathState:
        """The state whose x, y, scale, heading and offset are these columns (k, 5)."""
        x, y, scale, heading, offset = columns.T
        return cls(x + 1j * y, scale, heading, offset)

    @property
    def columns(self) -> FloatArray:
        """(k, 5) x, y, scale, heading and offset."""
        at = self.position
        return np.column_stack((at.real, at.imag, self.scale, self.heading_rad, self.offset_rad))

    def moved(self, motion: ComplexArray) -> ComplexArray:
        """The sensors' motion (k - 1,) between nodes as scale, heading and offset have it, complex metres."""
        return np.asarray(np.exp(self.scale + 1j * (self.heading_rad + self.offset_rad))[:-1] * motion)


@dataclass(frozen=True)
class Ties:
    """Fixes of a walk: ``node`` (f,) index, ``position`` (f,) complex metres in the BCS, ``sigma_m`` usual,
    ``share`` (f,) or 1: each fix's in parts of the usual.
    """

    node: IntArray
    position: ComplexArray
    sigma_m: float
    share: FloatArray | float = 1.0

    @property
    def each_sigma_m(self) -> FloatArray:
        """(f,) standard deviation of each fix per axis, metres."""
        return np.full(len(self.node), self.sigma_m) * self.share


@dataclass(frozen=True)
class PathModel:
    """The motion between nodes with the variances of its errors."""

    nodes: Nodes
    settings: DeadReckoningSettings
    walls: Walls | None = None
    lines: SharedLines | None = None

    @property
    def precision(self) -> FloatArray:
        """(k - 1, 5) inverse variances of each stretch: x, y, scale, heading, offset."""
        nodes, settings = self.nodes, self.settings
        duration = np.diff(nodes.time_s)
        starting = np.exp(-(nodes.time_s[1:] + nodes.time_s[:-1]) / (2 * settings.start_s))
        swinging = 1 + (settings.swing_noise * nodes.swinging) ** 2
        harder = swinging + (settings.start_noise * starting) ** 2
        walked = settings.step_noise**2 * harder * nodes.length_m**2 / duration
        known = walked + STANDING_NOISE_M**2 * duration + LEAST_NOISE_M**2
        position = np.where(nodes.known, known, (UNKNOWN_M_S * duration) ** 2)
        scale = settings.scale_noise**2 * duration
        heading = settings.heading_noise_rad**2 * swinging * duration
        offset = heading + settings.offset_noise**2 * nodes.turn_rad
        return np.asarray(1 / np.column_stack((position, position, scale, heading, offset)))

    @property
    def kept(self) -> FloatArray:
        """(k - 1,) the part of an offset that is left after each stretch."""
        return np.exp(-np.diff(self.nodes.time_s) / self.settings.offset_memory_s)

    @property
    def north_precision(self) -> FloatArray:
        """(k,) inverse variances of the phone's own heading, as if each node's were independent; 0 where unknown."""
        share = self._share(2 * self.settings.north_memory_s)
        return np.where(np.isfinite(self.nodes.drift_rad), share / self.settings.north_sigma_rad**2, 0.0)

    def _share(self, memory_s: float) -> FloatArray:
        """(k,) parts of one independent word that each node has of errors that last so long."""
        return np.asarray(np.gradient(self.nodes.time_s) / memory_s)

    def equations(self, state: PathState, ties: Ties) -> NormalEquations:
        """Linearise about a state: the solution is by how much it must change."""
        count, precision = len(state.scale), self.precision
        moved = state.moved(self.nodes.motion)
        residual = self.residual(state)
        before = np.zeros((count - 1, STATES, STATES))
        before[:, range(STATES), range(STATES)] = -1
        before[:, 0, 2], before[:, 1, 2] = -moved.real, -moved.imag
        before[:, 0, 3], before[:, 1, 3] = moved.imag, -moved.real
        before[:, :2, 4], before[:, 4, 4] = before[:, :2, 3], -self.kept
        upper = (precision[:, :, None] * before).transpose(0, 2, 1)
        diagonal, right = np.tile(LOOSE, (count, 1, 1)), np.zeros((count, STATES))
        diagonal[:-1] += upper @ before
        diagonal[1:, range(STATES), range(STATES)] += precision
        right[:-1] -= np.einsum("kij,ki->kj", before, precision * residual)
        right[1:] -= precision * residual
        sigma = self.settings.scale_sigma
        alike = (SCALE_TAIL + 1) / (SCALE_TAIL + float(state.scale[0] / sigma) ** 2) / sigma**2
        diagonal[0, 2, 2] += alike
        right[0, 2] -= alike * state.scale[0]
        diagonal[0, 4, 4] += 1 / OFFSET_RAD**2
        right[0, 4] -= state.offset_rad[0] / OFFSET_RAD**2
        off, weight = self.north(state)
        diagonal[:, 3, 3] += weight
        right[:, 3] -= weight * off
        if self.walls is not None:
            beyond, away = self.walls.beyond(state.position)
            pull = self._share(self.settings.wall_memory_s) * _wall_weight(beyond / self.settings.wall_sigma_m)
            pull /= self.settings.wall_sigma_m**2
            diagonal[:, :2, :2] += pull[:, None, None] * away[:, :, None] * away[:, None, :]
            right[:, :2] -= (pull * beyond)[:, None] * away
        if self.lines is not None:
            aside, across = self.lines.distance_m(state.position), as_points(self.lines.normal)
            pull = self._share(MEMORY_S) * self.lines.weight(aside)
            diagonal[:, :2, :2] += pull[:, None, None] * across[:, :, None] * across[:, None, :]
            right[:, :2] -= (pull * aside)[:, None] * across
        error, tie_weight = fix_errors(state, ties)
        for axis, part in enumerate((error.real, error.imag)):
            diagonal[:, axis, axis] += np.bincount(ties.node, tie_weight, count)
            right[:, axis] -= np.bincount(ties.node, tie_weight * part, count)
        return NormalEquations(diagonal, upper, np.zeros((count, STATES, 0)), np.zeros((0, 0)), right, np.zeros(0))

    def scatter(self, state: PathState) -> FloatArray:
        """(k,) how far fixes scatter where a path leads, in parts of the usual: between walls there is less room."""
        return np.ones(len(state.scale)) if self.walls is None else self.walls.scatter(state.position)

    def residual(self, state: PathState) -> FloatArray:
        """(k - 1, 5) errors of motion, scale, heading and offset between nodes."""
        step = np.diff(state.position) - state.moved(self.nodes.motion)
        offset = state.offset_rad[1:] - self.kept * state.offset_rad[:-1]
        return np.column_stack((step.real, step.imag, np.diff(state.scale), np.diff(state.heading_rad), offset))

    def north(self, state: PathState) -> tuple[FloatArray, FloatArray]:
        """How far the heading is from the phone's own (k,), rad, and the weight of that (k,)."""
        off = wrapped(state.heading_rad - np.nan_to_num(self.nodes.drift_rad))
        precision = self.north_precision
        return off, precision / (1 + (off / self.settings.north_sigma_rad) ** 2 / NORTH_TAIL)

    def cost(self, state: PathState, ties: Ties) -> float:
        """Minus twice the logarithm of the likelihood, but for what no state changes."""
        off, _ = self.north(state)
        spread = self.settings.north_sigma_rad
        north = self.north_precision * NORTH_TAIL * spread**2 * np.log1p((off / spread) ** 2 / NORTH_TAIL)
        error = np.abs(state.position[ties.node] - ties.position) / ties.each_sigma_m
        fixes = (FIX_TAIL + 2) * np.log1p(error**2 / FIX_TAIL)
        walls = 0.0
        if self.walls is not None:
            beyond = self.walls.beyond(state.position)[0] / self.settings.wall_sigma_m
            share = self._share(self.settings.wall_memory_s)
            walls = float((share * (WALL_TAIL + 1) * np.log1p(beyond**2 / WALL_TAIL)).sum())
        lines = 0.0
        if self.lines is not None:
            lines = float((self._share(MEMORY_S) * self.lines.cost(self.lines.distance_m(state.position))).sum())
        motion = self.precision * self.residual(state) ** 2
        first = (SCALE_TAIL + 1) * np.log1p((state.scale[0] / self.settings.scale_sigma) ** 2 / SCALE_TAIL)
        first += (state.offset_rad[0] / OFFSET_RAD) ** 2
        return float(motion.sum() + north.sum() + fixes.sum() + first) + walls + lines


def _wall_weight(beyond: FloatArray) -> FloatArray:
    """Weights (k,) by Student-t of how far, in standard deviations, places (k,) are beyond where one walks."""
    return np.asarray(np.where(beyond > 0, (WALL_TAIL + 1) / (WALL_TAIL + beyond**2), 0.0))


def fix_errors(state: PathState, ties: Ties) -> tuple[ComplexArray, FloatArray]:
    """Complex errors (f,) of the path at its fixes, metres, and their weights (f,) by Student-t."""
    error = state.position[ties.node] - ties.position
    weight = (FIX_TAIL + 2) / (FIX_TAIL + np.abs(error / ties.each_sigma_m) ** 2) / ties.each_sigma_m**2
    return error, weight
