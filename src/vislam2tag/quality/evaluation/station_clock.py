"""A device's walks in a total station's view: one clock for all (and the prism's place), true places, label errors.

The truth of a walk never depends on that walk's own errors. Clock and prism are estimated again without each fold (a
walk, or a part of one if there are few), and the fold is placed by the rest. The scatter of these estimates is their
uncertainty (jackknife, Efron 1982). Label errors are taken at the station's rate (paper, section VI-B).
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, with_rows
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.labeling.settings import TruthSettings
from vislam2tag.quality.evaluation.station_frame import StationFrame, StationTrack, frame_findings
from vislam2tag.quality.evaluation.truth import MAX_GAP_S, PointErrors, Truth, TruthKind, heading_of, walking_velocity

_log = logging.getLogger(__name__)
CLIP_M = 5.0
"""Errors count at most this much in the search: a wrongly mapped stretch must not decide it."""
GRID_S = 0.5
"""Step of the search."""
SEARCHED = 300
"""Measured points that the search looks at in each walk."""
TYPICAL_M = 0.15
"""Errors above this count linearly in the fit, not by their square."""
STEP_NS = 50_000_000
"""Half the time over which the labels' velocity is taken."""
PPM = 1e-6
"""A part per million."""


@dataclass(frozen=True)
class TrackSegment:
    """A walk, or a part of it, with the station's track: the labels to fit to, and ``k`` measured points.

    ``time_ns`` (k,) the station's wall clock; ``prism_bcs`` (k, 2) metres; ``ahead`` (k, 2) unit vector of walking,
    which is sure only where ``steady`` (k,): not in turns, and not where one stands.
    """

    reference: Trajectory
    time_ns: IntArray
    prism_bcs: FloatArray
    ahead: FloatArray
    steady: BoolArray

    def part(self, rows: slice | BoolArray) -> TrackSegment:
        """Only some of the measured points: a slice or mask (k,)."""
        return with_rows(self, rows, "time_ns", "prism_bcs", "ahead", "steady")

    @property
    def left(self) -> FloatArray:
        """Unit vector (k, 2) to the left of walking."""
        return np.column_stack((-self.ahead[:, 1], self.ahead[:, 0]))


@dataclass(frozen=True)
class FreeParameters:
    """What is estimated beside the clock's offset."""

    drift: bool = False
    """The clocks' rates differ."""
    prism: bool = False
    """The prism is not at the camera."""


@dataclass(frozen=True)
class Adjustment:
    """From a measured point to where and when the camera was.

    ``clock_ns`` is the station's wall clock minus the clock of the labels at wall time ``epoch_ns``, growing by
    ``drift_ppm``; the prism is ``ahead_m`` before and ``left_m`` to the left of the camera, as one walks.
    """

    epoch_ns: int
    clock_ns: int
    drift_ppm: float = 0.0
    ahead_m: float = 0.0
    left_m: float = 0.0

    def label_time_ns(self, time_ns: IntArray) -> IntArray:
        """Times (k,) on the labels' clock of the station's times (k,)."""
        grown = np.round((time_ns - self.epoch_ns) * (self.drift_ppm * PPM)).astype(np.int64)
        return np.asarray(time_ns - self.clock_ns - grown)

    def camera_bcs(self, segment: TrackSegment) -> FloatArray:
        """Where the camera was (k, 2), metres."""
        return segment.prism_bcs - self.ahead_m * segment.ahead - self.left_m * segment.left


def errors_m(segment: TrackSegment, clock_ns: int) -> FloatArray:
    """Distance (k,) between each measured point and the label at its time, with this offset; NaN without a label."""
    labels = label_by_interpolation(segment.time_ns - clock_ns, segment.reference, MAX_GAP_S).position_bcs[:, :2]
    return np.asarray(np.linalg.norm(labels - segment.prism_bcs, axis=1))


def mean_clipped_error_m(segment: TrackSegment, clock_ns: int) -> float:
    """Mean error of a segment with this offset, each at most :data:`CLIP_M`, as is a point without a label."""
    return float(np.nan_to_num(errors_m(segment, clock_ns), nan=CLIP_M).clip(max=CLIP_M).mean())


def search_clock(segment: TrackSegment) -> int:
    """The offset (ns) with the least error among all at which track and walk overlap, to :data:`GRID_S`."""
    thinned = segment.part(slice(None, None, len(segment.time_ns) // SEARCHED + 1))
    track_ns, walk_ns = segment.time_ns, segment.reference.time_ns
    offsets = np.arange(track_ns[0] - walk_ns.max(), track_ns[-1] - walk_ns.min(), round(GRID_S * 1e9), dtype=np.int64)
    return int(min(offsets.tolist(), key=lambda offset: mean_clipped_error_m(thinned, offset)))


def fit_adjustment(segments: Sequence[TrackSegment], start: Adjustment, freedom: FreeParameters) -> Adjustment:
    """Least robust squares of label minus camera over all points passed steadily, from a start within a second or so.

    Points without a label there do not count.
    """
    steady = [segment.part(segment.steady) for segment in segments]
    free = np.array([True, freedom.drift, freedom.prism, freedom.prism])

    def at(values: FloatArray) -> Adjustment:
        every = np.zeros(len(free))
        every[free] = values
        clock_s, drift_ppm, ahead_m, left_m = every.tolist()
        return Adjustment(start.epoch_ns, start.clock_ns + round(clock_s * 1e9), drift_ppm, ahead_m, left_m)

    def residual(values: FloatArray) -> FloatArray:
        return np.concatenate([_residual(segment, at(values)).ravel() for segment in steady])

    def jacobian(values: FloatArray) -> FloatArray:
        return np.concatenate([_jacobian(segment, at(values)) for segment in steady])[:, free]

    start_at = np.zeros(int(free.sum()))
    robust = least_squares(residual, start_at, jac=jacobian, loss="soft_l1", f_scale=TYPICAL_M, x_scale="jac")
    if not robust.success:
        _log.warning("the total station's clock and frame did not converge: %s", robust.message)
    return at(np.asarray(robust.x))


def _residual(segment: TrackSegment, adjustment: Adjustment) -> FloatArray:
    """Label minus camera (k, 2), metres; 0 without a label."""
    time_ns = adjustment.label_time_ns(segment.time_ns)
    labels = label_by_interpolation(time_ns, segment.reference, MAX_GAP_S).position_bcs[:, :2]
    return np.nan_to_num(labels - adjustment.camera_bcs(segment))


def _jacobian(segment: TrackSegment, adjustment: Adjustment) -> FloatArray:
    """Derivative (2k, 4) of the residual by clock (s), drift (ppm), ahead and left (m)."""
    time_ns = adjustment.label_time_ns(segment.time_ns)
    ends = [label_by_interpolation(time_ns + step, segment.reference, MAX_GAP_S) for step in (-STEP_NS, STEP_NS)]
    velocity = np.nan_to_num((ends[1].position_bcs - ends[0].position_bcs)[:, :2] / (2e-9 * STEP_NS))
    since_s = (segment.time_ns - adjustment.epoch_ns) * 1e-9
    columns = (-velocity, -velocity * (since_s * PPM)[:, None], segment.ahead, segment.left)
    return np.stack(columns, axis=-1).reshape(-1, 4)


FEWEST_FOLDS = 4
"""Where a device has fewer walks, each is cut into parts."""
FEWEST_POINTS = 10
"""Of a track that overlaps with its walk."""
MATCHES_M = 3.0
"""At least one walk's labels must be as near to the station's track, on average, metres."""
OTHER_CLOCK_S = 2.0
"""A walk has another clock than the rest where its own best offset is further off than this, seconds, ..."""
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


class UncertainValue(NamedTuple):
    """A value and its standard deviation."""

    value: float
    sigma: float


@dataclass(frozen=True)
class DeviceAlignment:
    """What was estimated for a device, and its walks' truth."""

    adjustment: Adjustment
    """By all walks; each truth is by those but its own fold."""
    clock_sigma_s: float
    drift_ppm: UncertainValue | None
    """None where the clocks were taken to run alike."""
    prism_ahead_m: UncertainValue
    """How far the prism is before the camera as one walks; estimated in any case, corrected for only if asked for."""
    prism_left_m: UncertainValue
    """How far it is to the left."""
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
            "the total station's track does not match the labels at any clock offset. Check that tachy.csv, the "
            "station's common points and the session are of the same measurement"
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
    return DeviceAlignment(
        adjustment=best,
        clock_sigma_s=_jackknifed(0.0, [(one.clock_ns - best.clock_ns) * 1e-9 for one in without]).sigma,
        drift_ppm=_jackknifed(best.drift_ppm, [one.drift_ppm for one in without]) if freedom.drift else None,
        prism_ahead_m=_jackknifed(free.ahead_m, [one.ahead_m for one in free_without]),
        prism_left_m=_jackknifed(free.left_m, [one.left_m for one in free_without]),
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
    """Return whether a walk overlaps with its track at the common offset, and no other one is right beyond doubt.

    Large errors are not a reason: they may be the labels'.
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


def _jackknifed(value: float, without: Sequence[float]) -> UncertainValue:
    """An estimate with its standard deviation, from those that leave out one fold each."""
    values: FloatArray = np.array(without)
    count = len(values)
    return UncertainValue(value, float(np.sqrt((count - 1) / count * np.sum((values - values.mean()) ** 2))))


JUMP_M = 2.0
"""``local-corrected`` discards longer steps than this in the paper's total-station evaluation, metres."""
UNSURE_CLOCK_S = 0.1
"""A clock less certain than this is a finding, seconds: at walking speed it is 10 cm."""


def station_point_errors(trajectory: Trajectory, truth: Truth) -> PointErrors:
    """Labels against the camera's true places (k, 2) that the station measured."""
    labels = label_by_interpolation(truth.time_ns, trajectory, MAX_GAP_S)
    velocity, own_m = walking_velocity(truth.time_ns, truth.time_ns, truth.position_bcs), truth.sigma_or(np.nan)
    return PointErrors.of((TruthKind.TOTAL_STATION, truth.time_ns, truth.position_bcs), labels, velocity, own_m)


def with_station_sigma(truth: Truth, alignment: DeviceAlignment, settings: TruthSettings) -> Truth:
    """Say of a truth by a station how exactly it is known: the track, the clock's error at the walker's speed, and the
    prism's distance from the camera where that is not taken off.
    """
    speed_m_s = np.linalg.norm(walking_velocity(truth.time_ns, truth.time_ns, truth.position_bcs), axis=1)
    clock_m2 = (alignment.clock_sigma_s * np.nan_to_num(speed_m_s)) ** 2 / 2
    prism_m = (alignment.prism_ahead_m.value, alignment.prism_left_m.value)
    prism_m2 = 0.0 if alignment.prism_applied else (prism_m[0] ** 2 + prism_m[1] ** 2) / 2
    return replace(truth, sigma_m=np.sqrt(settings.station_sigma_m**2 + clock_m2 + prism_m2))


def clock_offset(walks: Sequence[tuple[Trajectory, StationTrack]], bcs_T_station: Similarity2) -> int:
    """Find the one clock offset (ns) of walks with the least error over all of them, to ten milliseconds.

    The paper's rule: the offset is fitted to the very errors it is then used for. Everything else uses
    :func:`~vislam2tag.quality.evaluation.station_clock.align_device`.
    """
    segments = [track_segment_of(trajectory, track, bcs_T_station) for trajectory, track in walks]

    def cost(offset_ns: int) -> float:
        return sum(mean_clipped_error_m(segment, offset_ns) * len(segment.time_ns) for segment in segments)

    best = min((search_clock(segment) for segment in segments), key=cost)
    for reach_s, step_s in ((0.5, 0.05), (0.05, 0.01)):
        steps = np.arange(-reach_s, reach_s + step_s / 2, step_s)
        best = min((best + (steps * 1e9).astype(np.int64)).tolist(), key=cost)
    return int(best)


def station_findings(walk: StationWalk, alignment: DeviceAlignment, number: int) -> list[Finding]:
    """Report what is odd about a session before the station; ``number`` is its place among the device's walks."""
    findings = frame_findings(walk.frame)
    if walk.track.left_out:
        message = "rows have no finite position, or are not later than a preceding one; they are skipped"
        findings.append(_finding("station_rows", walk.track.left_out, message, Severity.INFO))
    if alignment.truths[number] is None:
        message = (
            "the station's track never meets this walk on the clock of the device's other walks (its own would be "
            f"{alignment.off_s[number]:+.1f} s off), so it is not scored. If the phone was restarted or its clock "
            "was set, move the session into a device folder of its own"
        )
        findings.append(_finding("station_no_overlap", 1, message, Severity.WARNING))
    elif alignment.clock_sigma_s > UNSURE_CLOCK_S:
        message = (
            f"the station's clock is uncertain by {alignment.clock_sigma_s:.2f} s, so its errors include the "
            "distance walked in that time"
        )
        findings.append(_finding("station_clock", 1, message, Severity.WARNING))
    return findings


def _finding(kind: FindingKind, count: int, message: str, severity: Severity) -> Finding:
    return Finding(kind=kind, file="tachy.csv", count=count, message=message, severity=severity)
