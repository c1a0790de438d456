"""Landmarks that are not where the survey says: left-out errors of one landmark, pooled over sessions.

Each session predicts the landmark from all others. Its tracker's errors differ from session to session, the survey's
are the same in all: the weighted mean of the predictions, outlying ones weighted down (Student's t), tells the survey's
error with a sigma that falls as sessions add up. A session whose other landmarks are predicted worse than stated is
believed less. Predictions that disagree with each other by far more than is stated
tell that the landmark did not stay where it was.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.robust import iterate, variance_factor
from vislam2tag.estimation.contradictions import CERTAIN_SIGMAS, LEAST_M
from vislam2tag.self_check.accuracy import excess
from vislam2tag.self_check.record import BadLandmark, Fault, LeftOutMark, SessionCheck

TAIL = 4.0
"""Degrees of freedom of Student's t for a session's prediction."""
SETTLED_M = 1e-4
"""Re-weighting has converged when the common offset does not move any more by this."""
MOST_ROUNDS = 200
"""Far more than any takes that converges: a limit, not a number of rounds."""
FEWEST_SCATTERING = 3
"""So many sessions must have passed a landmark to say that it scatters ..."""
SCATTER_SIGMAS = 3.0
"""... and half of them must put it farther from its middle than stated by this factor."""
MEDIAN_SHARE = 2 * np.log(2)
"""Median of the squared Mahalanobis distance of Gaussian errors in the plane."""


@dataclass(frozen=True)
class _Prediction:
    """What one session says of a landmark: its offset (2,), the covariance (2, 2) of that and of the survey."""

    mark: LeftOutMark
    offset: FloatArray
    covariance: FloatArray
    survey: FloatArray


@dataclass(frozen=True)
class _Mean:
    """A weighted mean of offsets (2,), metres, and its covariance (2, 2)."""

    offset: FloatArray
    covariance: FloatArray


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
    """Name the landmarks whose left-out errors are no chance, the farthest off first.

    Sessions with too few landmarks cannot tell which one is wrong and are not asked.
    """
    predictions = defaultdict(list)
    for session in sessions:
        if session.well_founded:
            for prediction in _predictions(session.left_out):
                predictions[prediction.mark.floor, prediction.mark.landmark].append(prediction)
    found = [bad for group in predictions.values() if (bad := _judged(group)) is not None]
    return sorted(found, key=lambda bad: (-bad.size_m, bad.floor, bad.landmark))


def _predictions(marks: Sequence[LeftOutMark]) -> list[_Prediction]:
    """One session's predictions, their covariances scaled by how well its other landmarks are predicted."""
    offset = np.array([mark.offset_m for mark in marks])
    covariance = _matrices([mark.covariance_m2 for mark in marks])
    survey = _matrices([mark.survey_covariance_m2 for mark in marks])
    squares = _squares(np.linalg.inv(covariance), offset)
    return [
        _Prediction(
            mark,
            offset[i],
            survey[i] + (covariance[i] - survey[i]) * max(1.0, excess(np.delete(squares, i))),
            survey[i],
        )
        for i, mark in enumerate(marks)
    ]


def pooled(offset: FloatArray, covariance: FloatArray, survey: FloatArray) -> PooledResiduals:
    """Pool offsets (s, 2) with covariances (s, 2, 2) that all include the same error of the survey (2, 2)."""
    worth = np.linalg.inv(covariance - survey)

    def weighted_mean(about: _Mean, _number: int) -> _Mean:
        factor = variance_factor(_squares(worth, offset - about.offset), 2, TAIL)
        weighted = worth / factor[:, None, None]
        spread = np.linalg.inv(weighted.sum(axis=0))
        return _Mean(spread @ np.einsum("sij,sj->i", weighted, offset), spread)

    done = iterate(
        "what sessions say together of a landmark",
        _Mean(np.median(offset, axis=0), survey),
        weighted_mean,
        lambda before, after: float(np.hypot(*(after.offset - before.offset))),
        tolerance=SETTLED_M,
        most_rounds=MOST_ROUNDS,
    )
    common = done.state
    squares = _squares(worth, offset - common.offset)
    apart = max(1.0, excess(squares)) if len(offset) > 1 else 1.0
    distance_m = np.linalg.norm(offset - common.offset, axis=1)
    return PooledResiduals(common.offset, common.covariance * apart + survey, distance_m, squares)


def _squares(worth: npt.ArrayLike, miss: FloatArray) -> FloatArray:
    """Squared lengths (s,) of offsets (s, 2) in units of the precisions ``worth`` (s, 2, 2)."""
    return np.asarray(np.einsum("si,sij,sj->s", miss, np.asarray(worth), miss))


def _judged(predictions: Sequence[_Prediction]) -> BadLandmark | None:
    together = pooled(
        np.array([one.offset for one in predictions]),
        np.array([one.covariance for one in predictions]),
        predictions[0].survey,
    )
    mark = predictions[0].mark
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
