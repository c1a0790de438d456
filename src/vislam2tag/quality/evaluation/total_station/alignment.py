"""A device's walks in a total station's view: one clock for all, and the camera's true places.

What a walk is compared with never comes from that walk's own errors: clock and prism are estimated anew without each
fold (a walk; a part of one where there are few), and the fold is placed by the rest. The scatter of these estimates is
their uncertainty (jackknife, Efron 1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.point_errors import heading_of, walking_velocity
from vislam2tag.quality.evaluation.total_station.fit import (
    Adjustment,
    FreeParameters,
    TrackSegment,
    errors_m,
    fit_adjustment,
    mean_clipped_error_m,
    search_clock,
)
from vislam2tag.quality.evaluation.total_station.frame import StationFrame
from vislam2tag.quality.evaluation.total_station.station_file import StationTrack
from vislam2tag.quality.evaluation.truth import Truth

FEWEST_FOLDS = 4
"""Where a device has fewer walks, each is cut into parts."""
FEWEST_POINTS = 10
"""Of a track that overlaps with its walk."""
MATCHES_M = 3.0
"""At least one walk's labels must be as near to the station's track, on average, metres."""
OTHER_CLOCK_S = 2.0
"""A walk has another clock than the rest where its own best offset is farther off than this, seconds, ..."""
OTHER_CLOCK_FACTOR = 4.0
"""... and its error there so many times less."""

STRAIGHT = 0.95
"""Walking is steady where one gets on by at least so much of the way made, over a stride or so."""


@dataclass(frozen=True)
class StationWalk:
    """A session before the station: its labels by the strategy to align with, its track and the station's frame."""

    reference: Trajectory
    track: StationTrack
    frame: StationFrame


@dataclass(frozen=True)
class UncertainValue:
    """A value and its standard deviation."""

    value: float
    sigma: float


@dataclass(frozen=True)
class PrismOffset:
    """Where the prism is as seen from the camera, in the walking frame, metres."""

    ahead_m: UncertainValue
    left_m: UncertainValue


@dataclass(frozen=True)
class DeviceAlignment:
    """What was estimated for a device, and its walks' truth."""

    adjustment: Adjustment
    """By all walks; each truth is by those but its own fold."""
    clock_sigma_s: float
    drift_ppm: UncertainValue | None
    """None where the clocks were taken to run alike."""
    prism: PrismOffset
    """Estimated in any case; corrected for only where asked for."""
    prism_applied: bool
    folds: int
    truths: tuple[Truth | None, ...]
    """For each walk the camera's true places on the labels' clock; None where it shares no clock with the rest."""
    off_s: tuple[float, ...]
    """For each walk how far the clock that would suit it best, to half a second, is from that of all."""


def align_device(walks: Sequence[StationWalk], freedom: FreeParameters | None = None) -> DeviceAlignment:
    """Estimate the clock of a device's walks (at least one) and place their tracks in time and building.

    ``freedom.prism`` also takes the prism's offset off. Raises SurveyError where no clock brings track and labels
    together.
    """
    freedom = freedom or FreeParameters()
    segments = [track_segment_of(walk.reference, walk.track, walk.frame.bcs_t_station) for walk in walks]
    own = [search_clock(segment) for segment in segments]
    clock_ns = min(own, key=lambda offset: sum(mean_clipped_error_m(segment, offset) for segment in segments))
    if min(_labelled_error_m(segment, clock_ns) for segment in segments) > MATCHES_M:
        raise SurveyError(
            "the total station's track matches the labels at no clock offset: are tachy.csv, the station's common "
            "points and the session of one measurement?"
        )
    matched = [_shares_clock(segment, clock_ns, offset) for segment, offset in zip(segments, own, strict=True)]
    start = Adjustment(int(segments[matched.index(True)].time_ns[0]), clock_ns)
    folds = _folds([i for i, fits in enumerate(matched) if fits], [len(segment.time_ns) for segment in segments])
    parts = [segments[walk].part(rows) for walk, rows in folds]
    best, without = _cross_validated(parts, start, freedom)
    free, free_without = _cross_validated(parts, start, replace(freedom, prism=True))
    truths = [
        _truth(parts, without, [i for i, (walk, _) in enumerate(folds) if walk == one]) for one in range(len(walks))
    ]
    drift = _estimate(best.drift_ppm, [one.drift_ppm for one in without]) if freedom.drift else None
    return DeviceAlignment(
        adjustment=best,
        clock_sigma_s=_jackknife_sigma([(one.clock_ns - best.clock_ns) * 1e-9 for one in without]),
        drift_ppm=drift,
        prism=PrismOffset(
            _estimate(free.ahead_m, [one.ahead_m for one in free_without]),
            _estimate(free.left_m, [one.left_m for one in free_without]),
        ),
        prism_applied=freedom.prism,
        folds=len(folds),
        truths=tuple(truths),
        off_s=tuple((offset - clock_ns) * 1e-9 for offset in own),
    )


def _labelled_error_m(segment: TrackSegment, clock_ns: int) -> float:
    """Mean error of the points with a label at this offset; infinite where there are too few."""
    errors = errors_m(segment, clock_ns)
    labelled = errors[np.isfinite(errors)]
    return float(labelled.mean()) if len(labelled) >= FEWEST_POINTS else float("inf")


def _shares_clock(segment: TrackSegment, clock_ns: int, own_ns: int) -> bool:
    """Tell whether a walk overlaps with its track at the common offset, and no other one is right beyond doubt.

    Large errors are no reason: they may be the labels'.
    """
    time_ns, frames_ns = segment.time_ns - clock_ns, segment.reference.time_ns
    inside = (time_ns >= frames_ns.min()) & (time_ns <= frames_ns.max())
    far = abs(own_ns - clock_ns) > OTHER_CLOCK_S * 1e9
    own_m, common_m = mean_clipped_error_m(segment, own_ns), mean_clipped_error_m(segment, clock_ns)
    return int(inside.sum()) >= FEWEST_POINTS and not (far and own_m < common_m / OTHER_CLOCK_FACTOR)


def track_segment_of(reference: Trajectory, track: StationTrack, bcs_T_station: Similarity2) -> TrackSegment:
    """Put a station's track into the building, and find where and which way it was walked steadily."""
    time_ns, prism = track.time_ns, bcs_T_station @ track.position
    velocity = walking_velocity(time_ns, time_ns, prism)
    known = np.flatnonzero(np.isfinite(heading_of(velocity)) & _steady(time_ns, prism, velocity))
    ahead, steady = np.zeros_like(prism), np.zeros(len(prism), dtype=np.bool_)
    steady[known] = True
    if len(known):
        # Who stands still or turns is taken to look as shortly before or after.
        nearest = known[np.searchsorted((known[1:] + known[:-1]) / 2, np.arange(len(prism)))]
        ahead = velocity[nearest] / np.linalg.norm(velocity[nearest], axis=1, keepdims=True)
    return TrackSegment(reference, time_ns, prism, ahead, steady)


def _steady(time_ns: IntArray, prism_bcs: FloatArray, velocity_bcs: FloatArray) -> BoolArray:
    """Mask (k,) of the points about which the way is hardly longer than straight."""
    steps = np.linalg.norm(np.diff(prism_bcs, axis=0, prepend=prism_bcs[:1]), axis=1)
    way = np.column_stack((np.cumsum(steps), np.zeros_like(steps)))
    speed = walking_velocity(time_ns, time_ns, way)[:, 0]
    return np.asarray(np.linalg.norm(velocity_bcs, axis=1) > STRAIGHT * speed)


def _folds(walks: list[int], points: list[int]) -> list[tuple[int, slice]]:
    """Walks, or equal parts of them where there are few: which walk, and which of its points."""
    parts = -(-FEWEST_FOLDS // len(walks))
    cuts = {walk: np.linspace(0, points[walk], parts + 1).round().astype(int).tolist() for walk in walks}
    return [(walk, slice(cuts[walk][i], cuts[walk][i + 1])) for walk in walks for i in range(parts)]


def _cross_validated(
    parts: list[TrackSegment], start: Adjustment, freedom: FreeParameters
) -> tuple[Adjustment, list[Adjustment]]:
    """The adjustment by all parts, and for each part that by the others."""
    best = fit_adjustment(parts, start, freedom)
    others = [parts[:i] + parts[i + 1 :] for i in range(len(parts))]
    return best, [fit_adjustment(rest, start, freedom) for rest in others]


def _truth(parts: list[TrackSegment], adjustments: list[Adjustment], mine: list[int]) -> Truth | None:
    """Put the folds of one walk together, each placed by the adjustment that does not know it."""
    if not mine:
        return None
    time_ns = np.concatenate([adjustments[i].label_time_ns(parts[i].time_ns) for i in mine])
    camera = np.concatenate([adjustments[i].camera_bcs(parts[i]) for i in mine])
    time_ns, first = np.unique(time_ns, return_index=True)
    return Truth(time_ns, camera[first])


def _estimate(value: float, without: list[float]) -> UncertainValue:
    return UncertainValue(value, _jackknife_sigma(without))


def _jackknife_sigma(without: Sequence[float]) -> float:
    """Standard deviation of an estimate, from those that leave out one fold each."""
    values: FloatArray = np.array(without)
    count = len(values)
    return float(np.sqrt((count - 1) / count * np.sum((values - values.mean()) ** 2)))
