"""Finds wrong references: a surveyed place that the walks contradict, or what one walk saw of a landmark.

Survey and walks vote. Each reference is compared with what all others say, in units of the uncertainties of both. A
survey is compared with the map without it. A walk's sight of a landmark is compared with the survey, all other walks
and the rest of its own map, and so are the sights of all walks of a day. The reference with the greatest contradiction
is removed, and all are compared again, so that its consequences are not reported as faults of others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import joint_columns
from vislam2tag.core.robust import TRUSTED_MEAN_SQUARE, trusted
from vislam2tag.estimation.landmark_survey.comparison import (
    GREATEST_SIGMA_M,
    Comparison,
    OtherWalks,
    Verdict,
    days_compared,
    survey_left_out,
)
from vislam2tag.estimation.landmark_survey.device_metre import DeviceMetre, device_metres, in_true_metres
from vislam2tag.estimation.landmark_survey.landmark_map import SHIFT_DOF, LandmarkMap, join, linear_map

SUSPECT_SIGMAS, SUSPECT_FACTOR = 1.5, 1.5
"""A survey is tested with a full solution if it differs by this many standard deviations, or if a walk's sight of it
has this factor on its variance."""
SHARED_SIGMAS = 2.5
"""If two walks and all walks together miss a surveyed place by this many standard deviations, the survey is wrong."""
MOST_ODD = 20
"""Number of removed references above which the survey as a whole does not fit."""
STATED_COUNTS = 10
"""Weight of the stated uncertainties in the a-posteriori variance factor, in comparisons."""
FEWEST_OTHERS = 2
"""Number of other references of its kind that are needed to contradict one."""


@dataclass(frozen=True)
class Votes:
    """All comparisons after those in ``odd``, greatest first, were removed; ``odd`` as they were before.

    ``joined`` is the map without them, with corrected scales of ``odd_devices``.
    """

    odd: tuple[Comparison, ...]
    fitting: tuple[Comparison, ...]
    joined: LandmarkMap
    odd_devices: tuple[DeviceMetre, ...] = ()


def vote(joined: LandmarkMap, days: Sequence[str | None] = (), devices: Sequence[str] = ()) -> Votes:
    """Remove the reference that contradicts the others most, until none does.

    With ``days`` (b,) of the maps' walks the sights of each day are compared, too; with ``devices`` (b,) also the
    scales of devices.
    """
    odd: list[Comparison] = []
    odd_devices, joined = _devices_put_right(joined, devices)
    while True:
        compared = _compared(joined, days if len(set(days)) > 1 else ())
        contradicting = [one for one in compared if one.verdict is Verdict.CONTRADICTS]
        if not contradicting or len(odd) == MOST_ODD:
            break
        odd.append(_culprit(max(contradicting, key=lambda one: one.excess), compared))
        joined = _without(joined, odd[-1], days)
    fitting = tuple(one for one in compared if one.day is None)
    return Votes(tuple(sorted(odd, key=lambda one: -one.size_m)), fitting, joined, tuple(odd_devices))


def _devices_put_right(joined: LandmarkMap, devices: Sequence[str]) -> tuple[list[DeviceMetre], LandmarkMap]:
    """Correct the scale of the device that contradicts the others most, until none does.

    A corrected device has its scale from the survey and is no longer compared.
    """
    odd: list[DeviceMetre] = []
    for _ in set(devices):
        compared = device_metres(joined, devices, {one.device for one in odd})
        contradicting = [one for one in compared if one.contradicts]
        if not contradicting:
            break
        odd.append(max(contradicting, key=lambda one: one.sigmas))
        joined = in_true_metres(joined, odd[-1])
    return odd, joined


def _compared(joined: LandmarkMap, days: Sequence[str | None]) -> list[Comparison]:
    """All comparisons; of days those that may be wrong."""
    surveys, sights = _surveys(joined), _sights(joined)
    of_days = days_compared(joined, sights, days) if days else []
    by_survey, by_sight = _scale(surveys), _scale(sights)
    # Single sights with smaller errors than stated do not imply smaller common errors of a day.
    by_day = max(by_sight, 1.0)
    return [
        *(one.in_units_of(by_survey) for one in surveys),
        *(one.in_units_of(by_sight) for one in sights),
        *(one.in_units_of(by_day) for one in of_days),
    ]


def _culprit(found: Comparison, compared: Sequence[Comparison]) -> Comparison:
    """The survey of a landmark, if several walks miss it or only one passed it; otherwise what was found.

    A day that contradicts the others explains the misfits of its walks and of the survey.
    """
    of_landmark = [one for one in compared if one.landmark == found.landmark]
    of_days = [one for one in of_landmark if one.day is not None and one.verdict is Verdict.CONTRADICTS]
    if of_days:
        return max(of_days, key=lambda one: one.sigmas)
    sights = [one for one in of_landmark if one.walk is not None]
    missing = [one for one in sights if one.sigmas > SHARED_SIGMAS]
    survey = next((one for one in of_landmark if one.of_survey and one.sigmas > SHARED_SIGMAS), None)
    return survey if survey is not None and (len(missing) > 1 or len(sights) == 1) else found


def _scale(compared: Sequence[Comparison]) -> float:
    """Factor by which comparisons of one kind exceed the stated uncertainties, robustly estimated.

    Baarda's data snooping with the variance factor a posteriori (Pope 1976).
    """
    squares = np.array([one.sigmas for one in compared]) ** 2
    least = trusted(squares[np.isfinite(squares)])
    return float(np.sqrt((STATED_COUNTS + least.sum() / TRUSTED_MEAN_SQUARE) / (STATED_COUNTS + len(least))))


def _without(joined: LandmarkMap, odd: Comparison, days: Sequence[str | None]) -> LandmarkMap:
    """The joint map without one reference."""
    if odd.of_survey:
        return join(joined.maps, joined.priors.without(odd.landmark))
    walks = {odd.walk} if odd.day is None else {number for number, day in enumerate(days) if day == odd.day}
    return join(
        [
            one.select(one.landmark != odd.landmark) if number in walks else one
            for number, one in enumerate(joined.maps)
        ],
        joined.priors,
    )


def _surveys(joined: LandmarkMap) -> list[Comparison]:
    """Each surveyed landmark against all walks and the survey of the others."""
    tied = [one for one, used in zip(joined.maps, joined.tied.tolist(), strict=True) if used]
    passed = np.unique(np.concatenate([one.landmark for one in tied] or [np.empty(0, dtype=np.int64)]))
    surveyed = np.flatnonzero(joined.priors.surveyed)
    enough = len(np.intersect1d(surveyed, passed)) > FEWEST_OTHERS
    return [
        _survey(joined, landmark) if enough and landmark in passed else Comparison(landmark, None)
        for landmark in surveyed.tolist()
    ]


def _survey(joined: LandmarkMap, landmark: int) -> Comparison:
    """Compare a survey by removing it from the solution; if it looks wrong, or a walk has a low weight instead, by
    solving again."""
    surveyed, own = joined.priors.position[landmark], joined.priors.covariance[landmark]
    with_it = np.linalg.inv(joined.position_covariance[landmark])
    information = with_it - np.linalg.inv(own * joined.doubts.survey[landmark])
    if np.linalg.eigvalsh(information)[0] > GREATEST_SIGMA_M**-2:
        miss = joined.position[landmark] - surveyed
        offset = -np.linalg.solve(information, with_it @ (miss.real, miss.imag))
        quick = Comparison.of(landmark, None, offset, np.linalg.inv(information) + own)
        if quick.sigmas < SUSPECT_SIGMAS and _sights_trusted(joined, landmark):
            return quick
    return survey_left_out(joined, landmark)


def _sights_trusted(joined: LandmarkMap, landmark: int) -> bool:
    """Whether no walk's sight of the landmark has an unusually low weight."""
    factors = [shift[one.landmark == landmark] for one, shift in zip(joined.maps, joined.doubts.shift, strict=True)]
    return bool(np.concatenate(factors).max(initial=0.0) < SUSPECT_FACTOR * (SHIFT_DOF + 2) / SHIFT_DOF)


def _sights(joined: LandmarkMap) -> list[Comparison]:
    """Sights of each connected walk of each landmark, compared with all others and the rest of its own map."""
    others = OtherWalks(joined)
    return [one for number in np.flatnonzero(joined.tied).tolist() for one in _of_walk(joined, others, number)]


def _of_walk(joined: LandmarkMap, others: OtherWalks, number: int) -> list[Comparison]:
    own = joined.maps[number]
    told = others.told(number)
    known = np.isin(own.landmark, told.landmark)
    nothing = [Comparison(landmark, number) for landmark in own.landmark[~known].tolist()]
    if np.sum(known) <= FEWEST_OTHERS:
        return [Comparison(landmark, number) for landmark in own.landmark.tolist()]
    rows = np.flatnonzero(known)
    at = np.searchsorted(told.landmark, own.landmark[rows])
    places = np.arange(2 * len(rows))
    # Linearised about the places by the others, so that residuals are the walk's misfit; their covariance is included.
    moved = replace(joined, position=joined.position.copy())
    moved.position[told.landmark] = told.position
    linear = linear_map(moved, number)
    keep = (2 * rows[:, None] + (0, 1)).ravel()
    design = linear.design[np.ix_(keep, keep)]
    spread = told.covariance[np.ix_(*[joint_columns(at, len(told.landmark))[places]] * 2)]
    whole = linear.own[np.ix_(keep, keep)] + np.diag(linear.shift[keep]) + design @ spread @ design.T
    frame, residual = linear.frame[keep], linear.residual[keep]
    worth = np.linalg.inv(whole)
    pull = frame.T @ worth
    worth -= pull.T @ np.linalg.solve(pull @ frame, pull)
    usual_m2, turn = joined.doubts.shift_m**2, np.exp(1j * joined.turn_rad[number])
    found = []
    for row in range(len(rows)):
        pair = slice(2 * row, 2 * row + 2)
        # The prediction of one observation by all others, with its uncertainty, from the inverse of the covariance.
        covariance = np.linalg.inv(worth[pair, pair])
        offset = covariance @ (worth @ residual)[pair]
        covariance -= np.eye(2) * (linear.shift[keep][2 * row] - usual_m2)
        rotation = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
        landmark = int(own.landmark[rows[row]])
        found.append(Comparison.of(landmark, number, rotation @ offset, rotation @ covariance @ rotation.T))
    return nothing + found
