"""Which reference is the odd one out: a surveyed place that the walks contradict, or what one walk saw of a landmark.

Survey and walks vote. What each says of a landmark is compared with what all others say of it, in units of what both
admit: a survey with the map that does without it, a walk's sight of a landmark with the survey, all other walks and
the rest of its own map; so is what all walks of a day saw of it. The greatest contradiction is believed, its reference
left out, and all are asked again, so that one fault is not told of those that it bends.
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
"""A survey is looked at more closely that is so many standard deviations off, or whose landmark a walk is taken to have
seen with so many times the usual variance."""
SHARED_SIGMAS = 2.5
"""Where two walks miss the surveyed place of a landmark by so many, and all together do, its survey is wrong."""
MOST_ODD = 20
"""So many are left out before a survey is taken for one that does not fit at all."""
STATED_COUNTS = 10
"""What is stated counts as much as so many comparisons in the variance factor a posteriori."""
FEWEST_OTHERS = 2
"""So many other references of its kind must stand beside one to contradict it."""


@dataclass(frozen=True)
class Votes:
    """All references compared once those in ``odd``, greatest first, were left out; ``odd`` as they were till then.

    ``joined`` is the map without them, and with the metres of ``odd_devices`` put right.
    """

    odd: tuple[Comparison, ...]
    fitting: tuple[Comparison, ...]
    joined: LandmarkMap
    odd_devices: tuple[DeviceMetre, ...] = ()


def vote(joined: LandmarkMap, days: Sequence[str | None] = (), devices: Sequence[str] = ()) -> Votes:
    """Leave out the reference that contradicts the others most, until none does.

    With ``days`` (b,), on which each map's walk was made, what the walks of a day saw is compared, too; with
    ``devices`` (b,) by which it was, what each of these takes for a metre.
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
    """Put right the metre of the device that contradicts the others most, until none does.

    One that was put right says nothing of the others any more: it has its metre from the survey.
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
    """All references; of days those that may be odd."""
    surveys, sights = _surveys(joined), _sights(joined)
    of_days = days_compared(joined, sights, days) if days else []
    by_survey, by_sight = _scale(surveys), _scale(sights)
    # That single sights are closer than stated says nothing of what those of a day have in common.
    by_day = max(by_sight, 1.0)
    return [
        *(one.in_units_of(by_survey) for one in surveys),
        *(one.in_units_of(by_sight) for one in sights),
        *(one.in_units_of(by_day) for one in of_days),
    ]


def _culprit(found: Comparison, compared: Sequence[Comparison]) -> Comparison:
    """The survey of a landmark, where several walks miss it or one alone passed it; else what was found.

    A day that contradicts the others accounts for what its walks miss: neither one of them nor the survey does.
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
    """By which factor comparisons of one kind are off by more than was stated, robustly.

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
    """By taking its survey out of the solution; where that looks odd, or a walk is doubted instead, by solving
    again."""
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
    """Whether no walk is taken to have seen the landmark much farther off than usual."""
    factors = [shift[one.landmark == landmark] for one, shift in zip(joined.maps, joined.doubts.shift, strict=True)]
    return bool(np.concatenate(factors).max(initial=0.0) < SUSPECT_FACTOR * (SHIFT_DOF + 2) / SHIFT_DOF)


def _sights(joined: LandmarkMap) -> list[Comparison]:
    """What each walk that is tied saw of each landmark, against all others and the rest of its own map."""
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
    # About the places told, so that residuals are what the walk misses them by; their own spread is carried along.
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
        # Of one observation, what all others predict of it and how well, from the inverse of the whole covariance.
        covariance = np.linalg.inv(worth[pair, pair])
        offset = covariance @ (worth @ residual)[pair]
        covariance -= np.eye(2) * (linear.shift[keep][2 * row] - usual_m2)
        rotation = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
        landmark = int(own.landmark[rows[row]])
        found.append(Comparison.of(landmark, number, rotation @ offset, rotation @ covariance @ rotation.T))
    return nothing + found
