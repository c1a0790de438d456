"""From the log of a walk without a tracker to its path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import FixLog, InertialLog, WalkedWays
from vislam2tag.core.similarity import as_complex, as_points
from vislam2tag.estimation.dead_reckoning.covering import covering_covariance
from vislam2tag.estimation.dead_reckoning.equations import PathModel, Ties
from vislam2tag.estimation.dead_reckoning.features import WindowFeatures
from vislam2tag.estimation.dead_reckoning.gait import turned_by_gait
from vislam2tag.estimation.dead_reckoning.heading import Headings
from vislam2tag.estimation.dead_reckoning.nodes import Nodes
from vislam2tag.estimation.dead_reckoning.settings import DeadReckoningSettings
from vislam2tag.estimation.dead_reckoning.shared_ways import SharedLines
from vislam2tag.estimation.dead_reckoning.signals import WalkSignals
from vislam2tag.estimation.dead_reckoning.smoothing import SmoothedPath, smooth_path
from vislam2tag.estimation.dead_reckoning.speed import SpeedModel
from vislam2tag.estimation.dead_reckoning.walls import Walls

MOVING = 0.5
"""From here on somebody rather walks than stands."""
BEYOND_S = 2.0
"""A fix this long before the first reading or after the last one still holds there."""


@dataclass(frozen=True)
class SensedWalk:
    """What a walk's sensors say without its fixes: where it could have led, but for a turn and a place to start."""

    signals: WalkSignals
    headings: Headings
    features: WindowFeatures

    @classmethod
    def of(cls, log: InertialLog) -> SensedWalk | None:
        """Read the sensors; None where they have no few seconds in common, or values that no walk has."""
        signals = WalkSignals.of(log)
        if signals is None:
            return None
        headings = Headings.of(signals, log)
        features = WindowFeatures.of(signals, headings.up)
        turned_rad = turned_by_gait(signals, headings.up, features)
        return cls(signals, replace(headings, drift_rad=headings.drift_rad + turned_rad), features)

    def usable(self, fixes: FixLog) -> BoolArray:
        """Mask (k,) of the fixes that lie within the walk."""
        at = self._moments(fixes)
        return np.asarray((at > -BEYOND_S) & (at < self.signals.time_s[-1] + BEYOND_S))

    def path(
        self,
        fixes: FixLog,
        speed: SpeedModel,
        settings: DeadReckoningSettings,
        area: WalkableArea | None = None,
        ways: WalkedWays | None = None,
    ) -> ReckonedWalk:
        """Find the path through the fixes, all of which must be usable, and one at least.

        It keeps between an area's walls; without them it is drawn sideways onto the lines of others (``ways``).
        """
        at_s = self._moments(fixes).clip(0, self.signals.time_s[-1]).round(2)
        speed_m_s = speed.speed_m_s(self.features, self.signals.time_s)
        nodes = Nodes.of(self.signals, self.headings, self.features, speed_m_s, at_s)
        told = np.nan if fixes.sigma_m is None else fixes.sigma_m / settings.fix_sigma_m
        share = np.where(np.isnan(told), 1.0, told)
        ties = Ties(nodes.index_of(at_s), as_complex(fixes.position_bcs), settings.fix_sigma_m, share)
        walls = None if area is None or not settings.plan_prior else Walls(area, settings.wall_distance_m)
        if walls is not None and not walls.fit(ties.position):
            walls = None
        model = PathModel(nodes, settings, walls)
        alone = ReckonedWalk(self, model, ties, smooth_path(model, ties), fixes.name)
        if ways is None or not len(ways.walk) or walls is not None:
            return alone  # beside walls others tell nothing (benchmarks/NOTES.md)
        lines = SharedLines.of(ways, alone.path.state.position, alone.node_course)
        helped = replace(model, lines=lines)
        return replace(alone, model=helped, path=smooth_path(helped, ties))

    def _moments(self, fixes: FixLog) -> FloatArray:
        """When (k,) the walker was at the fixes, seconds since the start."""
        return np.asarray((fixes.time_ns - self.signals.start_ns) * 1e-9)


@dataclass(frozen=True)
class ReckonedWalk:
    """A walk's path through its fixes, found by a model; ``names`` (f,) is what these are called."""

    sensed: SensedWalk
    model: PathModel
    ties: Ties
    path: SmoothedPath
    names: tuple[str, ...]

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (m, 2) in the BCS, metres, and covariances (m, 2, 2) at moments (m,) within the walk.

        The covariance is that of a fix's distance from the path: what the path does not know and how far fixes
        scatter, since nothing else shows where the walker was.
        """
        scatter = self.path.scatter_m[:, None, None] ** 2 * np.eye(2)
        return self._between(self.positions, time_s), self._between(self._covering + scatter, time_s)

    @property
    def nodes(self) -> Nodes:
        """The moments at which the path is known."""
        return self.model.nodes

    @cached_property
    def _covering(self) -> FloatArray:
        """(k, 2, 2) covariance of each node that also covers unusual walkers, without the scatter of fixes."""
        return covering_covariance(self.path, self.model, self.ties)

    @property
    def fix_scatter_m(self) -> FloatArray:
        """(f,) how far each fix is expected to be, per axis, from where the walker was, metres."""
        return np.asarray(self.path.scatter_m[self.ties.node] * self.ties.share)

    @property
    def positions(self) -> FloatArray:
        """(k, 2) position of each node in the BCS, metres."""
        return as_points(self.path.state.position)

    @property
    def course_rad(self) -> FloatArray:
        """(n,) direction in the BCS that the walker goes to at each moment of the signals."""
        state = self.path.state
        frame = np.interp(self.sensed.signals.time_s, self.nodes.time_s, state.heading_rad + state.offset_rad)
        return np.asarray(frame + self.sensed.headings.turned_rad)

    @property
    def node_course(self) -> ComplexArray:
        """(k,) direction in the BCS that the walker goes to at each node, unit; 0 where nobody walks."""
        course = np.interp(self.nodes.time_s, self.sensed.signals.time_s, self.course_rad)
        moving = np.interp(self.nodes.time_s, self.sensed.features.time_s, self.sensed.features.moving) > MOVING
        return np.asarray(moving * np.exp(1j * course))

    def way(self) -> WalkedWays:
        """Where the walk led, for others on its floor."""
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
