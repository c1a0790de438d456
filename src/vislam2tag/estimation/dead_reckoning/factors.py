"""The least-squares problem of a walk without a tracker, linearised about a path.

The unknowns at each node ``k`` are:

- the position ``z``, complex metres;
- the logarithm ``s`` of the walker's scale;
- the heading ``h`` of the gyroscope's frame, rad;
- the offset ``o``, rad, between the direction of walking and that of the phone.

With ``u`` the sensors' motion between nodes, the residuals and their distributions are:

    motion:  z[k+1] - z[k] - exp(s[k] + i (h[k] + o[k])) u[k],  normal
             s[k+1] - s[k],  h[k+1] - h[k],  o[k+1] - kept[k] o[k]
    start:   s[0]                        Student's t: few walkers differ much from those in the speed model's data
             o[0]                        normal
    north:   h[k] - the phone's own heading,  Student's t
    walls:   distance of z[k] beyond the walkable area,  Student's t
    lines:   lateral distance of z[k] from the paths of other walks,  Student's t
    fixes:   z[k] - the fix's place,  Student's t

Errors that last for a while (north, walls, lines) count at each node as a part of one independent observation: the
node's time divided by that duration. docs/results/how-good.md calibrates the constants.
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
"""Number of unknowns (x, y, scale, heading and offset), and indices."""
UNIT = np.eye(STATES)
FIX_DOF = 5.0
NORTH_DOF = 3.0
WALL_DOF = 3.0
SCALE_DOF = 3.0
LINE_DOF = 3.0
"""Degrees of freedom of the Student-t distributions."""
STEP_NOISE = 0.1
"""Random part of the motion for a still phone: metres per square root of a second for each m/s of speed."""
START_S = 2.0
"""Duration of the less accurate first steps of a recording, seconds ..."""
START_NOISE = 4.0
"""... and their additional random motion (squares add up), as a multiple of the usual."""
SWING_NOISE = 3.0
"""Additional random motion and drift of a phone that swings, in a hand or on a thigh, as a multiple of the usual."""
SCALE_SIGMA = 0.05
"""Relative error of a walker's speed, one standard deviation; some differ by much more (Student-t)."""
SCALE_NOISE = 0.01
"""Change of this error: relative, per square root of a second."""
HEADING_NOISE_RAD = 0.03
"""Drift of the heading of a still phone, rad per square root of a second."""
OFFSET_NOISE = 0.35
"""Offset between walker and phone after a turn: rad for a turn of one rad, growing with its root."""
OFFSET_MEMORY_S = 1.5
"""Duration of this offset, seconds."""
NORTH_SIGMA_RAD = 0.26
"""Error of the phone's own heading against the plan's north, one standard deviation, rad."""
NORTH_MEMORY_S = 6.0
"""Duration of such an error, seconds."""
WALL_SIGMA_M = 1.0
"""Standard deviation of walkers beyond their usual distance from walls, and of errors of the plan, metres."""
WALL_MEMORY_S = 2.0
"""Duration of this deviation, seconds."""
STANDING_NOISE_M = 0.01
"""Random part of the motion while standing, metres per square root of a second."""
LEAST_NOISE_M = 1e-3
OFFSET_RAD = 0.1
"""Standard deviation of the offset between walker and phone at the start of a recording."""
UNKNOWN_M_S = 1.5
"""Speed that is possible in gaps between readings."""
LOOSE = np.diag((1e-8, 1e-8, 0.0, 1e-4, 0.0))
"""Weights that keep unconstrained unknowns regular: 10 km, 100 rad."""
HOP_S = 0.5
CLOSE_S = 0.05
"""No other node is made this close to a fix, because stretches must not be short."""


@dataclass(frozen=True)
class Nodes:
    """``k`` moments of a walk and the k - 1 stretches between them.

    ``time_s`` (k,) are the moments. ``motion`` (k - 1,) is in complex metres, in a frame that is fixed by the
    gyroscope, and ``length_m`` (k - 1,) the length of the path. ``turn_rad`` (k - 1,) is the absolute turn of the
    phone, ``known`` (k - 1,) a mask of the stretches without a gap in the readings. ``drift_rad`` (k,) is the phone's
    own heading minus the gyroscope's, NaN if it has none; ``swinging`` (k - 1,) is from 0 (still phone) to 1.
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
        """Sum up the motion between nodes: two in a second, and one at each of the moments ``at_s`` within the walk."""
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
        """(k,) the path from the start by the sensors alone, complex metres."""
        return np.concatenate(([0.0], np.cumsum(self.motion)))

    def index_of(self, time_s: FloatArray) -> IntArray:
        """Index (f,) of the nodes at these moments (f,), which are nodes."""
        return np.asarray(np.searchsorted(self.time_s, time_s))


@dataclass(frozen=True)
class PathState:
    """Unknowns at ``k`` nodes: ``position`` (k,) complex metres in the BCS, ``scale`` (k,) its logarithm,
    ``heading_rad`` (k,) of the gyroscope's frame in the BCS, ``offset_rad`` (k,) of the direction of walking, to the
    left.
    """

    position: ComplexArray
    scale: FloatArray
    heading_rad: FloatArray
    offset_rad: FloatArray

    @classmethod
    def of_columns(cls, columns: FloatArray) -> PathState:
        """Make the state from columns (k, 5): x, y, scale, heading and offset."""
        x, y, scale, heading, offset = columns.T
        return cls(x + 1j * y, scale, heading, offset)

    @property
    def columns(self) -> FloatArray:
        """(k, 5) x, y, scale, heading and offset."""
        at = self.position
        return np.column_stack((at.real, at.imag, self.scale, self.heading_rad, self.offset_rad))

    def moved(self, motion: ComplexArray) -> ComplexArray:
        """The sensors' motion (k - 1,) between nodes with scale, heading and offset applied, complex metres."""
        return np.asarray(np.exp(self.scale + 1j * (self.heading_rad + self.offset_rad))[:-1] * motion)


@dataclass(frozen=True)
class WalkFixes:
    """Fixes of a walk: ``node`` (f,) index, ``position`` (f,) complex metres in the BCS, ``sigma_m`` usual standard
    deviation, ``share`` (f,) or 1: that of each fix as a multiple of it.
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
    """Connects each node to the next one by ``residual`` (k - 1, 5), expected 0 with ``precision`` (k - 1, 5).

    ``before`` (k - 1, 5, 5) is its derivative by the state before; that by the state after is 1.
    """

    residual: FloatArray
    before: FloatArray
    precision: FloatArray

    @property
    def cost(self) -> float:
        """Minus twice the logarithm of the likelihood, up to a constant."""
        return float((self.precision * self.residual**2).sum())


@dataclass(frozen=True)
class NodeFactor:
    """Constrains single nodes by errors ``error`` (r,) with expectation 0 and robust precisions ``weight`` (r,).

    ``slope`` (r, 5) is the error's derivative by the node's state; ``node`` (r,) index, or None: one error for each
    node. ``cost`` is minus twice the logarithm of their likelihood, up to a constant.
    """

    error: FloatArray
    slope: FloatArray
    weight: FloatArray
    cost: float
    node: IntArray | None = None


def student_t(
    squared: FloatArray, dof: float, share: FloatArray | float = 1.0, dimensions: int = 1
) -> tuple[FloatArray, float]:
    """Factors (r,) on the precisions of errors by Student's t with ``dof`` degrees of freedom, and their cost.

    ``squared`` (r,) are the errors' squares in units of their usual variances, each of ``dimensions`` numbers; each
    counts as ``share`` (r,) of an observation.
    """
    counts = share * (dof + dimensions)
    return np.asarray(counts / (dof + squared)), float((counts * np.log1p(squared / dof)).sum())


@dataclass(frozen=True)
class PathModel:
    """The motion between nodes with the variances of its errors, and the other constraints of the path."""

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
        """(k - 1,) share of an offset that remains after each stretch."""
        return np.exp(-np.diff(self.nodes.time_s) / OFFSET_MEMORY_S)

    def _share(self, memory_s: float) -> FloatArray:
        """(k,) share of an independent observation at each node, for errors of this duration."""
        return np.asarray(np.gradient(self.nodes.time_s) / memory_s)

    def scatter(self, state: PathState) -> FloatArray:
        """(k,) scatter of fixes along a path, as a multiple of the usual; there is less room between walls."""
        return np.ones(len(state.scale)) if self.walls is None else self.walls.scatter(state.position)

    def motion(self, state: PathState) -> MotionFactor:
        """Motion of the sensors between nodes."""
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
        """Start of a walk: usual speed, direction of the phone."""
        error = np.array((state.scale[0], state.offset_rad[0]))
        squared = (error / (self.scale_sigma, OFFSET_RAD)) ** 2
        factor, cost = student_t(squared[:1], SCALE_DOF)
        weight = np.array((factor[0] / self.scale_sigma**2, OFFSET_RAD**-2))
        return NodeFactor(error, UNIT[[SCALE, OFFSET]], weight, cost + float(squared[1]), np.zeros(2, dtype=np.int64))

    def north(self, state: PathState) -> NodeFactor:
        """The heading by the phone's own; empty if it has none."""
        drift_rad, sigma_rad = self.nodes.drift_rad, NORTH_SIGMA_RAD
        off = wrapped(state.heading_rad - np.nan_to_num(drift_rad))
        share = np.where(np.isfinite(drift_rad), self._share(2 * self.north_memory_s), 0.0)
        factor, cost = student_t((off / sigma_rad) ** 2, NORTH_DOF, share, dimensions=0)
        return NodeFactor(off, np.tile(UNIT[HEADING], (len(off), 1)), factor / sigma_rad**2, cost)

    def keeping_off(self, walls: Walls, state: PathState) -> NodeFactor:
        """Distance of the path beyond the walkable area between ``walls``."""
        beyond, away = walls.beyond(state.position)
        factor, cost = student_t((beyond / WALL_SIGMA_M) ** 2, WALL_DOF, self._share(WALL_MEMORY_S))
        return NodeFactor(beyond, _in_plane(away), np.where(beyond > 0, factor, 0.0) / WALL_SIGMA_M**2, cost)

    def along(self, lines: SharedLines, state: PathState) -> NodeFactor:
        """Lateral distance of the path from the paths of other walks."""
        aside = lines.distance_m(state.position)
        factor, cost = student_t(aside**2 * lines.precision, LINE_DOF, self._share(MEMORY_S))
        return NodeFactor(aside, _in_plane(as_points(lines.normal)), factor * lines.precision, cost)

    def node_factors(self, state: PathState, fixes: WalkFixes) -> list[NodeFactor]:
        """All constraints of single nodes."""
        factors = [self.start(state), self.north(state)]
        if self.walls is not None:
            factors.append(self.keeping_off(self.walls, state))
        if self.lines is not None:
            factors.append(self.along(self.lines, state))
        return [*factors, fixed(state, fixes)]

    def equations(self, state: PathState, fixes: WalkFixes) -> NormalEquations:
        """Linearise about a state; the solution is the change of the state."""
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
        """Minus twice the logarithm of the likelihood, up to a constant."""
        return self.motion(state).cost + sum(factor.cost for factor in self.node_factors(state, fixes))


def fixed(state: PathState, fixes: WalkFixes) -> NodeFactor:
    """Differences between path and fixes, x of all, then y of all."""
    error = state.position[fixes.node] - fixes.position
    factor, cost = student_t(np.abs(error / fixes.each_sigma_m) ** 2, FIX_DOF, dimensions=2)
    weight, slope = np.tile(factor / fixes.each_sigma_m**2, 2), np.repeat(UNIT[:2], len(error), axis=0)
    return NodeFactor(np.concatenate((error.real, error.imag)), slope, weight, cost, np.tile(fixes.node, 2))


def _in_plane(slope: FloatArray) -> FloatArray:
    """Derivatives (r, 5) by a state, from derivatives ``slope`` (r, 2) by its position."""
    return np.pad(slope, ((0, 0), (0, STATES - 2)))
