"""Errors of a tracker: its noise, the tails of the noise, and its possible drift between two frames.

A walk shows its drift by hardly one effective observation, and its sightings by about ten
(docs/explanation/smoother.md). Other walks of the device show a common factor on the usual noise of all kinds; for
single kinds their information is too small.

Drift is a covariance of the state at a frame, in the BCS, relative to a reference path: ``(x, y)`` position error in
metres, relative scale error, heading error in rad. A heading error at frame a turns the path from a to b. A drift of
the heading at a frame in between turns the rest of the path, ``X = path[b] - path[frame]``. The covariance of the drift
from a to b is therefore made of sums of the step's variance times 1, ``X`` and ``X X^T``, all from running sums, for
any number of pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from math import inf, log

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import TrackerNoise


class DriftSource(Enum):
    """Source of the drift of a stretch."""

    POSITION = "position"
    HEADING = "heading"
    SCALE = "scale"
    JUMP = "jump"
    """Steps that are not motion: the uncertainty of their target."""
    JUMP_TURN = "jump_turn"
    """... and of their turn."""
    DOUBT = "doubt"
    """Steps that may have slipped, along their excess over plausible ones."""


ESTIMATED = (DriftSource.POSITION, DriftSource.HEADING, DriftSource.SCALE)
"""Sources with an estimated level; jumps and slips have their own."""


@dataclass(frozen=True)
class NoiseEvidence:
    """What a walk shows of its tracker's noise: the sum of ``squares`` of its drift and sightings, in usual variances,
    and the effective number of ``observations`` in it.
    """

    observations: float = 0.0
    squares: float = 0.0


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of one session.

    ``position_m``, ``heading_rad`` and ``scale`` are random walks per square root of a metre walked. ``sighting_m`` is
    the error per axis of one pass of a landmark at 1 m distance, ``sheet_rad`` that of its logged heading.
    """

    position_m: float = 0.016
    heading_rad: float = 0.0015
    scale: float = 0.0008
    sighting_m: float = 0.14
    sheet_rad: float = 0.03
    sighting_observations: float = inf
    """Number of effective observations behind the level of sightings; infinite if it is given."""
    drift_observations: dict[DriftSource, float] = field(default_factory=dict)
    """... and behind that of each drift; missing ones are given."""
    evidence: NoiseEvidence = NoiseEvidence()
    """What the walk shows of all of them, without the prior."""

    def level(self, source: DriftSource) -> float:
        """Standard deviation that scales the drift of this source."""
        if source is DriftSource.POSITION:
            return self.position_m
        if source is DriftSource.HEADING:
            return self.heading_rad
        return self.scale if source is DriftSource.SCALE else 1.0

    @property
    def levels(self) -> FloatArray:
        """(5,) all levels, as :meth:`with_levels` takes them."""
        return np.array((self.position_m, self.heading_rad, self.scale, self.sighting_m, self.sheet_rad))

    def with_levels(self, levels: FloatArray) -> NoiseLevels:
        """Other levels (5,), with as many observations behind them."""
        position_m, heading_rad, scale, sighting_m, sheet_rad = levels.tolist()
        return replace(
            self,
            position_m=position_m,
            heading_rad=heading_rad,
            scale=scale,
            sighting_m=sighting_m,
            sheet_rad=sheet_rad,
        )

    def times(self, factor: float) -> NoiseLevels:
        """Levels multiplied by a factor for drift and sightings; sheets are unchanged."""
        return self.with_levels(self.levels * (factor, factor, factor, factor, 1.0))


USUAL = NoiseLevels()
"""Prior noise, typical of phones (docs/explanation/smoother.md)."""
PRIOR_WEIGHT = 0.5
"""Weight of the usual noise, in observations (docs/explanation/smoother.md)."""
SCALE_SIGMA = 0.02
"""Standard deviation of a tracker's scale."""


def assumed(prior_noise: TrackerNoise | None) -> tuple[NoiseLevels, float]:
    """The prior noise of a walk, and its weight in observations."""
    if prior_noise is None:
        return USUAL, PRIOR_WEIGHT
    return USUAL.times(prior_noise.times_usual), prior_noise.effective_observations


DEGREES_OF_FREEDOM = {
    DriftSource.POSITION: 2.0,
    DriftSource.HEADING: 4.0,
    DriftSource.SCALE: 20.0,
    DriftSource.JUMP: 2.0,
    DriftSource.JUMP_TURN: 2.0,
    DriftSource.DOUBT: 2.0,
}
"""Degrees of freedom of Student's t for the drift of a stretch; fewer mean more outliers."""
SIGHTING_DOF = 3.0
SHEET_DOF = 3.0
LANDMARK_DOF = 2.0
"""... and for a pass, for the heading of a sheet, and for the survey of a landmark."""
DOUBTED = 2.0
"""A surveyed place or a pass is doubtful if re-weighting increases its variance by this factor."""


ALIKE_OBSERVATIONS = 10.0
"""Limit of the weight of a walk's noise for another walk, in that walk's observations: walks of a device differ by
about a quarter (standard deviation)."""
DEVICES_SPREAD, SURVEYS_SPREAD = 0.5, 0.6
"""Standard deviations of the logarithm of a device's noise about its survey's, and of a survey's about the usual."""
LOG_TIMES = np.linspace(-log(8.0), log(8.0), 97)
"""Logarithms of the noises over the usual that are compared; beyond, a tracker failed."""
STEP = 2**0.5
"""The result of other walks is rounded to powers of this ..."""
STEP_OBSERVATIONS = 2.0
"""... and to multiples of this many observations; finer steps gain nothing, and more walks would change it more
often."""


def noise_of_other_walks(devices: Sequence[str], walks: Sequence[NoiseEvidence]) -> list[TrackerNoise | None]:
    """For each walk of a survey, with its device, its noise by all others; None if these show almost nothing.

    Empirical Bayes over three levels. A device's noise is about the survey's, log-normal; a walk's variance about its
    device's is scaled inverse chi-squared with :data:`ALIKE_OBSERVATIONS` degrees of freedom. Posteriors are sums over
    :data:`LOG_TIMES`, so they do not depend on the order of the walks.
    """
    walk = [_log_likelihood(each) for each in walks]
    own = {name: np.zeros_like(LOG_TIMES) for name in sorted({*devices})}
    for device, each in zip(devices, walk, strict=True):
        own[device] = own[device] + each
    usual = -((LOG_TIMES / SURVEYS_SPREAD) ** 2) / 2
    spread = -(((LOG_TIMES - LOG_TIMES[:, None]) / DEVICES_SPREAD) ** 2) / 2
    of_survey = {device: np.logaddexp.reduce(spread + each, axis=1) for device, each in own.items()}
    by_all = {}
    for device, each in own.items():
        survey = usual + sum(shown for other, shown in of_survey.items() if other != device)
        by_all[device] = each + np.logaddexp.reduce(spread + survey[:, None], axis=0)
    return [_tracker_noise(by_all[device] - each) for device, each in zip(devices, walk, strict=True)]


def _log_likelihood(walk: NoiseEvidence) -> FloatArray:
    """(g,) of :data:`LOG_TIMES`, by what one walk shows."""
    relative = walk.squares / ALIKE_OBSERVATIONS * np.exp(-2 * LOG_TIMES)
    tail = (ALIKE_OBSERVATIONS + walk.observations) / 2 * np.log1p(relative)
    return np.asarray(-walk.observations * LOG_TIMES - tail)


def _tracker_noise(log_probability: FloatArray) -> TrackerNoise | None:
    """The noise of a further walk, rounded, from logarithms of the probabilities (g,) of :data:`LOG_TIMES`."""
    probability = np.exp(log_probability - log_probability.max())
    probability /= probability.sum()
    mean = float(probability @ LOG_TIMES)
    variance = float(probability @ (LOG_TIMES - mean) ** 2)
    # The logarithm of a level that follows from n observations has the variance 1 / (2 n).
    observations = 1 / (1 / ALIKE_OBSERVATIONS + 2 * variance)
    rounded = STEP_OBSERVATIONS * round(observations / STEP_OBSERVATIONS)
    return TrackerNoise(STEP ** round(mean / log(STEP)), rounded) if rounded else None


FARTHEST = 1.0
"""Largest change of a level's or factor's natural logarithm by a lengthened step."""


@dataclass(frozen=True)
class VarianceFactors:
    """Noise levels, and factors on the variances of single observations (Student's t).

    The larger its factor, the smaller the weight of an observation. ``stretch`` (p + 1,) for each source of drift,
    ``sighting`` (p,), ``sheet`` (p,) for a sheet's heading, ``landmark`` (m,) for its survey.
    """

    noise: NoiseLevels
    stretch: dict[DriftSource, FloatArray]
    sighting: FloatArray
    sheet: FloatArray
    landmark: FloatArray
    prior_noise: TrackerNoise | None = None
    """Noise of the tracker by other walks; None: the usual noise is assumed."""

    @classmethod
    def even(
        cls, noise: NoiseLevels, passes: int, landmarks: int, prior_noise: TrackerNoise | None = None
    ) -> VarianceFactors:
        """Give all observations the same weight: every factor is 1."""
        stretch = {source: np.ones(passes + 1) for source in DriftSource}
        return cls(noise, stretch, np.ones(passes), np.ones(passes), np.ones(landmarks), prior_noise)

    def beyond(self, other: VarianceFactors, times: float) -> VarianceFactors:
        """Go from these through others (``times`` 1) and on, in logarithms, until one number has changed by
        :data:`FARTHEST`.
        """
        ends = other._numbers
        changes = [np.log(end / start) for start, end in zip(self._numbers, ends, strict=True)]
        farthest = max(float(np.abs(change).max(initial=0.0)) for change in changes)
        if farthest == 0:
            return other
        more = max(0.0, min(times, FARTHEST / farthest) - 1)
        noise, *stretch, sighting, sheet, landmark = (
            end * np.exp(more * change) for end, change in zip(ends, changes, strict=True)
        )
        return VarianceFactors(
            other.noise.with_levels(noise),
            dict(zip(other.stretch, stretch, strict=True)),
            sighting,
            sheet,
            landmark,
            other.prior_noise,
        )

    @property
    def _numbers(self) -> list[FloatArray]:
        return [self.noise.levels, *self.stretch.values(), self.sighting, self.sheet, self.landmark]

    @cached_property
    def stretch_scale(self) -> FloatArray:
        """(s, p + 1) factor on the variance of each source's drift over each stretch, relative to unit level."""
        return np.stack([self.noise.level(source) ** 2 * self.stretch[source] for source in DriftSource])


STATES = 4
"""x, y, scale, heading."""


class DriftKind(Enum):
    """Quantity that drifts."""

    POSITION = "position"
    HEADING = "heading"
    SCALE = "scale"


@dataclass(frozen=True)
class PathDriftSums:
    """Running sums along a path of one kind of drift, made by :class:`DriftAlong`."""

    kind: DriftKind
    path: ComplexArray
    sums: FloatArray
    """(6, n): variance, times x, y, xx, xy, yy of the path; of the position's drift (3, n): xx, xy, yy."""

    def between(self, a: IntArray, b: IntArray) -> FloatArray:
        """Covariances (k, 4, 4) of the drift from frames ``a`` to frames ``b`` >= a (k,)."""
        sums = self.sums.take(b, axis=1) - self.sums.take(a, axis=1)
        drift = np.zeros((len(a), STATES, STATES))
        if self.kind is DriftKind.POSITION:
            drift[:, 0, 0], drift[:, 1, 1] = sums[0], sums[2]
            drift[:, 0, 1] = drift[:, 1, 0] = sums[1]
            return drift
        total, sx, sy, sxx, sxy, syy = sums
        x, y = self.path.real[b], self.path.imag[b]
        mean_x, mean_y = x * total - sx, y * total - sy
        xx = np.maximum(x * x * total - 2 * x * sx + sxx, 0)
        yy = np.maximum(y * y * total - 2 * y * sy + syy, 0)
        xy = x * y * total - x * sy - y * sx + sxy
        if self.kind is DriftKind.HEADING:
            xx, yy, xy, mean_x, mean_y = yy, xx, -xy, -mean_y, mean_x
        row = 3 if self.kind is DriftKind.HEADING else 2
        drift[:, 0, 0], drift[:, 1, 1], drift[:, row, row] = xx, yy, total
        drift[:, 0, 1] = drift[:, 1, 0] = xy
        drift[:, 0, row] = drift[:, row, 0] = mean_x
        drift[:, 1, row] = drift[:, row, 1] = mean_y
        return drift


@dataclass(frozen=True)
class DriftAlong:
    """Adds up drift along a ``path`` (n,), complex metres in the BCS."""

    path: ComplexArray

    @cached_property
    def centred(self) -> ComplexArray:
        """(n,) the path relative to its middle, so that products of its coordinates keep their digits."""
        return np.asarray(self.path - self.path.mean())

    @cached_property
    def _moments(self) -> FloatArray:
        """(6, n - 1) 1, x, y, xx, xy, yy at the end of each step."""
        x, y = self.centred.real[1:], self.centred.imag[1:]
        return np.stack((np.ones_like(x), x, y, x * x, x * y, y * y))

    def sums(self, kind: DriftKind, variance: FloatArray) -> PathDriftSums:
        """Sum the variances (n - 1,) of the steps."""
        if kind is DriftKind.POSITION:
            terms = np.stack((variance, np.zeros_like(variance), variance))
        else:
            terms = variance * self._moments
        return PathDriftSums(kind, self.centred, _summed(terms))

    def slips(self, by: ComplexArray) -> PathDriftSums:
        """Let each step slip along ``by`` (n - 1,), complex, one standard deviation in metres, BCS."""
        terms = np.stack((by.real**2, by.real * by.imag, by.imag**2))
        return PathDriftSums(DriftKind.POSITION, self.centred, _summed(terms))


def _summed(terms: FloatArray) -> FloatArray:
    """Running sums (t, n) of terms (t, n - 1), zero at the first frame."""
    sums = np.zeros((len(terms), terms.shape[1] + 1))
    np.cumsum(terms, axis=1, out=sums[:, 1:])
    return sums


def transitions(path: ComplexArray, a: IntArray, b: IntArray) -> FloatArray:
    """Matrices (k, 4, 4) that propagate a state from frames ``a`` to frames ``b`` without drift."""
    displacement = path[b] - path[a]
    transition = np.tile(np.eye(STATES), (len(a), 1, 1))
    transition[:, 0, 2], transition[:, 1, 2] = displacement.real, displacement.imag
    transition[:, 0, 3], transition[:, 1, 3] = -displacement.imag, displacement.real
    return transition
