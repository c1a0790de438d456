"""Labels checked without truth: each surveyed landmark in turn is taken for unsurveyed and predicted from all others.

The surveyed place of a landmark is the truth for the walk that did without it. The gap to predict over is twice as long
as usual then, but the smoother knows the gap and states a covariance for just this error. How large the errors are
compared with what is stated of them scales the mean error that the smoother's covariances lead to expect of the labels.

The whole walk is smoothed again without the landmark. Keeping the noise levels and weights that were found with it, and
only solving again, is faster, but they have adapted to the landmark.

Errors of one landmark, pooled over sessions, show whether the survey has it elsewhere. A tracker's errors differ from
session to session, the survey's are the same in all. The weighted mean of the predictions (Student's t) estimates the
survey's error with a sigma that falls as sessions add up. A session whose other landmarks are predicted worse than
stated counts less. Predictions that disagree by far more than is stated mean that the landmark was moved.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.special import ellipe

from vislam2tag.common.findings import Answer, Judgement, counted, none_mapped
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.robust import StoppingRule, iterate, variance_factor
from vislam2tag.estimation.fault_detection import CERTAIN_SIGMAS, LEAST_M, discrepancy
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.smoother import SolvedWalk, solve_walk
from vislam2tag.quality.self_check_record import BadLandmark, Fault, LeftOutMark, SessionCheck

MOST_SOLUTIONS = 24
"""With more landmarks than this, several are left out at once, as far apart as can be: the cost stays linear."""


@dataclass(frozen=True)
class LeftOut:
    """One landmark predicted without its survey.

    ``landmark`` is its id; ``offset_m`` (2,) from its surveyed place to the predicted one, BCS; ``covariance_m2``
    (2, 2) what is stated of that offset, the survey's own uncertainty included; ``passes`` how often it was passed.
    """

    landmark: str
    passes: int
    offset_m: FloatArray
    covariance_m2: FloatArray

    @property
    def size_m(self) -> float:
        """Length of the offset."""
        return float(np.hypot(*self.offset_m))

    @property
    def squared_sigmas(self) -> float:
        """Squared Mahalanobis distance: 2 on average where what is stated is true."""
        return float(self.offset_m @ np.linalg.solve(self.covariance_m2, self.offset_m))


def leave_out(smoothed: SolvedWalk) -> tuple[LeftOut, ...]:
    """Leave out each surveyed landmark that was passed, in the order of the log.

    Where the others do not tie the walk to the building without it, there is no error to report: it is missing.
    """
    observations, priors = smoothed.model.observations, smoothed.priors
    passed = np.intersect1d(np.flatnonzero(priors.surveyed), observations.passes.landmark).tolist()
    found: list[tuple[int, LeftOut]] = []
    for start in range(min(len(passed), MOST_SOLUTIONS)):
        group = passed[start::MOST_SOLUTIONS]
        trial = solve_walk(observations, reduce(LandmarkPriors.without, group, priors))
        if trial is not None:
            found += [(landmark, _left_out(smoothed, trial, landmark)) for landmark in group]
    return tuple(error for _, error in sorted(found, key=lambda pair: pair[0]))


def _left_out(smoothed: SolvedWalk, trial: SolvedWalk, landmark: int) -> LeftOut:
    observations = smoothed.model.observations
    offset, covariance = discrepancy(smoothed, trial, landmark)
    return LeftOut(
        observations.ids[landmark], int(np.sum(observations.passes.landmark == landmark)), offset, covariance
    )


PRIOR_LANDMARKS = 3.0
"""What the smoother states counts as much as this many landmarks whose errors are just as stated."""
GREATEST_SHARE = 4.0
"""A left-out error counts at most as this many times the stated variance: a mis-surveyed landmark spoils the prediction
of itself, not the labels."""
FACTOR_SIGMA = 0.25
"""Labels and left-out landmarks need not exceed what is stated by the same factor: one sigma of its logarithm."""
LENGTH_VARIANCE = 4 / np.pi - 1
"""Variance of the length of a Gaussian error in units of its squared mean."""
NORMAL_90 = 1.645
"""Standard deviations on both sides that contain 90 % of a Gaussian."""
FEWEST = 3
"""With fewer left-out errors than this an estimate says hardly more than what the smoother states."""


@dataclass(frozen=True)
class Estimate:
    """Mean error of a session's labels, metres: ``stated_m`` by the smoother, ``estimated_m`` after the check.

    The true mean error is between ``low_m`` and ``high_m`` in about nine of ten sessions. ``checked`` is the number
    of left-out landmarks that speak for it; without any the estimate is what is stated, with a wide interval.
    """

    stated_m: float
    estimated_m: float
    low_m: float
    high_m: float
    checked: int

    @property
    def well_founded(self) -> bool:
        """Whether enough landmarks could be left out to say more than the smoother states."""
        return self.checked >= FEWEST

    def rounded(self) -> dict[str, float | bool]:
        """The numbers under their names in the record of a session."""
        lengths = {name: round(getattr(self, name), 4) for name in ("stated_m", "estimated_m", "low_m", "high_m")}
        return {**lengths, "well_founded": self.well_founded}


def estimate_accuracy(covariance_m2: FloatArray, left_out: Sequence[LeftOut]) -> Estimate | None:
    """Estimate the mean error of labels with covariances (n, 2, 2); None where there are none."""
    if len(covariance_m2) == 0:
        return None
    stated_m = float(expected_error_m(covariance_m2).mean())
    estimated_m = stated_m * error_factor(left_out)
    spread = float(np.exp(NORMAL_90 * _sigma_of_logarithm(len(left_out))))
    return Estimate(stated_m, estimated_m, estimated_m / spread, estimated_m * spread, len(left_out))


def error_factor(left_out: Sequence[LeftOut]) -> float:
    """By what factor errors exceed what is stated: root of a mean square, pulled to 1 where landmarks are few.

    ``squared_sigmas / 2`` has mean 1 where what is stated is true. Capped at :data:`GREATEST_SHARE`, its mean is still
    0.98 for Gaussian errors, and one bad landmark among ten adds at most an eighth to the factor.
    """
    return float(np.sqrt(excess(np.array([error.squared_sigmas for error in left_out]))))


def excess(squared_sigmas: FloatArray) -> float:
    """By what factor variances exceed what is stated, from squared Mahalanobis distances (k,), k may be 0."""
    shares = np.minimum(squared_sigmas / 2, GREATEST_SHARE)
    return float((PRIOR_LANDMARKS + shares.sum()) / (PRIOR_LANDMARKS + len(shares)))


def expected_error_m(covariance_m2: FloatArray) -> FloatArray:
    """Mean length (n,) of errors drawn from N(0, P), for covariances P (n, 2, 2): an elliptic integral."""
    half = np.trace(covariance_m2, axis1=1, axis2=2) / 2
    apart = np.hypot((covariance_m2[:, 0, 0] - covariance_m2[:, 1, 1]) / 2, covariance_m2[:, 0, 1])
    greatest = np.maximum(half + apart, 0.0)
    eccentricity = np.clip(2 * apart / np.where(greatest > 0, greatest, 1.0), 0.0, 1.0)
    return np.asarray(np.sqrt(2 * greatest / np.pi) * ellipe(eccentricity))


def _sigma_of_logarithm(checked: int) -> float:
    """Standard deviation of the logarithm of the estimate over the true mean error.

    The factor's own (mean of so many exponential shares, root), that of a mean over as many independent stretches as
    there are gaps between landmarks, and what labels and landmarks need not have in common.
    """
    factor = 1 / (4 * (PRIOR_LANDMARKS + checked))
    stretches = LENGTH_VARIANCE / (1 + checked)
    return float(np.sqrt(factor + stretches + FACTOR_SIGMA**2))


TAIL = 4.0
"""Degrees of freedom of Student's t for a session's prediction."""
SETTLED_M = 1e-4
"""Re-weighting has converged when the common offset does not move any more by this."""
MOST_ROUNDS = 200
"""Far more than any takes that converges: a limit, not a number of rounds."""
FEWEST_SCATTERING = 3
"""So many sessions must have passed a landmark to say that it scatters ..."""
SCATTER_SIGMAS = 3.0
"""... and half of them must put it further from its middle than stated by this factor."""
MEDIAN_SHARE = 2 * np.log(2)
"""Median of the squared Mahalanobis distance of Gaussian errors in the plane."""


_Prediction: TypeAlias = tuple[LeftOutMark, FloatArray, FloatArray, FloatArray]
"""What one session says of a landmark: its offset (2,), the covariance (2, 2) of that and of the survey."""
_Mean: TypeAlias = tuple[FloatArray, FloatArray]
"""A weighted mean of offsets (2,), metres, and its covariance (2, 2)."""


@dataclass(frozen=True)
class PooledResiduals:
    """What sessions (s) say of one landmark together.

    ``offset`` (2,) metres and its ``covariance`` (2, 2), the survey's included; ``distance_m`` (s,) of each session's
    place from the common one, and ``squared_sigmas`` (s,) of that distance.
    """

    offset: FloatArray
    covariance: FloatArray
    distance_m: FloatArray
    squared_sigmas: FloatArray


def bad_landmarks(sessions: Iterable[SessionCheck]) -> list[BadLandmark]:
    """Name the landmarks whose left-out errors are too large for chance, the furthest off first.

    Sessions with too few landmarks cannot show which one is wrong and are not used.
    """
    predictions = defaultdict(list)
    for session in sessions:
        if session.well_founded:
            for prediction in _predictions(session.left_out):
                predictions[prediction[0].floor, prediction[0].landmark].append(prediction)
    found = [bad for group in predictions.values() if (bad := _judged(group)) is not None]
    return sorted(found, key=lambda bad: (-bad.size_m, bad.floor, bad.landmark))


def _predictions(marks: Sequence[LeftOutMark]) -> list[_Prediction]:
    """One session's predictions, their covariances scaled by how well its other landmarks are predicted."""
    offset = np.array([mark.offset_m for mark in marks])
    covariance = _matrices([mark.covariance_m2 for mark in marks])
    survey = _matrices([mark.survey_covariance_m2 for mark in marks])
    squares = _squares(np.linalg.inv(covariance), offset)
    return [
        (mark, offset[i], survey[i] + (covariance[i] - survey[i]) * max(1.0, excess(np.delete(squares, i))), survey[i])
        for i, mark in enumerate(marks)
    ]


def pooled(offset: FloatArray, covariance: FloatArray, survey: FloatArray) -> PooledResiduals:
    """Pool offsets (s, 2) with covariances (s, 2, 2) that all include the same error of the survey (2, 2)."""
    worth = np.linalg.inv(covariance - survey)

    def weighted_mean(about: _Mean, _number: int) -> _Mean:
        factor = variance_factor(_squares(worth, offset - about[0]), 2, TAIL)
        weighted = worth / factor[:, None, None]
        spread = np.linalg.inv(weighted.sum(axis=0))
        return spread @ np.einsum("sij,sj->i", weighted, offset), spread

    done = iterate(
        "landmark positions from all sessions together",
        (np.median(offset, axis=0), survey),
        weighted_mean,
        lambda before, after: float(np.hypot(*(after[0] - before[0]))),
        StoppingRule(tolerance=SETTLED_M, most_rounds=MOST_ROUNDS),
    )
    common, spread = done.state
    squares = _squares(worth, offset - common)
    apart = max(1.0, excess(squares)) if len(offset) > 1 else 1.0
    return PooledResiduals(common, spread * apart + survey, np.linalg.norm(offset - common, axis=1), squares)


def _squares(worth: npt.ArrayLike, miss: FloatArray) -> FloatArray:
    """Squared lengths (s,) of offsets (s, 2) in units of the precisions ``worth`` (s, 2, 2)."""
    return np.asarray(np.einsum("si,sij,sj->s", miss, np.asarray(worth), miss))


def _judged(predictions: Sequence[_Prediction]) -> BadLandmark | None:
    marks, offsets, covariances, surveys = zip(*predictions, strict=True)
    together, mark = pooled(np.array(offsets), np.array(covariances), surveys[0]), marks[0]
    size_m = float(np.hypot(*together.offset))
    sigmas = float(np.sqrt(together.offset @ np.linalg.solve(together.covariance, together.offset)))
    apart_m = float(np.median(together.distance_m))
    scatter = float(np.sqrt(np.median(together.squared_sigmas) / MEDIAN_SHARE))
    bad = BadLandmark(
        floor=mark.floor,
        landmark=mark.landmark,
        fault=Fault.OFFSET if len(predictions) > 1 else Fault.DOUBT,
        sessions=len(predictions),
        surveyed_m=mark.surveyed_m,
        offset_m=(round(float(together.offset[0]), 3), round(float(together.offset[1]), 3)),
        size_m=round(size_m, 3),
        sigma_m=round(size_m / max(sigmas, 1e-9), 3),
    )
    if len(predictions) >= FEWEST_SCATTERING and scatter >= SCATTER_SIGMAS and apart_m >= LEAST_M:
        return bad.model_copy(
            update={"fault": Fault.SCATTER, "size_m": round(apart_m, 3), "sigma_m": round(apart_m / scatter, 3)}
        )
    return bad if sigmas >= CERTAIN_SIGMAS and size_m >= LEAST_M else None


def _matrices(entries: Sequence[tuple[float, float, float]]) -> FloatArray:
    """Covariances (s, 2, 2) from their entries xx, xy, yy."""
    xx, xy, yy = np.array(entries).T
    return np.asarray(np.stack((xx, xy, xy, yy), axis=-1).reshape(-1, 2, 2))


NO_SESSION = "all sessions of the survey are excluded"
_TOO_FEW = "no session has enough surveyed landmarks or known positions for leave-one-out"


def judgement_of(sessions: Sequence[SessionCheck], bad: int) -> Judgement:
    """The answer about the landmarks of checked sessions, ``bad`` of which are named."""
    if not sessions:
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=NO_SESSION)
    failed = sum(session.error is not None for session in sessions)
    judging = [session for session in sessions if session.well_founded]
    marks = {(mark.floor, mark.landmark) for session in judging if not session.fixes for mark in session.left_out}
    fixes = sum(len(session.left_out) for session in judging if session.fixes)
    parts = [counted(len(marks), "landmark")] if marks else []
    parts += [counted(fixes, "known position")] if fixes else []
    if not parts:
        return Judgement.of(bad, 0, "", none_mapped(failed) if failed == len(sessions) else _TOO_FEW)
    rest = len(sessions) - len(judging)
    why = f"{counted(rest, 'session')} could not judge any" if rest else ""
    return Judgement.of(bad, len(parts), f"{' and '.join(parts)} in {counted(len(judging), 'session')}", why)
