"""A session reduced to the input of the mapping: a continuous path and passes of landmarks.

A pass contains the sightings of a sheet while the camera went by, condensed to one observation, because hundreds of
neighbouring frames share their error. Only rows count in which the sheet was seen at that moment, close enough.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_SOLVER_BLOCKS
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.map_moves import group_sums, orientation_is_estimated, seen_rows, sheet_heading
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.estimation.tracker_errors import DriftSource

PAUSE_S = 2.0
"""A landmark that is not seen for longer than this is passed again."""
NEAR_M = 0.5
"""Closer sightings have larger weights, up to this distance."""
LEVEL = 0.5
"""A sheet whose X axis is shorter than this in the plane lies flat and has no heading."""


@dataclass(frozen=True)
class Passes:
    """``p`` passes sorted by step index; positions relative to the camera, in the continuous frame.

    ``at`` (p,) is the index into the odometry's frames of the closest approach; ``landmark`` (p,) the index into the
    log's ids. ``offset`` (p,) complex, metres, is from the camera then to the landmark; ``heading`` (p,) complex, unit,
    the sheet's X axis (0 if none is logged). ``distance_m`` (p,) is that of the closest approach; ``spread_m`` (p,) the
    root mean square scatter of the sightings per axis; ``count`` (p,) their number.
    """

    at: IntArray
    landmark: IntArray
    offset: ComplexArray
    heading: ComplexArray
    distance_m: FloatArray
    spread_m: FloatArray
    count: IntArray

    def select(self, rows: IntArray) -> Passes:
        """Some of the passes (ascending)."""
        return Passes(**{name: column[rows] for name, column in vars(self).items()})

    def with_more(self, others: Passes) -> Passes:
        """These and others, in the order of their frames."""
        order = np.argsort(np.concatenate((self.at, others.at)), kind="stable")
        return Passes(**{name: np.concatenate((own, getattr(others, name)))[order] for name, own in vars(self).items()})


def find_passes(camera: CameraTrack, log: LandmarkLog, odometry: Odometry, range_m: float) -> Passes:
    """Condense the sightings within ``range_m`` (horizontal, metres) to passes.

    If the tracker jumps during a pass, only sightings on the side of the closest approach count.
    """
    frame = np.full(len(camera.time_ns), -1, dtype=np.int64)
    frame[odometry.frame] = np.arange(len(odometry.frame))
    rows, away, distance = _sightings_within(range_m, camera, log, odometry.rewritten[frame[log.frame]])
    at = frame[log.frame[rows]]
    group, count = _groups(log.landmark[rows], odometry.time_s[at])
    start = np.searchsorted(group, np.arange(count))
    nearest = np.lexsort((distance, group))[start]
    jumps_before = np.concatenate(([0], np.cumsum(odometry.jumped)))[at]
    counts = jumps_before == jumps_before[nearest][group]
    weight = counts / (NEAR_M**2 + distance**2)
    place = odometry.path[at] + odometry.turn[at] * away
    mean = _mean(place, weight, group, count)
    spread = np.sqrt(_mean(np.abs(place - mean[group]) ** 2 + 0j, weight, group, count).real / 2)
    passes = Passes(
        at=at[nearest],
        landmark=log.landmark[rows[start]],
        offset=mean - odometry.path[at[nearest]],
        heading=_mean_heading(log, rows, odometry.turn[at], weight, group, count),
        distance_m=distance[nearest],
        spread_m=spread,
        count=np.bincount(group, counts, count).astype(np.int64),
    )
    return passes.select(np.argsort(passes.at, kind="stable"))


def _sightings_within(
    range_m: float, camera: CameraTrack, log: LandmarkLog, rewritten: BoolArray
) -> tuple[IntArray, ComplexArray, FloatArray]:
    """Valid rows (r,) of a log, the landmark's offset from the camera in each, complex metres, and its distance."""
    rows = seen_rows(log, rewritten)
    away = as_complex(log.plane_acs[rows]) - as_complex(camera.plane_acs[log.frame[rows]])
    distance = np.abs(away)
    near = distance < range_m
    return rows[near], away[near], distance[near]


def _mean_heading(
    log: LandmarkLog, rows: IntArray, turn: ComplexArray, weight: FloatArray, group: IntArray, count: int
) -> ComplexArray:
    """X axes (p,) of the sheets, complex, unit; 0 for flat sheets and orientations that are not estimated."""
    heading = _mean(turn * sheet_heading(log.orientation_acs[rows]), weight, group, count)
    heading *= orientation_is_estimated(log)
    return np.where(np.abs(heading) > LEVEL, heading / np.maximum(np.abs(heading), LEVEL), 0)


def _groups(landmark: IntArray, time_s: FloatArray) -> tuple[IntArray, int]:
    """Number the passes (r,) of sightings sorted by landmark and time, and count them."""
    new = (np.diff(landmark) != 0) | (np.diff(time_s) > PAUSE_S)
    group = np.concatenate((np.zeros(min(len(landmark), 1), dtype=np.int64), np.cumsum(new)))
    return group, int(group[-1]) + 1 if len(group) else 0


def _mean(values: ComplexArray, weight: FloatArray, group: IntArray, count: int) -> ComplexArray:
    """Means (p,) of complex values (r,) by weights (r,) over ``count`` groups, which ``group`` (r,) numbers."""
    return np.asarray(group_sums(group, weight * values, count) / np.bincount(group, weight, count))


METRES_PER_RAD = 4.0
"""A turn of one radian adds as much heading drift as walking this far, because images blur and the view changes."""
METRES_PER_S = 0.02
"""Standing adds as much drift as walking this fast."""
FEWEST_FRAMES = 2
"""A walk has at least one step."""
GREATEST_TURN_RAD = 0.3
"""Turns in a step count up to this; larger logged ones are implausible."""


@dataclass(frozen=True)
class WalkObservations:
    """A session's odometry, its passes, and the ids of the passes' landmark indices."""

    ids: tuple[str, ...]
    odometry: Odometry
    passes: Passes
    passes_left_out: int = 0
    """Number of passes that were dropped, because there are more than can be solved for."""

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

        The odometry is the tracker's if none is given. If there are more landmarks than can be solved for, ``surveyed``
        ones have priority.
        """
        odometry = continuous_odometry(camera, log) if odometry is None else odometry
        return cls(log.ids, odometry, find_passes(camera, log, odometry, range_m)).within_limits(surveyed)

    def within_limits(self, surveyed: Collection[str]) -> WalkObservations:
        """Return the observations with no more passes and landmarks than can be solved for.

        Unsurveyed landmarks that were passed once are removed first, because they do not affect the walk; then passes,
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
        """Return the observations with the first passes only."""
        if len(self.passes.at) <= most:
            return self
        left_out = self.passes_left_out + len(self.passes.at) - most
        return WalkObservations(self.ids, self.odometry, self.passes.select(np.arange(most)), left_out)

    def with_places(self, at: IntArray) -> WalkObservations:
        """Add a pass at each of some frames (k,), of a new landmark at the camera."""
        count = len(at)
        zeros, nowhere = np.zeros(count), np.zeros(count, dtype=np.complex128)
        own = len(self.ids) + np.arange(count)
        places = Passes(at, own, nowhere, nowhere, zeros, zeros, np.ones(count, dtype=np.int64))
        return replace(self, ids=(*self.ids, *("" for _ in range(count))), passes=self.passes.with_more(places))

    def scaled(self, scale: float) -> WalkObservations:
        """The walk, and what it saw, made so many times as large."""
        odometry = replace(
            self.odometry,
            path=self.odometry.path * scale,
            step_length_m=self.odometry.step_length_m * scale,
            doubt=self.odometry.doubt * scale,
        )
        return replace(self, odometry=odometry, passes=replace(self.passes, offset=self.passes.offset * scale))

    def _solvable(self) -> bool:
        return len(self.passes.at) * len(self.ids) ** 2 <= MAX_SOLVER_BLOCKS

    def _with_passes(self, rows: IntArray) -> WalkObservations:
        """Select some of the passes, and their landmarks."""
        passes = self.passes.select(rows)
        kept, landmark = np.unique(passes.landmark, return_inverse=True)
        ids = tuple(self.ids[i] for i in kept.tolist())
        left_out = self.passes_left_out + len(self.passes.at) - len(rows)
        return WalkObservations(ids, self.odometry, replace(passes, landmark=landmark.astype(np.int64)), left_out)

    @cached_property
    def nodes(self) -> IntArray:
        """(p + 2,) frames of the solved states: the first one, one for each pass, the last one."""
        return np.concatenate(([0], self.passes.at, [len(self.odometry.path) - 1])).astype(np.int64)

    @cached_property
    def step_variance(self) -> dict[DriftSource, FloatArray]:
        """For each source except slips the variances (n - 1,) of the steps: at unit level, or as given with a jump."""
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
