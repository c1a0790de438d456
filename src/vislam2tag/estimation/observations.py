"""A session reduced to what mapping needs of it: a continuous path and passes of landmarks."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.limits import MAX_SOLVER_BLOCKS
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.noise import DriftSource
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.estimation.passes import Passes, find_passes

METRES_PER_RAD = 4.0
"""Turning by a radian lets the heading drift as much as walking this far: images blur, and what was in view leaves."""
METRES_PER_S = 0.02
"""Standing lets everything drift as much as walking this fast."""
FEWEST_FRAMES = 2
"""A walk has a step at least."""
GREATEST_TURN_RAD = 0.3
"""Turns count up to this in a step: beyond, the logged orientation is not to be believed."""


@dataclass(frozen=True)
class WalkObservations:
    """A session's odometry, its passes and the ids that the passes' landmark indices mean."""

    ids: tuple[str, ...]
    odometry: Odometry
    passes: Passes
    passes_left_out: int = 0
    """Passes beyond those that can be solved for."""

    @classmethod
    def of(
        cls,
        camera: CameraTrack,
        log: LandmarkLog,
        range_m: float,
        odometry: Odometry | None = None,
        surveyed: Collection[str] = (),
    ) -> WalkObservations:
        """Reduce a session with two or more usable frames; sightings count within ``range_m`` (metres).

        The odometry is the tracker's where none is given. ``surveyed`` landmarks count most where there are more than
        can be solved for.
        """
        odometry = continuous_odometry(camera, log) if odometry is None else odometry
        return cls(log.ids, odometry, find_passes(camera, log, odometry, range_m)).within_limits(surveyed)

    def within_limits(self, surveyed: Collection[str]) -> WalkObservations:
        """The same with no more passes and landmarks than can be solved for.

        A landmark that is not surveyed and was passed once says nothing of the walk, so it goes first; then passes go,
        evenly over the walk.
        """
        if self._solvable():
            return self
        often = np.bincount(self.passes.landmark, minlength=len(self.ids)) > 1
        tells = often | np.array([name in surveyed for name in self.ids], dtype=np.bool_)
        less = self._with_passes(np.flatnonzero(tells[self.passes.landmark]))
        if less._solvable():
            return less
        most = max(1, MAX_SOLVER_BLOCKS // len(less.ids) ** 2)
        return less._with_passes(np.linspace(0, len(less.passes.at) - 1, most).astype(np.int64))

    def first(self, most: int) -> WalkObservations:
        """The same with the first passes only."""
        if len(self.passes.at) <= most:
            return self
        left_out = self.passes_left_out + len(self.passes.at) - most
        return WalkObservations(self.ids, self.odometry, self.passes.select(np.arange(most)), left_out)

    def _solvable(self) -> bool:
        return len(self.passes.at) * len(self.ids) ** 2 <= MAX_SOLVER_BLOCKS

    def _with_passes(self, rows: IntArray) -> WalkObservations:
        """The same with some of the passes, and the landmarks that they are of."""
        passes = self.passes.select(rows)
        kept, landmark = np.unique(passes.landmark, return_inverse=True)
        ids = tuple(self.ids[i] for i in kept.tolist())
        left_out = self.passes_left_out + len(self.passes.at) - len(rows)
        return WalkObservations(ids, self.odometry, replace(passes, landmark=landmark.astype(np.int64)), left_out)

    @cached_property
    def nodes(self) -> IntArray:
        """(p + 2,) frames at which the state is solved for: the first one, one a pass, the last one."""
        return np.concatenate(([0], self.passes.at, [len(self.odometry.path) - 1])).astype(np.int64)

    @cached_property
    def step_variance(self) -> dict[DriftSource, FloatArray]:
        """For each source but doubts the variances (n - 1,) of the steps: at unit level, or as given with each jump."""
        odometry = self.odometry
        way = odometry.step_length_m + METRES_PER_S * np.diff(odometry.time_s)
        turning = METRES_PER_RAD * np.minimum(odometry.turned_rad, GREATEST_TURN_RAD)
        return {
            DriftSource.POSITION: way,
            DriftSource.HEADING: way + turning,
            DriftSource.SCALE: way,
            DriftSource.JUMP: odometry.jump_m2,
            DriftSource.JUMP_TURN: odometry.jump_rad2,
        }
