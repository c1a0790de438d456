"""Label errors against a total station's track, at the station's rate (paper, section VI-B)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.labeling.settings import TruthSettings
from vislam2tag.quality.evaluation.station_clock import (
    DeviceAlignment,
    StationWalk,
    mean_clipped_error_m,
    search_clock,
    track_segment_of,
)
from vislam2tag.quality.evaluation.station_frame import StationTrack, frame_findings
from vislam2tag.quality.evaluation.truth import (
    MAX_GAP_S,
    PointErrors,
    Truth,
    TruthKind,
    walking_velocity,
)

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
        message = "rows without a finite position, or not later than one before; they are left out"
        findings.append(_finding("station_rows", walk.track.left_out, message, Severity.INFO))
    if alignment.truths[number] is None:
        message = (
            f"the station's track never meets this walk on the clock of the device's other walks (its own would be "
            f"{alignment.off_s[number]:+.1f} s off): was the phone restarted or a clock set? Not scored"
        )
        findings.append(_finding("station_no_overlap", 1, message, Severity.WARNING))
    elif alignment.clock_sigma_s > UNSURE_CLOCK_S:
        message = (
            f"the station's clock is known to {alignment.clock_sigma_s:.2f} s only: its errors hold as much walking"
        )
        findings.append(_finding("station_clock", 1, message, Severity.WARNING))
    return findings


def _finding(kind: FindingKind, count: int, message: str, severity: Severity) -> Finding:
    return Finding(kind=kind, file="tachy.csv", count=count, message=message, severity=severity)
