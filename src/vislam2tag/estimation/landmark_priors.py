"""Prior knowledge of the landmarks that a session logged, in the order of its log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, joint_columns, of_landmarks, with_rows
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import as_complex

FREE_M, FREE_RAD = 1e5, 10.0
"""Standard deviations of completely unknown values."""
AROUND_M = 2.0
"""Landmarks within this distance of a place share their errors with it equally."""


@dataclass(frozen=True)
class PlacePriors:
    """``k`` places of the camera with errors that follow those of ``m`` landmarks by ``share`` (2k, 2m) of x, y of
    each, plus own errors with covariance ``own`` (2k, 2k), m^2.
    """

    share: FloatArray
    own: FloatArray

    def own_errors(self, count: int) -> FloatArray:
        """(2m + 2k, 2m + 2k) matrix that removes from all ``count`` errors what places share with landmarks."""
        matrix = np.eye(2 * count)
        matrix[-len(self.own) :, : self.share.shape[1]] = -self.share
        return matrix


@dataclass(frozen=True)
class LandmarkPriors:
    """``m`` landmarks: ``position`` (m,) complex, metres in the BCS, NaN if not surveyed; ``covariance`` (m, 2, 2);
    ``heading_rad`` and ``heading_sigma_rad`` (m,), NaN if not surveyed. ``joint`` (3m, 3m), of x, y of each and then of
    all headings, is given if landmarks share errors; only its rows of surveyed values are valid.
    """

    position: ComplexArray
    covariance: FloatArray
    heading_rad: FloatArray
    heading_sigma_rad: FloatArray
    joint: FloatArray | None = None
    places: PlacePriors | None = None
    """If given, the last entries are places of the camera by other sessions; ``joint`` is without them."""

    @classmethod
    def of(cls, ids: tuple[str, ...], landmarks: Landmarks) -> LandmarkPriors:
        """Look up the ids of a log; ids without a landmark are not surveyed."""
        priors = cls.nothing(len(ids))
        here = [i for i, name in enumerate(ids) if name in landmarks.surveyed_ids]
        rows = [landmarks.index[ids[i]] for i in here]
        priors.position[here] = as_complex(landmarks.position_bcs[rows])
        priors.covariance[here] = landmarks.covariance_bcs[rows]
        headed = np.isfinite(landmarks.heading_rad[rows]) & np.isfinite(landmarks.heading_sigma_rad[rows])
        priors.heading_rad[here] = np.where(headed, landmarks.heading_rad[rows], np.nan)
        priors.heading_sigma_rad[here] = np.where(headed, landmarks.heading_sigma_rad[rows], np.nan)
        if landmarks.joint_covariance is None:
            return priors
        known = joint_columns(np.array(here, dtype=np.int64), len(ids))
        joint = np.full((3 * len(ids), 3 * len(ids)), np.nan)
        joint[np.ix_(known, known)] = of_landmarks(landmarks.joint_covariance, np.array(rows, dtype=np.int64))
        return replace(priors, joint=joint)

    @classmethod
    def nothing(cls, count: int) -> LandmarkPriors:
        """Landmarks without any survey."""
        unknown = np.full(count, np.nan)
        return cls(unknown + 0j, np.full((count, 2, 2), np.nan), unknown.copy(), unknown.copy())

    @property
    def landmarks(self) -> LandmarkPriors:
        """The landmarks alone, without places of the camera."""
        if self.places is None:
            return self
        marks = len(self.position) - len(self.places.own) // 2
        names = ("position", "covariance", "heading_rad", "heading_sigma_rad")
        return with_rows(replace(self, places=None), slice(marks), *names)

    @property
    def surveyed(self) -> BoolArray:
        """Mask (m,) of the landmarks with a position."""
        return np.asarray(np.isfinite(self.position))

    @cached_property
    def precision(self) -> FloatArray:
        """(m, 2, 2) inverse of :attr:`covariance`, 1/m^2; nearly 0 if not surveyed."""
        each = np.tile(np.eye(2) * FREE_M**-2, (len(self.position), 1, 1))
        each[self.surveyed] = np.linalg.inv(self.covariance[self.surveyed])
        return each

    def shared_covariance(self, position: ComplexArray) -> FloatArray:
        """(n, 2, 2) covariance that places (n,) on walks share with the landmarks around them
        (:func:`landmark_shares`)."""
        known = np.repeat(self.surveyed, 2)
        covariance = np.zeros((len(known), len(known)))
        if self.joint is None:
            own = np.arange(len(known)).reshape(-1, 2)
            covariance[own[:, :, None], own[:, None, :]] = self.covariance
        else:
            covariance[:] = self.joint[: len(known), : len(known)]
        share = landmark_shares(self, position)[:, known].reshape(len(position), 2, -1)
        return np.asarray(share @ covariance[np.ix_(known, known)] @ share.transpose(0, 2, 1))

    def with_another(self) -> LandmarkPriors:
        """Add a landmark, the last, which is not surveyed."""
        return self._with_more(np.array([np.nan + 0j]), np.full((1, 2, 2), np.nan))

    def _with_more(self, position: ComplexArray, covariance: FloatArray) -> LandmarkPriors:
        """Add further places (k,), with covariances (k, 2, 2) and unknown headings."""
        unknown = np.full(len(position), np.nan)
        return replace(
            self,
            position=np.concatenate((self.position, position)),
            covariance=np.concatenate((self.covariance, covariance)),
            heading_rad=np.concatenate((self.heading_rad, unknown)),
            heading_sigma_rad=np.concatenate((self.heading_sigma_rad, unknown)),
        )

    def with_places(self, position: ComplexArray, covariance: FloatArray) -> LandmarkPriors:
        """Add places (k,) of the camera after the landmarks, by other sessions; ``covariance`` (2k, 2k), m^2.

        The others were mapped with the same landmarks: if these are wrong, so are places between them.
        """
        each = np.arange(2 * len(position)).reshape(-1, 2)
        more = self._with_more(position, covariance[each[:, :, None], each[:, None, :]])
        return replace(more, places=PlacePriors(landmark_shares(self, position), covariance))

    def without(self, landmark: int) -> LandmarkPriors:
        """Remove the prior of one landmark."""
        one = np.arange(len(self.position)) == landmark
        return replace(
            self,
            position=np.where(one, np.nan, self.position),
            covariance=np.where(one[:, None, None], np.nan, self.covariance),
            heading_rad=np.where(one, np.nan, self.heading_rad),
            heading_sigma_rad=np.where(one, np.nan, self.heading_sigma_rad),
        )


def landmark_shares(priors: LandmarkPriors, position: ComplexArray) -> FloatArray:
    """(2n, 2m) shares of the landmarks' errors in the errors of places (n,) on walks, for x and y.

    Places between landmarks follow those around them, by the inverse square of the distance.
    """
    worth = np.where(priors.surveyed, 1 / (np.abs(position[:, None] - priors.position) ** 2 + AROUND_M**2), 0.0)
    share = worth / np.maximum(worth.sum(axis=1, keepdims=True), 1e-12)
    return np.asarray(np.kron(share, np.eye(2)), dtype=np.float64)


def survey_precisions(priors: LandmarkPriors, factor: FloatArray) -> list[FloatArray]:
    """Precisions (3m, 3m), to be added up, of the survey and other sessions on the landmarks' unknowns.

    ``factor`` (m,) is on each place's variance, :attr:`vislam2tag.estimation.factors.VarianceFactors.landmark`.
    """
    if priors.places is not None:
        return _with_places(priors, priors.places, factor)
    if priors.joint is not None:
        return [_joint_precision(priors.joint, priors, factor)]
    marks, surveyed = len(priors.position), priors.surveyed
    each = priors.precision / np.where(surveyed, factor, 1.0)[:, None, None]
    sigma = np.where(np.isfinite(priors.heading_sigma_rad), priors.heading_sigma_rad, FREE_RAD)
    precision = np.diag(np.concatenate((np.zeros(2 * marks), sigma**-2)))
    column = np.arange(2 * marks).reshape(-1, 2)
    precision[column[:, :, None], column[:, None, :]] = each
    return [precision]


def _with_places(priors: LandmarkPriors, places: PlacePriors, factor: FloatArray) -> list[FloatArray]:
    """The survey of the landmarks, and places by other sessions that depend on these.

    Only the own errors of a place are reweighted.
    """
    survey, marks = priors.landmarks, len(priors.position)
    count = len(survey.position)
    column = np.ix_(*[joint_columns(np.arange(count), marks)] * 2)
    precisions = [np.zeros((3 * marks, 3 * marks)) for _ in range(2)]
    precisions[0][column] = sum(survey_precisions(survey, factor[:count]))
    doubt = np.sqrt(np.repeat(factor[count:], 2))
    errors = places.own_errors(marks)[-len(doubt) :]
    precisions[1][: 2 * marks, : 2 * marks] = errors.T @ np.linalg.inv(places.own * np.outer(doubt, doubt)) @ errors
    heading = 2 * marks + np.arange(count, marks)
    precisions[1][heading, heading] = FREE_RAD**-2
    return precisions


def _joint_precision(joint: FloatArray, priors: LandmarkPriors, factor: FloatArray) -> FloatArray:
    """(3m, 3m) precision of a survey with shared errors (covariance ``joint`` (3m, 3m)); nearly 0 elsewhere.

    A landmark is reweighted with all errors that it shares.
    """
    marks = len(priors.position)
    known = np.concatenate((np.repeat(priors.surveyed, 2), np.isfinite(priors.heading_rad)))
    doubt = np.sqrt(np.concatenate((np.repeat(factor, 2), np.ones(marks))))[known]
    precision = np.diag(np.concatenate((np.full(2 * marks, FREE_M), np.full(marks, FREE_RAD))) ** -2.0)
    rows = np.flatnonzero(known)
    precision[np.ix_(rows, rows)] = np.linalg.inv(joint[np.ix_(rows, rows)] * np.outer(doubt, doubt))
    return precision
