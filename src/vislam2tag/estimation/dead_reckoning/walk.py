"""From the log of a walk without a tracker to its path, its events, and fixes that contradict the others.

One wrong fix among many is outvoted, and the path stays right. Fixes contradict each other as a whole if they are in
the wrong order, or from another floor or walk.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, runs_of
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import FixLog, InertialLog, WalkedWays
from vislam2tag.core.status import EventKind
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.dead_reckoning.factors import Nodes, PathModel, WalkFixes, fixed
from vislam2tag.estimation.dead_reckoning.gait import SpeedModel, WindowFeatures, turned_by_gait
from vislam2tag.estimation.dead_reckoning.maps import SharedLines, Walls
from vislam2tag.estimation.dead_reckoning.signals import Headings, WalkSignals
from vislam2tag.estimation.dead_reckoning.smoothing import SmoothedPath, covering_covariance, smooth_path
from vislam2tag.estimation.settings import MIN_JUDGED, DeadReckoningSettings

MOVING = 0.5
"""Above this a person probably walks."""
FIX_SIGMA_M = 0.4
"""Usual distance per axis between a fix and the walker, metres; each session's own is estimated."""
WALL_DISTANCE_M = 0.6
"""Distance that walkers keep from walls if there is room, metres."""
STANDING_S = 2.0
"""Shortest time without steps that counts as standing, seconds."""
BEYOND_S = 2.0
"""A fix this long before the first reading or after the last one is used there."""


@dataclass(frozen=True)
class SensedWalk:
    """What a walk's sensors show without fixes: its path up to a rotation and a start."""

    signals: WalkSignals
    headings: Headings
    features: WindowFeatures

    @classmethod
    def of(cls, log: InertialLog) -> SensedWalk | None:
        """Read the sensors; None if they have less than a few seconds in common, or if values are impossible."""
        signals = WalkSignals.of(log)
        if signals is None:
            return None
        headings = Headings.of(signals, log)
        features = WindowFeatures.of(signals, headings.up)
        turned_rad = turned_by_gait(signals, headings.up, features)
        return cls(signals, replace(headings, drift_rad=headings.drift_rad + turned_rad), features)

    def usable(self, fixes: FixLog) -> BoolArray:
        """Mask (k,) of the fixes within the walk."""
        at = self._moments(fixes)
        return np.asarray((at > -BEYOND_S) & (at < self.signals.time_s[-1] + BEYOND_S))

    def path(
        self,
        log: FixLog,
        speed: SpeedModel,
        settings: DeadReckoningSettings,
        area: WalkableArea | None = None,
        ways: WalkedWays | None = None,
    ) -> ReckonedWalk:
        """Find the path through the fixes, all of which must be usable; at least one is needed.

        It stays between an area's walls; without walls it is drawn sideways to the paths of others (``ways``).
        """
        at_s = self._moments(log).clip(0, self.signals.time_s[-1]).round(2)
        speed_m_s = speed.speed_m_s(self.features, self.signals.time_s)
        nodes = Nodes.of(self.signals, self.headings, self.features, speed_m_s, at_s)
        fix_sigma_m = np.full(len(at_s), np.nan) if log.sigma_m is None else log.sigma_m
        share = np.where(np.isnan(fix_sigma_m), 1.0, fix_sigma_m / FIX_SIGMA_M)
        fixes = WalkFixes(nodes.index_of(at_s), as_complex(log.position_bcs), FIX_SIGMA_M, share)
        walls = None if area is None or not settings.plan_prior else Walls(area, WALL_DISTANCE_M)
        if walls is not None and not walls.fit(fixes.position):
            walls = None
        model = PathModel(nodes, walls)
        alone = ReckonedWalk(self, model, fixes, smooth_path(model, fixes), log.name)
        if ways is None or not len(ways.walk) or walls is not None:
            return alone  # with walls, other walks add nothing (benchmarks/NOTES.md)
        lines = SharedLines.of(ways, alone.path.state.position, alone.node_course)
        helped = replace(model, lines=lines)
        return replace(alone, model=helped, path=smooth_path(helped, fixes))

    def _moments(self, fixes: FixLog) -> FloatArray:
        """Times (k,) of the fixes, seconds since the start."""
        return np.asarray((fixes.time_ns - self.signals.start_ns) * 1e-9)


@dataclass(frozen=True)
class ReckonedWalk:
    """A walk's path through its fixes, found by a model; ``names`` (f,) are the names of the fixes."""

    sensed: SensedWalk
    model: PathModel
    fixes: WalkFixes
    path: SmoothedPath
    names: tuple[str, ...]

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (m, 2) in the BCS, metres, and covariances (m, 2, 2) at moments (m,) within the walk.

        The covariance is that of a fix's distance from the path: the uncertainty of the path plus the scatter of fixes,
        because only fixes show where the walker was.
        """
        scatter = self.path.scatter_m[:, None, None] ** 2 * np.eye(2)
        return self._between(self.positions, time_s), self._between(self._covering + scatter, time_s)

    @property
    def nodes(self) -> Nodes:
        """The moments of the path's states."""
        return self.model.nodes

    @cached_property
    def _covering(self) -> FloatArray:
        """(k, 2, 2) covariance of each node that also covers unusual walkers, without the scatter of fixes."""
        return covering_covariance(self.path, self.model, self.fixes)

    @property
    def fix_scatter_m(self) -> FloatArray:
        """(f,) expected distance of each fix from the walker, per axis, metres."""
        return np.asarray(self.path.scatter_m[self.fixes.node] * self.fixes.share)

    @property
    def positions(self) -> FloatArray:
        """(k, 2) position of each node in the BCS, metres."""
        return as_points(self.path.state.position)

    @property
    def course_rad(self) -> FloatArray:
        """(n,) direction of walking in the BCS at each moment of the signals."""
        state = self.path.state
        frame = np.interp(self.sensed.signals.time_s, self.nodes.time_s, state.heading_rad + state.offset_rad)
        return np.asarray(frame + self.sensed.headings.turned_rad)

    @property
    def node_course(self) -> ComplexArray:
        """(k,) direction of walking in the BCS at each node, unit; 0 while standing."""
        course = np.interp(self.nodes.time_s, self.sensed.signals.time_s, self.course_rad)
        moving = np.interp(self.nodes.time_s, self.sensed.features.time_s, self.sensed.features.moving) > MOVING
        return np.asarray(moving * np.exp(1j * course))

    def way(self) -> WalkedWays:
        """Path of the walk, for other walks on its floor."""
        walked = np.flatnonzero(self.node_course)
        course = np.angle(self.node_course[walked])
        return WalkedWays(self.positions[walked], course, np.zeros(len(walked), dtype=np.int64))

    def _between(self, values: FloatArray, time_s: FloatArray) -> FloatArray:
        """Interpolate values (k, ...) of the nodes linearly."""
        nodes = self.nodes.time_s
        after = np.searchsorted(nodes, time_s).clip(1, len(nodes) - 1)
        share = ((time_s - nodes[after - 1]) / (nodes[after] - nodes[after - 1])).clip(0, 1)
        share = share.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray(values[after - 1] * (1 - share) + values[after] * share)


TURN_RAD = np.pi / 3
"""A larger turn without a step is a turn in place."""
CLIMB_M_S = 0.15
CLIMB_M = 1.5
"""Smallest rise by air pressure that counts; less may be from doors and ventilation."""
CLIMB_WINDOW_S = 4.0


@dataclass(frozen=True)
class Happening:
    """An event from ``start_s`` to ``end_s`` of a walk; ``size_m`` is the rise, ``turn_rad`` the turn."""

    kind: EventKind
    start_s: float
    end_s: float
    size_m: float
    turn_rad: float


def happenings(walk: SensedWalk, altitude_m: FloatArray | None) -> list[Happening]:
    """List the events of a walk in order of time; ``altitude_m`` (m,) is the height at its windows by air pressure."""
    time_s, standing = walk.features.time_s, walk.features.moving < 0.5
    turned = np.interp(time_s, walk.signals.time_s, walk.headings.turned_rad)
    found = []
    climbing = np.zeros(len(time_s), dtype=bool)
    if altitude_m is not None:
        ends = [np.interp(time_s + side * CLIMB_WINDOW_S / 2, time_s, altitude_m) for side in (-1, 1)]
        climbing = np.abs(ends[1] - ends[0]) > CLIMB_M_S * CLIMB_WINDOW_S
        for first, stop in runs_of(climbing):
            last = stop - 1
            rise = float(altitude_m[last] - altitude_m[first])
            if abs(rise) >= CLIMB_M:
                kind = EventKind.LIFT if standing[first:stop].mean() > 0.5 else EventKind.STAIRS
                found.append(Happening(kind, float(time_s[first]), float(time_s[last]), abs(rise), float("nan")))
    for first, stop in runs_of(standing & ~climbing):
        last = stop - 1
        lasted, turn = float(time_s[last] - time_s[first]), float(turned[last] - turned[first])
        if abs(turn) > TURN_RAD:
            found.append(Happening(EventKind.TURN, float(time_s[first]), float(time_s[last]), 0.0, turn))
        elif lasted >= STANDING_S:
            found.append(Happening(EventKind.STANDING, float(time_s[first]), float(time_s[last]), 0.0, turn))
    return sorted(found, key=lambda each: each.start_s)


DOUBTFUL = 3.7
"""Standard deviations (per axis) beyond which one fix in a thousand is by chance."""
LEAST_FREEDOM = 0.02
"""If less than this share of a fix's place is determined by the others, they cannot contradict it."""


@dataclass(frozen=True)
class LeftOut:
    """Fixes (f,) left out one at a time, by the linear model about the path.

    ``error_m`` (f, 2) is from the fix to the walker's position by the others, metres in the BCS; ``sigma_m`` (f,) its
    expected size per axis; NaN at fixes that the others do not determine.
    """

    error_m: FloatArray
    sigma_m: FloatArray

    @classmethod
    def of(cls, walk: ReckonedWalk) -> LeftOut:
        """Leave out each fix of a walk in turn, without solving again."""
        sigma, node = walk.path.fix_sigma_m, walk.fixes.node
        factor = fixed(walk.path.state, replace(walk.fixes, sigma_m=sigma))
        error, weight = factor.error.reshape(2, -1).T, factor.weight[: len(node)]
        variance = np.trace(walk.path.covariance[node, :2, :2], axis1=1, axis2=2) / 2
        own = variance * weight
        freedom = np.where(own < 1 - LEAST_FREEDOM, 1 - own, np.nan)
        without = error / freedom[:, None]
        return cls(without, np.sqrt(walk.fix_scatter_m**2 + variance / freedom))

    @property
    def doubtful(self) -> BoolArray:
        """Mask (f,) of the fixes that contradict the others."""
        return np.asarray(np.linalg.norm(self.error_m, axis=1) > DOUBTFUL * self.sigma_m)


MIN_DOUBTFUL = 2
MAX_DOUBTFUL_SHARE = 0.3
"""Real walks have at most one wrong fix in ten."""
MAX_SCALE = 2.0
"""Largest distance between fixes, as a multiple of that of the steps ..."""
MAX_M_S = 3.0
"""... and in metres per second of the time between them ..."""
MARGIN_M = 3.0
"""... plus this, metres; beyond, one of the two fixes is wrong."""


def contradictions_m(walk: ReckonedWalk) -> FloatArray:
    """Size (f,) of each fix's contradiction to the others, metres, if they cannot all be right; otherwise zeros."""
    left_out = LeftOut.of(walk)
    judged, doubtful = np.isfinite(left_out.sigma_m), left_out.doubtful
    most = doubtful.sum() >= MIN_DOUBTFUL and doubtful.sum() > MAX_DOUBTFUL_SHARE * judged.sum()
    if not most and judged.sum() >= MIN_JUDGED:
        return np.zeros(len(judged))
    error_m = np.where(doubtful, np.linalg.norm(np.nan_to_num(left_out.error_m), axis=1), 0.0)
    error_m = np.maximum(error_m, _too_far_m(walk))
    if not error_m.any():
        return error_m
    return np.where(error_m > 0, error_m, np.median(error_m[error_m > 0]))  # fixes that agree are not better


def _too_far_m(walk: ReckonedWalk) -> FloatArray:
    """Excess (f,) of each fix's distance from its neighbours over what the steps or the time allow, metres."""
    nodes, at = walk.nodes, walk.fixes.node
    duration_s = np.diff(nodes.time_s)
    in_time_m = MAX_M_S * duration_s
    walked_m = np.where(nodes.known, MAX_SCALE * nodes.length_m, in_time_m)
    so_far_m = np.vstack((np.zeros(2), np.cumsum(np.column_stack((walked_m, in_time_m)), axis=0)))
    possible_m = np.diff(so_far_m[at], axis=0).min(axis=1)
    excess_m = (np.abs(np.diff(walk.fixes.position)) - possible_m - MARGIN_M).clip(0)
    return np.asarray(np.maximum(np.append(excess_m, 0.0), np.append(0.0, excess_m)))
