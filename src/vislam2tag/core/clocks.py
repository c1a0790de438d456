"""By how much one clock is ahead of another: of two recorders of one walk, or of two streams of one recorder.

Two recorders are aligned by motion that both measured, by levels of access points that both received, or by taps on
both. The offset with the best agreement is used, if no other fits nearly as well (:func:`best_of`).

Motion is any norm that both measured alike: of the turn rate (gyroscope), or of the acceleration. The offset is found
by correlating the whole series, then refined in windows of a few seconds each. The scatter of their offsets about a
line gives sigma. The slope of the line gives by how much one clock runs faster.

Poses of one phone may be stamped late as well: when drawn, not when exposed (:func:`estimate_pose_lag`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.transforms import angular_speed

STEP_S = 0.05
LEAST_OVERLAP_S = 40.0
LONGEST_S = 86400.0
"""Longer series are not compared: a walk takes hours at most, and one wrong time of years would fill the memory."""
LEAST_CORRELATION = 0.5
"""Below this two series do not describe the same motion ..."""
LEAST_MARGIN = 0.15
"""... nor where another offset, further than :data:`OTHER_OFFSET_S` off, fits nearly as well."""
OTHER_OFFSET_S = 2.0
LEAST_NEAR_MARGIN = 0.1
"""Closer offsets at which the correlation has another peak, such as a step earlier, must fit worse by this."""
LEAST_RIVAL_S = 0.1
"""... closer ones are one peak, made uneven by noise."""
WINDOW_S, FEWEST_WINDOWS, FEWEST_FOR_RATE = 5.0, 5, 12
USUAL_RATE = 5e-5
"""Clocks of phones and loggers run at rates that differ by less: what a walk too short to show it may be off by."""
FINE_STEP_S, FINE_REACH_S, SMOOTH_S = 0.01, 1.5, 0.06
STAMPS_SIGMA_S = 0.001
"""Stamps are hardly ever better than this; all windows share the error, so that their scatter does not show it."""
EITHER_END = 1.125
"""How much wider than at one end the sigma is within which, twice, the error at both ends of a line is as often as a
normal error is within two sigma. Of evenly spread windows the errors at the ends correlate by -1/2: with the normal
distribution of two such both lie within 2.25 of their sigmas as often as one is within 2.
"""
_OUTLIER = 4.0
"""Windows further from the line than so many times the median distance (as a sigma) do not count."""


def best_of(offsets: npt.NDArray[Any], agreement: npt.NDArray[Any], apart: float) -> tuple[int, float]:
    """Row of the offset (k,) of the greatest agreement (k,), and how well any other agrees that is this far apart."""
    best = int(np.argmax(agreement))
    others = agreement[np.abs(offsets - offsets[best]) > apart]
    return best, float(others.max()) if len(others) else -np.inf


@dataclass(frozen=True)
class ClockAlignment:
    """``offset_ns`` by which their clock is ahead of ours at ``at_ns`` of ours, and the seconds that it gains in each
    second of ours (``rate``); ``sigma_s`` of their distance anywhere on the walk.

    ``figures`` says how well both fit; ``offset_ns`` is None where that does not show the offset.
    """

    offset_ns: int | None
    sigma_s: float = 0.0
    rate: float = 0.0
    at_ns: int = 0
    figures: str = ""

    def ours(self, their_ns: IntArray) -> IntArray:
        """Their times (n,) on our clock; raises ValueError where the offset is not known."""
        if self.offset_ns is None:
            raise ValueError(self.figures)
        shifted = their_ns - self.offset_ns
        return shifted - np.round(self.rate / (1 + self.rate) * (shifted - self.at_ns)).astype(np.int64)


def align_by_motion(their_ns: IntArray, theirs: FloatArray, our_ns: IntArray, ours: FloatArray) -> ClockAlignment:
    """Align two clocks by one norm of the motion: ``theirs`` (n,) at ``their_ns`` (n,), ``ours`` (m,) at ``our_ns``.

    Units may differ by a factor, and so may how often was sampled. Times need not be sorted; values that are not finite
    are left out.
    """
    their_ns, theirs = _sorted(their_ns, theirs)
    our_ns, ours = _sorted(our_ns, ours)
    if min((their_ns[-1:] - their_ns[:1]).sum(), (our_ns[-1:] - our_ns[:1]).sum()) < LEAST_OVERLAP_S * 1e9:
        return ClockAlignment(None, figures=f"less than {LEAST_OVERLAP_S:g} s of motion to compare")
    if not comparable(our_ns, their_ns):
        return ClockAlignment(None, figures=f"motion over more than {LONGEST_S / 3600:g} h; cut the table into days")
    found = best_shift(resampled(our_ns, ours), resampled(their_ns, theirs))
    figures = f"correlation {found.correlation:.2f}, {max(found.other, 0.0):.2f} at the best other offset"
    if not found.is_clear(LEAST_CORRELATION):
        return ClockAlignment(None, figures=figures)
    our_s, their_s = (our_ns - our_ns[0]) * 1e-9, (their_ns - their_ns[0]) * 1e-9 + found.shift_s
    start_ns = int(their_ns[0] - our_ns[0]) - round(found.shift_s * 1e9)
    return _refined(our_s, ours, their_s, theirs, start_ns, int(our_ns[0]), figures)


def _sorted(time_ns: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    finite = np.isfinite(values)
    time_ns, first = np.unique(time_ns[finite], return_index=True)
    return time_ns, values[finite][first]


def comparable(*times_ns: IntArray) -> bool:
    """Whether series at these times, sorted, span so little that :func:`resampled` makes a bearable number of them."""
    return all(time_ns[-1] - time_ns[0] <= LONGEST_S * 1e9 for time_ns in times_ns)


def resampled(time_ns: IntArray, values: FloatArray) -> FloatArray:
    """Values every :data:`STEP_S` from the first one on, each a mean over a few samples."""
    bins = ((time_ns - time_ns[0]) * 1e-9 / STEP_S).astype(np.int64)
    count = np.bincount(bins)
    mean = np.bincount(bins, values) / np.maximum(count, 1)
    there = np.flatnonzero(count)
    return np.asarray(np.interp(np.arange(len(count)), there, mean[there]))


@dataclass(frozen=True)
class Shift:
    """By how many seconds to delay a second series so that it fits the first; correlations there, and elsewhere."""

    shift_s: float
    correlation: float
    other: float

    def is_clear(self, least_correlation: float) -> bool:
        """Whether the two describe the same motion, and fit at this shift only."""
        return self.correlation >= least_correlation and self.correlation - self.other >= LEAST_MARGIN


def best_shift(
    first: FloatArray, second: FloatArray, step_s: float = STEP_S, least_overlap_s: float = LEAST_OVERLAP_S
) -> Shift:
    """Correlate two series (n,), (m,), values every ``step_s``, at every shift at which they overlap by enough.

    Where a value is NaN nothing is compared; at least one is known of either.
    """
    from scipy.signal import correlate  # half a second, which `process` does without

    known = [np.isfinite(series).astype(np.float64) for series in (first, second)]
    first, second = np.nan_to_num(first), np.nan_to_num(second)
    overlap = correlate(known[0], known[1])
    count = np.maximum(overlap, 1.0)
    means = correlate(first, known[1]) / count, correlate(known[0], second) / count
    squares = correlate(first**2, known[1]) / count, correlate(known[0], second**2) / count
    spread = [np.maximum(square - mean**2, 1e-12) for square, mean in zip(squares, means, strict=True)]
    together = correlate(first, second) / count - means[0] * means[1]
    correlation = np.where(overlap * step_s >= least_overlap_s, together / np.sqrt(spread[0] * spread[1]), -1.0)
    best, other = best_of(np.arange(len(correlation)), correlation, OTHER_OFFSET_S / step_s)
    return Shift((best - (len(second) - 1)) * step_s, float(correlation[best]), max(other, -1.0))


def _refined(
    our_s: FloatArray, ours: FloatArray, their_s: FloatArray, theirs: FloatArray, start_ns: int, zero_ns: int, fit: str
) -> ClockAlignment:
    """Refine in windows; ``their_s`` are their times with the rough offset taken off, both from ``zero_ns`` of ours."""
    begin, end = max(our_s[0], their_s[0] + FINE_REACH_S), min(our_s[-1], their_s[-1] - FINE_REACH_S)
    lags = np.arange(-FINE_REACH_S, FINE_REACH_S + FINE_STEP_S / 2, FINE_STEP_S)
    middles, offsets, all_correlations = [], [], []
    for left in np.arange(begin, end - WINDOW_S, WINDOW_S).tolist():
        grid = np.arange(left, left + WINDOW_S, 2 * FINE_STEP_S)
        own = _means(our_s, ours, grid)
        shifted = _means(their_s, theirs, (grid + lags[:, None]).ravel()).reshape(len(lags), len(grid))
        correlation = correlation_of_rows(shifted, own)
        all_correlations.append(correlation)
        if (lag := peak_of(lags, correlation, FINE_STEP_S, LEAST_CORRELATION)) is not None:
            middles.append(left + WINDOW_S / 2)
            offsets.append(lag)
    if len(offsets) < FEWEST_WINDOWS:
        return ClockAlignment(None, figures=f"{fit}; only {len(offsets)} stretches of {WINDOW_S:g} s agree on it")
    rival = _rival(lags, np.mean(all_correlations, axis=0))
    if rival is not None:
        return ClockAlignment(None, figures=f"{fit}; an offset {rival:+.2f} s from there fits nearly as well")
    offset, rate, middle_s, sigma_s = _line(np.array(middles), np.array(offsets))
    offset_ns, at_ns = start_ns + round(offset * 1e9), zero_ns + round(middle_s * 1e9)
    return ClockAlignment(offset_ns, float(np.hypot(sigma_s, STAMPS_SIGMA_S)), rate, at_ns, fit)


def _means(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Means of a series over :data:`SMOOTH_S` about some times."""
    integral = np.concatenate(([0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time_s))))
    ends = np.interp(at_s + SMOOTH_S / 2, time_s, integral) - np.interp(at_s - SMOOTH_S / 2, time_s, integral)
    return np.asarray(ends / SMOOTH_S)


def _rival(lags: FloatArray, correlation: FloatArray) -> float | None:
    """How far off another peak is that is nearly as high as the highest; None where none is."""
    best = int(np.argmax(correlation))
    inner = correlation[1:-1]
    peaks = np.flatnonzero((inner >= correlation[:-2]) & (inner > correlation[2:])) + 1
    away = np.abs(lags[peaks] - lags[best]) >= LEAST_RIVAL_S
    others = peaks[away & (correlation[peaks] > correlation[best] - LEAST_NEAR_MARGIN)]
    return float(lags[others[np.argmax(correlation[others])]] - lags[best]) if len(others) else None


def _line(time_s: FloatArray, offset_s: FloatArray) -> tuple[float, float, float, float]:
    """Offset at the middle, slope, the middle, and the offset's sigma at both ends, seconds; outliers left out."""
    degree = 1 if len(time_s) >= FEWEST_FOR_RATE else 0
    residual = offset_s - np.median(offset_s)
    keep = np.ones(len(time_s), dtype=bool)
    for _ in range(3):
        scatter = 1.4826 * float(np.median(np.abs(residual[keep])))
        keep = np.abs(residual) <= max(_OUTLIER * scatter, FINE_STEP_S)
        middle = float(time_s[keep].mean())
        fit = np.polynomial.polynomial.polyfit(time_s[keep] - middle, offset_s[keep], degree)
        residual = offset_s - np.polynomial.polynomial.polyval(time_s - middle, fit)
    arm, free = time_s[keep] - middle, keep.sum() - degree - 1
    # Of so few windows the variance is Student's, not the normal one's.
    variance = np.sum(residual[keep] ** 2) / max(free - 2, 1)
    far = np.abs(arm).max()
    if not degree:
        return float(fit[0]), 0.0, middle, float(np.hypot(np.sqrt(variance / keep.sum()), USUAL_RATE * far))
    at_end = variance / keep.sum() + variance * far**2 / np.sum(arm**2)
    return float(fit[0]), float(fit[1]), middle, EITHER_END * float(np.sqrt(at_end))


Heard: TypeAlias = Mapping[str, tuple[IntArray, FloatArray]]
"""Times (n,), ns, sorted, and levels (n,), dBm, by BSSID."""
_HEARD_STEP_S = 0.5
_NEAR_S = 1.5
"""Two readings of one access point are compared if they are so close in time."""
_GREATEST_DB = 12.0
"""Differences count up to this: an access point that fades shows no more than that."""
_LEAST_PAIRS = 40
_LEAST_CLEAR = 1.25
"""How much worse than the best offset the best of the others must be."""
_APART_S = 10.0
_ALIKE = 0.1
"""Offsets that are worse than the best by up to this share of how much worse the others are fit as well as it."""
_COINCIDE_NS = 10_000_000
_MOST_OFFSETS = 40_000
_PARTS = 5
"""The walk is cut in so many parts; how their best offsets scatter gives the sigma."""


def align_by_levels(theirs: Heard, ours: Heard) -> ClockAlignment:
    """Align two clocks by access points that both heard; levels of two devices may differ by a constant."""
    shared = [bssid for bssid in theirs if bssid in ours]
    if not shared:
        return ClockAlignment(None, figures="no access point was received by both")
    first = min(int(theirs[b][0][0]) for b in shared) - max(int(ours[b][0][-1]) for b in shared)
    last = max(int(theirs[b][0][-1]) for b in shared) - min(int(ours[b][0][0]) for b in shared)
    step_ns = int(_HEARD_STEP_S * 1e9)
    if not 0 < last - first <= _MOST_OFFSETS * step_ns:
        return ClockAlignment(None, figures=f"{len(shared)} access points in common, but too far apart in time")
    offsets = np.arange(first, last, step_ns)
    costs = np.array([_cost(theirs, ours, shared, int(offset)) for offset in offsets])
    best, elsewhere = best_of(offsets, -costs, _APART_S * 1e9)
    other = -elsewhere
    figures = f"{len(shared)} access points in common, levels {costs[best]:.1f} dB apart (next best: {other:.1f} dB)"
    if not np.isfinite(costs[best]) or other < _LEAST_CLEAR * costs[best]:
        return ClockAlignment(None, figures=figures)
    # Scans are seconds apart, so that a stretch of offsets pairs the same ones and fits alike.
    alike = (costs <= costs[best] + _ALIKE * (min(other, _GREATEST_DB) - costs[best])) & (
        np.abs(offsets - offsets[best]) <= _APART_S * 1e9
    )
    offset_ns, width_s = int(offsets[alike].mean()), float(np.ptp(offsets[alike])) * 1e-9
    coinciding = _coinciding(theirs, ours, shared, offset_ns)
    if coinciding is not None:
        return ClockAlignment(coinciding, _COINCIDE_NS * 1e-9, figures=figures)
    sigma_s = np.hypot(width_s / np.sqrt(12), _scatter_s(theirs, ours, shared, offset_ns))
    return ClockAlignment(offset_ns, float(sigma_s), figures=figures)


def _coinciding(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> int | None:
    """The offset at which most of those readings coincide that both clocks dated, to 10 ms; None where few do."""
    apart = []
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        differences = (their_ns - offset_ns)[:, None] - our_ns
        near = (np.abs(differences) <= _NEAR_S * 1e9) & (their_dbm[:, None] == our_dbm)
        apart.append(differences[near])
    found = np.round(np.concatenate(apart) / _COINCIDE_NS).astype(np.int64)
    values, counts = np.unique(found, return_counts=True)
    if not len(values) or counts.max() < _LEAST_PAIRS // 2:
        return None
    return offset_ns + int(values[np.argmax(counts)]) * _COINCIDE_NS


def _scatter_s(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> float:
    """Sigma of an offset, seconds: how the best offsets of parts of the walk scatter about it."""
    start, end = min(ours[b][0][0] for b in shared), max(ours[b][0][-1] for b in shared)
    edges = np.linspace(start, end + 1, _PARTS + 1)
    tried = offset_ns + (np.arange(-_APART_S, _APART_S, _HEARD_STEP_S) * 1e9).astype(np.int64)
    best = []
    for left, right in pairwise(edges.tolist()):
        kept = {b: (ours[b][0] >= left) & (ours[b][0] < right) for b in shared}
        part = {b: (ours[b][0][rows], ours[b][1][rows]) for b, rows in kept.items()}
        costs = [_cost(theirs, part, shared, int(offset)) for offset in tried]
        if np.isfinite(min(costs)):
            best.append(float(tried[int(np.argmin(costs))] - offset_ns) * 1e-9)
    scatter_s = float(np.sqrt(np.mean(np.square(best)) / len(best))) if len(best) > 1 else _APART_S
    return max(scatter_s, _HEARD_STEP_S / 2)


def _cost(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> float:
    """Mean difference of levels heard at the same time, dB, were their clock ahead by this; infinite for few."""
    found = [np.empty(0)]
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        if not len(our_ns):
            continue
        wanted = their_ns - offset_ns
        after = np.searchsorted(our_ns, wanted).clip(1, max(len(our_ns) - 1, 1)).clip(max=len(our_ns) - 1)
        before = np.maximum(after - 1, 0)
        nearer = np.where(np.abs(our_ns[after] - wanted) < np.abs(our_ns[before] - wanted), after, before)
        near = np.abs(our_ns[nearer] - wanted) <= _NEAR_S * 1e9
        found.append((their_dbm - our_dbm[nearer])[near])
    differences = np.concatenate(found)
    if len(differences) < _LEAST_PAIRS:
        return np.inf
    return float(np.minimum(np.abs(differences - np.median(differences)), _GREATEST_DB).mean())


TOGETHER_S = 0.4
"""Taps with two hands, or one after the other at once, are no further apart."""
FEWEST_TAPS = 4
"""Fewer taps in common fall together by chance."""
_TAPS_LEAD = 2
"""By how many fewer taps any other offset must bring together."""
_MOST_TAPS = 2000


def align_by_taps(theirs_ns: IntArray, ours_ns: IntArray) -> ClockAlignment:
    """Align two clocks by taps (n,) and (m,), ns; the offset brings most of them together."""
    theirs, ours = np.unique(theirs_ns), np.unique(ours_ns)
    if min(len(theirs), len(ours)) < FEWEST_TAPS:
        return ClockAlignment(None, figures=f"{len(theirs)} and {len(ours)} taps, but {FEWEST_TAPS} of each are needed")
    if max(len(theirs), len(ours)) > _MOST_TAPS:
        return ClockAlignment(None, figures=f"more than {_MOST_TAPS} taps")
    apart = np.sort((theirs[:, None] - ours[None, :]).ravel())
    reach = round(TOGETHER_S * 1e9)
    count = np.searchsorted(apart, apart + reach, side="right") - np.arange(len(apart))
    best, elsewhere = best_of(apart, count, 2 * reach)
    together, other = apart[best : best + count[best]], int(max(elsewhere, 0))
    figures = f"{count[best]} taps in common, {other} at the best other offset"
    if count[best] < FEWEST_TAPS or count[best] - other < _TAPS_LEAD:
        return ClockAlignment(None, figures=figures)
    offset_ns = round(float(np.median(together - together[0]))) + int(together[0])
    sigma_s = float(np.std((together - offset_ns) * 1e-9, ddof=1)) / np.sqrt(len(together))
    return ClockAlignment(offset_ns, max(float(sigma_s), 0.01), figures=figures)


MAX_LAG_S = 0.5
LAG_STEP_S = 0.02
MAX_FRAMES = 2700
"""Frames looked at: a minute and a half at 30 Hz settles the lag."""
MIN_SAMPLES = 100
MIN_CORRELATION = 0.6
"""Below this the two angular speeds do not describe the same motion."""


def estimate_pose_lag(
    frame_time_ns: IntArray, orientation: FloatArray, gyro_time_ns: IntArray, gyro_rad_per_s: FloatArray
) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late), by correlating angular speeds.

    ``orientation`` (n, 4) quaternions at ``frame_time_ns`` (n,), increasing; ``gyro_rad_per_s`` (g, 3) at
    ``gyro_time_ns`` (g,), increasing. Returns None where too little overlaps or the two do not correlate.
    """
    middle_s, speed = angular_speed(frame_time_ns[:MAX_FRAMES], orientation[:MAX_FRAMES])
    if len(gyro_time_ns) < MIN_SAMPLES or len(middle_s) < MIN_SAMPLES:
        return None
    gyro_s = (gyro_time_ns - frame_time_ns[0]) * 1e-9
    gyro_speed = np.linalg.norm(gyro_rad_per_s, axis=1)
    inside = (middle_s > gyro_s[0] + MAX_LAG_S) & (middle_s < gyro_s[-1] - MAX_LAG_S)
    middle_s, speed = middle_s[inside], speed[inside]
    if len(middle_s) < MIN_SAMPLES or not speed.std() > 0:
        return None
    lags = np.arange(-MAX_LAG_S, MAX_LAG_S + LAG_STEP_S / 2, LAG_STEP_S)
    shifted = np.interp(middle_s - lags[:, None], gyro_s, gyro_speed)
    return peak_of(lags, correlation_of_rows(shifted, speed), LAG_STEP_S, MIN_CORRELATION)


def correlation_of_rows(candidates: FloatArray, reference: FloatArray) -> FloatArray:
    """Pearson correlation of each row of ``candidates`` (c, n) with ``reference`` (n,)."""
    centred = candidates - candidates.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(centred, axis=1) * np.linalg.norm(reference - reference.mean())
    correlation: FloatArray = centred @ (reference - reference.mean()) / np.maximum(norm, 1e-12)
    return correlation


def peak_of(lags: FloatArray, correlation: FloatArray, step_s: float, least: float) -> float | None:
    """Lag of the greatest correlation (c,) at lags (c,), s, ``step_s`` apart, refined by a parabola.

    None where that correlation is below ``least`` or at either end.
    """
    best = int(np.argmax(correlation))
    if correlation[best] < least or best in (0, len(lags) - 1):
        return None
    left, middle, right = correlation[best - 1 : best + 2]
    curvature = left - 2 * middle + right
    offset = 0.5 * (left - right) / curvature if curvature < 0 else 0.0
    return float(lags[best] + offset * step_s)
