"""How far one recorder's clock is ahead of another's, by the motion that both felt on one walk.

Motion is told by any norm that both felt alike: of the turn rate (gyroscope), or of the acceleration. The offset is
looked for everywhere by correlating the whole series, then refined in windows of a few seconds each: how their offsets
scatter about a line gives its sigma, and the line's slope by how much one clock runs faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.pose_lag import correlation_of_rows, peak_of

STEP_S = 0.05
LEAST_OVERLAP_S = 40.0
LONGEST_S = 86400.0
"""Longer series are not compared: a walk takes hours at most, and one wrong time of years would fill the memory."""
LEAST_CORRELATION = 0.5
"""Below this two series do not describe the same motion ..."""
LEAST_MARGIN = 0.15
"""... nor where another offset, farther than :data:`OTHER_OFFSET_S` off, fits nearly as well."""
OTHER_OFFSET_S = 2.0
LEAST_NEAR_MARGIN = 0.1
"""Nearer offsets at which the correlation has another peak, such as a step earlier, must fit worse by this."""
LEAST_RIVAL_S = 0.1
"""... nearer ones are one peak, made uneven by noise."""
WINDOW_S, FEWEST_WINDOWS, FEWEST_FOR_RATE = 5.0, 5, 12
USUAL_RATE = 5e-5
"""Clocks of phones and loggers run at rates that differ by less: what a walk too short to tell it may be off by."""
FINE_STEP_S, FINE_REACH_S, SMOOTH_S = 0.01, 1.5, 0.06
STAMPS_SIGMA_S = 0.001
"""Stamps are hardly ever better than this; all windows share the error, so that their scatter does not tell it."""
EITHER_END = 1.125
"""How much wider than at one end the sigma is within which, twice, the error at both ends of a line lies as often as a
normal error lies within two sigma. Of evenly spread windows the errors at the ends correlate by -1/2: with the normal
distribution of two such both lie within 2.25 of their sigmas as often as one lies within 2.
"""
_OUTLIER = 4.0
"""Windows farther from the line than so many times the median distance (as a sigma) do not count."""


@dataclass(frozen=True)
class ClockAlignment:
    """``offset_ns`` by which their clock is ahead of ours at ``at_ns`` of ours, and the seconds that it gains in each
    second of ours (``rate``); ``sigma_s`` of their distance anywhere on the walk.

    ``figures`` says how well both fit; ``offset_ns`` is None where that does not tell the offset.
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


def align_by_motion(
    their_ns: IntArray,
    theirs: FloatArray,
    our_ns: IntArray,
    ours: FloatArray,
    least_correlation: float = LEAST_CORRELATION,
) -> ClockAlignment:
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
    if found.correlation < least_correlation or found.correlation - found.other < LEAST_MARGIN:
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


def best_shift(first: FloatArray, second: FloatArray) -> Shift:
    """Correlate two series of steps of :data:`STEP_S` at every shift at which they overlap by enough."""
    from scipy.signal import correlate  # half a second, which `process` does without

    ones = [np.ones(len(series)) for series in (first, second)]
    overlap = correlate(ones[0], ones[1])
    sums = [correlate(first, ones[1]), correlate(ones[0], second)]
    squares = [correlate(first**2, ones[1]), correlate(ones[0], second**2)]
    count = np.maximum(overlap, 1.0)
    spread = [
        np.maximum(square / count - (total / count) ** 2, 1e-12) for square, total in zip(squares, sums, strict=True)
    ]
    together = correlate(first, second) / count - sums[0] * sums[1] / count**2
    correlation = np.where(overlap * STEP_S >= LEAST_OVERLAP_S, together / np.sqrt(spread[0] * spread[1]), -1.0)
    best = int(np.argmax(correlation))
    apart = np.abs(np.arange(len(correlation)) - best) * STEP_S > OTHER_OFFSET_S
    other = float(correlation[apart].max(initial=-1.0))
    return Shift((best - (len(second) - 1)) * STEP_S, float(correlation[best]), other)


def _refined(
    our_s: FloatArray, ours: FloatArray, their_s: FloatArray, theirs: FloatArray, start_ns: int, zero_ns: int, told: str
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
        return ClockAlignment(None, figures=f"{told}; only {len(offsets)} stretches of {WINDOW_S:g} s tell it alike")
    rival = _rival(lags, np.mean(all_correlations, axis=0))
    if rival is not None:
        return ClockAlignment(None, figures=f"{told}; an offset {rival:+.2f} s from there fits nearly as well")
    offset, rate, middle_s, sigma_s = _line(np.array(middles), np.array(offsets))
    return ClockAlignment(
        start_ns + round(offset * 1e9),
        float(np.hypot(sigma_s, STAMPS_SIGMA_S)),
        rate,
        zero_ns + round(middle_s * 1e9),
        told,
    )


def _means(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Means of a series over :data:`SMOOTH_S` about some times."""
    integral = np.concatenate(([0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time_s))))
    ends = np.interp(at_s + SMOOTH_S / 2, time_s, integral) - np.interp(at_s - SMOOTH_S / 2, time_s, integral)
    return np.asarray(ends / SMOOTH_S)


def _rival(lags: FloatArray, correlation: FloatArray) -> float | None:
    """How far off another peak lies that is nearly as high as the highest; None where none is."""
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
