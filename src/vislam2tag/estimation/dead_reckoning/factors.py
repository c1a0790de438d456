"""The least-squares problem of a walk without a tracker, linearised about a path.

Unknown at each node ``k`` are the position ``z``, complex metres; the logarithm ``s`` of the walker's scale; the
heading ``h`` of the gyroscope's frame, rad; and the offset ``o``, rad, by which the walker goes beside where the phone
points: a body and a phone do not turn as one, but soon they agree again. With ``u`` the sensors' motion between nodes,
residuals and their laws are:

    motion  z[k+1] - z[k] - exp(s[k] + i (h[k] + o[k])) u[k],  normal
            s[k+1] - s[k],  h[k+1] - h[k],  o[k+1] - kept[k] o[k]
    start   s[0]                        Student's t: few walkers differ much from those of whom the speed was learned
            o[0]                        normal
    north   h[k] - the phone's own heading,  Student's t
    walls   how far z[k] is beyond where people walk,  Student's t
    lines   how far z[k] is aside of the ways of other walks,  Student's t
    fixes   z[k] - the fix's place,  Student's t

What lasts for a while (north, walls, lines) counts at each node as the part of one independent observation that the
node's time is of that while. docs/results/how-good.md calibrates the constants.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import as_points, wrapped
from vislam2tag.estimation.dead_reckoning.gait import WindowFeatures
from vislam2tag.estimation.dead_reckoning.maps import MEMORY_S, SharedLines, Walls
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, Headings, WalkSignals
from vislam2tag.estimation.least_squares import NormalEquations

STATES = 5
SCALE, HEADING, OFFSET = 2, 3, 4
"""x, y, scale, heading and offset: how many, and which are which."""
UNIT = np.eye(STATES)
FIX_DOF = 5.0
NORTH_DOF = 3.0
WALL_DOF = 3.0
SCALE_DOF = 3.0
LINE_DOF = 3.0
"""Degrees of freedom of the Student-t distributions."""
STEP_NOISE = 0.1
"""Random part of the motion, phone held still: metres per square root of a second for each m/s of speed."""
START_S = 2.0
"""How long the first steps of a recording tell less than others, seconds ..."""
START_NOISE = 4.0
"""... and how much random motion they add (squares add up), in parts of the usual."""
SWING_NOISE = 3.0
"""How much random motion and drift a phone adds that swings, in a hand or on a thigh, in parts of the usual."""
SCALE_SIGMA = 0.05
"""Relative error of a walker's speed, one standard deviation; some differ by much more (Student-t)."""
SCALE_NOISE = 0.01
"""How much it changes: relative, per square root of a second."""
HEADING_NOISE_RAD = 0.03
"""Drift of the heading, phone held still, rad per square root of a second."""
OFFSET_NOISE = 0.35
"""How far walkers go beside where the phone points after a turn: rad for one of one rad, growing as its root."""
OFFSET_MEMORY_S = 1.5
"""How long that lasts, seconds."""
NORTH_SIGMA_RAD = 0.26
"""Error of the phone's own heading against the plan's north, one standard deviation, rad."""
NORTH_MEMORY_S = 6.0
"""How long such an error lasts, seconds."""
WALL_SIGMA_M = 1.0
"""How far walkers go beyond their usual distance from walls, or a plan is off, one standard deviation, metres."""
WALL_MEMORY_S = 2.0
"""How long that lasts, seconds."""
STANDING_NOISE_M = 0.01
"""Random part of the motion of someone who stands, metres per square root of a second."""
LEAST_NOISE_M = 1e-3
OFFSET_RAD = 0.1
"""How far a walker goes beside where the phone points when a recording begins, one standard deviation."""
UNKNOWN_M_S = 1.5
"""How fast someone may walk while there are no readings."""
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
    stretches without a gap in the readings; ``drift_rad`` (k,) the phone's own heading less the gyroscope's, NaN if
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
class WalkFixes:
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
class MotionFactor:
    """Ties each node to the next one by ``residual`` (k - 1, 5), expected 0 with ``precision`` (k - 1, 5).

    ``before`` (k - 1, 5, 5) is its slope by the state before; that by the state after is 1.
    """

    residual: FloatArray
    before: FloatArray
    precision: FloatArray

    @property
    def cost(self) -> float:
        """Minus twice the logarithm of the likelihood, except for what no state changes."""
        return float((self.precision * self.residual**2).sum())


@dataclass(frozen=True)
class NodeFactor:
    """Ties single nodes by errors ``error`` (r,) that are expected 0, with ``weight`` (r,), their robust precisions.

    ``slope`` (r, 5) is that of the error by the node's state; ``node`` (r,) index, or None: one error for each node.
    ``cost`` is minus twice the logarithm of their likelihood, except for what no state changes.
    """

    error: FloatArray
    slope: FloatArray
    weight: FloatArray
    cost: float
    node: IntArray | None = None


def student_t(
    squared: FloatArray, dof: float, share: FloatArray | float = 1.0, dimensions: int = 1
) -> tuple[FloatArray, float]:
    """Factors (r,) of the precisions of errors by Student's t with ``dof`` degrees of freedom, and their cost.

    ``squared`` (r,) are the errors' squares in units of their usual variances, each of so many ``dimensions``; each
    counts for ``share`` (r,) of an observation.
    """
    counts = share * (dof + dimensions)
    return np.asarray(counts / (dof + squared)), float((counts * np.log1p(squared / dof)).sum())


@dataclass(frozen=True)
class PathModel:
    """The motion between nodes with the variances of its errors, and what else is known of the path."""

    nodes: Nodes
    walls: Walls | None = None
    lines: SharedLines | None = None
    scale_sigma: float = SCALE_SIGMA
    north_memory_s: float = NORTH_MEMORY_S

    @property
    def precision(self) -> FloatArray:
        """(k - 1, 5) inverse variances of each stretch: x, y, scale, heading, offset."""
        nodes = self.nodes
        duration = np.diff(nodes.time_s)
        starting = np.exp(-(nodes.time_s[1:] + nodes.time_s[:-1]) / (2 * START_S))
        swinging = 1 + (SWING_NOISE * nodes.swinging) ** 2
        harder = swinging + (START_NOISE * starting) ** 2
        walked = STEP_NOISE**2 * harder * nodes.length_m**2 / duration
        known = walked + STANDING_NOISE_M**2 * duration + LEAST_NOISE_M**2
        position = np.where(nodes.known, known, (UNKNOWN_M_S * duration) ** 2)
        scale = SCALE_NOISE**2 * duration
        heading = HEADING_NOISE_RAD**2 * swinging * duration
        offset = heading + OFFSET_NOISE**2 * nodes.turn_rad
        return np.asarray(1 / np.column_stack((position, position, scale, heading, offset)))

    @property
    def kept(self) -> FloatArray:
        """(k - 1,) the part of an offset that is left after each stretch."""
        return np.exp(-np.diff(self.nodes.time_s) / OFFSET_MEMORY_S)

    def _share(self, memory_s: float) -> FloatArray:
        """(k,) parts of one independent observation that each node has of errors that last so long."""
        return np.asarray(np.gradient(self.nodes.time_s) / memory_s)

    def scatter(self, state: PathState) -> FloatArray:
        """(k,) how far fixes scatter where a path leads, in parts of the usual: between walls there is less room."""
        return np.ones(len(state.scale)) if self.walls is None else self.walls.scatter(state.position)

    def motion(self, state: PathState) -> MotionFactor:
        """What the sensors say of the way between nodes."""
        moved = state.moved(self.nodes.motion)
        step = np.diff(state.position) - moved
        offset = state.offset_rad[1:] - self.kept * state.offset_rad[:-1]
        before = np.zeros((len(moved), STATES, STATES))
        before[:, range(STATES), range(STATES)] = -1
        before[:, 0, SCALE], before[:, 1, SCALE] = -moved.real, -moved.imag
        before[:, 0, HEADING], before[:, 1, HEADING] = moved.imag, -moved.real
        before[:, :2, OFFSET], before[:, OFFSET, OFFSET] = before[:, :2, HEADING], -self.kept
        residual = np.column_stack((step.real, step.imag, np.diff(state.scale), np.diff(state.heading_rad), offset))
        return MotionFactor(residual, before, self.precision)

    def start(self, state: PathState) -> NodeFactor:
        """How a walk begins: a walker of usual speed who goes about where the phone points."""
        error = np.array((state.scale[0], state.offset_rad[0]))
        squared = (error / (self.scale_sigma, OFFSET_RAD)) ** 2
        factor, cost = student_t(squared[:1], SCALE_DOF)
        weight = np.array((factor[0] / self.scale_sigma**2, OFFSET_RAD**-2))
        return NodeFactor(error, UNIT[[SCALE, OFFSET]], weight, cost + float(squared[1]), np.zeros(2, dtype=np.int64))

    def north(self, state: PathState) -> NodeFactor:
        """The heading by the phone's own; nothing if it has none."""
        drift_rad, sigma_rad = self.nodes.drift_rad, NORTH_SIGMA_RAD
        off = wrapped(state.heading_rad - np.nan_to_num(drift_rad))
        share = np.where(np.isfinite(drift_rad), self._share(2 * self.north_memory_s), 0.0)
        factor, cost = student_t((off / sigma_rad) ** 2, NORTH_DOF, share, dimensions=0)
        return NodeFactor(off, np.tile(UNIT[HEADING], (len(off), 1)), factor / sigma_rad**2, cost)

    def keeping_off(self, walls: Walls, state: PathState) -> NodeFactor:
        """How far the path is beyond where people walk between ``walls``."""
        beyond, away = walls.beyond(state.position)
        factor, cost = student_t((beyond / WALL_SIGMA_M) ** 2, WALL_DOF, self._share(WALL_MEMORY_S))
        return NodeFactor(beyond, _in_plane(away), np.where(beyond > 0, factor, 0.0) / WALL_SIGMA_M**2, cost)

    def along(self, lines: SharedLines, state: PathState) -> NodeFactor:
        """How far the path leads aside of the ways of other walks."""
        aside = lines.distance_m(state.position)
        factor, cost = student_t(aside**2 * lines.precision, LINE_DOF, self._share(MEMORY_S))
        return NodeFactor(aside, _in_plane(as_points(lines.normal)), factor * lines.precision, cost)

    def node_factors(self, state: PathState, fixes: WalkFixes) -> list[NodeFactor]:
        """All that ties single nodes."""
        factors = [self.start(state), self.north(state)]
        if self.walls is not None:
            factors.append(self.keeping_off(self.walls, state))
        if self.lines is not None:
            factors.append(self.along(self.lines, state))
        return [*factors, fixed(state, fixes)]

    def equations(self, state: PathState, fixes: WalkFixes) -> NormalEquations:
        """Linearise about a state: the solution is by how much it must change."""
        count, motion = len(state.scale), self.motion(state)
        diagonal, right = np.tile(LOOSE, (count, 1, 1)), np.zeros((count, STATES))
        upper = (motion.precision[:, :, None] * motion.before).transpose(0, 2, 1)
        weighted_residual = motion.precision * motion.residual
        diagonal[:-1] += upper @ motion.before
        diagonal[1:, range(STATES), range(STATES)] += motion.precision
        right[:-1] -= np.einsum("kij,ki->kj", motion.before, weighted_residual)
        right[1:] -= weighted_residual
        for factor in self.node_factors(state, fixes):
            information = factor.weight[:, None, None] * factor.slope[:, :, None] * factor.slope[:, None, :]
            wanted = -(factor.weight * factor.error)[:, None] * factor.slope
            if factor.node is None:
                diagonal += information
                right += wanted
            else:
                np.add.at(diagonal, factor.node, information)
                np.add.at(right, factor.node, wanted)
        return NormalEquations(diagonal, upper, np.zeros((count, STATES, 0)), np.zeros((0, 0)), right, np.zeros(0))

    def cost(self, state: PathState, fixes: WalkFixes) -> float:
        """Minus twice the logarithm of the likelihood, except for what no state changes."""
        return self.motion(state).cost + sum(factor.cost for factor in self.node_factors(state, fixes))


def fixed(state: PathState, fixes: WalkFixes) -> NodeFactor:
    """How far the path is from its fixes, east of all and then north of all."""
    error = state.position[fixes.node] - fixes.position
    factor, cost = student_t(np.abs(error / fixes.each_sigma_m) ** 2, FIX_DOF, dimensions=2)
    weight, slope = np.tile(factor / fixes.each_sigma_m**2, 2), np.repeat(UNIT[:2], len(error), axis=0)
    return NodeFactor(np.concatenate((error.real, error.imag)), slope, weight, cost, np.tile(fixes.node, 2))


def _in_plane(slope: FloatArray) -> FloatArray:
    """Slopes (r, 5) by a state of what depends on its position alone, by ``slope`` (r, 2)."""
    return np.pad(slope, ((0, 0), (0, STATES - 2)))
