"""The station's frame without shots of fixed points: from presses at control points in its view.

Where the prism was at a press is only known with the clock, and the clock cannot be found by places without the frame.
So the clock comes from how fast phone and prism move, which is the same in any frame.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.control_points.press_truth import PressTruth
from vislam2tag.quality.evaluation.point_errors import usable_path, walking_velocity
from vislam2tag.quality.evaluation.total_station.frame import CommonPoints
from vislam2tag.quality.evaluation.total_station.station_file import StationTrack
from vislam2tag.quality.evaluation.truth import MAX_GAP_S

STEP_S = 0.1
"""Step of the speeds and of the search."""
FEWEST_S = 20.0
"""Track and walk must overlap for so long."""
MIN_CORRELATION = 0.6
"""Below this the two speeds are not of one motion."""
PRESS_RESIDUAL_M = 1.5
"""A press that fits the frame worse than this is odd: a finger is some tenths of a second off."""


def pressed_points(reference: Trajectory, track: StationTrack, presses: PressTruth) -> CommonPoints:
    """Control points pressed at while the station saw the prism: their surveyed places, and the prism's.

    Presses are taken earlier by the session's lead. Raises SurveyError where no clock makes the speeds of the labels
    and of the track alike.
    """
    lead_s = presses.lead.lead_s if np.isfinite(presses.lead.lead_s) else 0.0
    moment_ns = presses.time_ns[presses.identified] - round(lead_s * 1e9) + clock_by_speed(reference, track)
    point = presses.identities.point[presses.identified]
    prism = _position_at(track, moment_ns)
    seen = np.isfinite(prism).all(axis=1)
    names = tuple(f"point {number}" for number in point[seen].tolist())
    return CommonPoints(names, prism[seen], presses.points_bcs[point[seen]], PRESS_RESIDUAL_M)


def clock_by_speed(reference: Trajectory, track: StationTrack) -> int:
    """The station's wall clock minus the labels' (ns) that makes the two speeds most alike, to :data:`STEP_S`.

    Raises SurveyError where they are alike at no offset.
    """
    mapped, measured = _speeds(*usable_path(reference)), _speeds(track.time_ns, track.position)
    fewest = round(FEWEST_S / STEP_S)
    shifts = range(fewest - len(mapped), len(measured) - fewest + 1)
    alike = [_correlation(mapped, measured, shift, fewest) for shift in shifts]
    if not alike or max(alike) < MIN_CORRELATION:
        raise SurveyError(
            "the total station's track and the labels never move alike: are tachy.csv and the session of one "
            f"measurement, and do they overlap for {FEWEST_S:.0f} s at least?"
        )
    shift = shifts[int(np.argmax(alike))]
    return int(track.time_ns[0] - usable_path(reference)[0][0]) + round(shift * STEP_S * 1e9)


def _speeds(time_ns: IntArray, position: FloatArray) -> FloatArray:
    """Speed (j,) every :data:`STEP_S` from the first of the times (k,) on, by positions (k, 2), m/s; NaN where not
    known or far from any time.
    """
    if not len(time_ns):
        return np.empty(0)
    at_ns = np.arange(time_ns[0], time_ns[-1], round(STEP_S * 1e9), dtype=np.int64)
    speed = np.linalg.norm(walking_velocity(at_ns, time_ns, position), axis=1)
    return np.where(_in_gap(at_ns, time_ns), np.nan, speed)


def _in_gap(at_ns: IntArray, time_ns: IntArray) -> BoolArray:
    """Mask (k,) of the times between two points too far apart."""
    after = np.searchsorted(time_ns, at_ns).clip(1, len(time_ns) - 1)
    return np.asarray(time_ns[after] - time_ns[after - 1] > MAX_GAP_S * 1e9)


def _correlation(mapped: FloatArray, measured: FloatArray, shift: int, fewest: int) -> float:
    """Of the speeds (j,), (l,) where both are known, with ``mapped[i]`` beside ``measured[i + shift]``."""
    start, stop = max(0, -shift), min(len(mapped), len(measured) - shift)
    one, other = mapped[start:stop], measured[start + shift : stop + shift]
    known = np.isfinite(one) & np.isfinite(other)
    if known.sum() < fewest or not min(one[known].std(), other[known].std()) > 0:
        return -1.0
    return float(np.corrcoef(one[known], other[known])[0, 1])


def _position_at(track: StationTrack, at_ns: IntArray) -> FloatArray:
    """Position (k, 2) in the station's frame at its times (k,); NaN outside the track and in its gaps."""
    at_s, knots_s = (at_ns - track.time_ns[0]) * 1e-9, (track.time_ns - track.time_ns[0]) * 1e-9
    place = np.column_stack([np.interp(at_s, knots_s, track.position[:, axis], np.nan, np.nan) for axis in (0, 1)])
    return np.where(_in_gap(at_ns, track.time_ns)[:, None], np.nan, place)
