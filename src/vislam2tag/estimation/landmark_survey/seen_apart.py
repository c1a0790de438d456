"""What the walks of a day saw of a landmark, taken for sights of another one: how far apart the two lie.

Each of their sights may be too uncertain to contradict all others alone, but all err alike where the sheet hung
elsewhere on that day.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.landmark_survey.changed_map import apart, predicted
from vislam2tag.estimation.landmark_survey.comparison import Comparison
from vislam2tag.estimation.landmark_survey.landmark_map import LandmarkMap

SUSPECT_SIGMAS = 2.5
"""Looked at more closely is a day whose sights, taken for independent, put a landmark so far off."""
FEWEST_SIGHTS = 2
"""A day is more than one walk ..."""
FEWEST_OTHERS = 2
"""... and contradicts as many others at least: the survey, and walks of other days."""


def seen_apart(split: LandmarkMap, landmark: int) -> Comparison:
    """From where all others have a landmark to where the walks that are ``apart`` have it, the last of the map."""
    new = len(split.position) - 1
    offset = split.position[new] - split.position[landmark]
    columns = (2 * np.array([[landmark], [new]]) + (0, 1)).ravel()
    difference = np.hstack((-np.eye(2), np.eye(2)))
    covariance = difference @ split.covariance[np.ix_(columns, columns)] @ difference.T
    return Comparison.of(landmark, None, np.array([offset.real, offset.imag]), covariance)


def survey_left_out(joined: LandmarkMap, landmark: int) -> Comparison:
    """From where all others have a landmark to its surveyed place, doubts found anew."""
    trial, priors = predicted(joined, landmark), joined.priors
    offset = priors.position[landmark] - trial.position[landmark]
    covariance = trial.position_covariance[landmark] + priors.covariance[landmark]
    return Comparison.of(landmark, None, np.array([offset.real, offset.imag]), covariance)


def days_compared(joined: LandmarkMap, sights: Sequence[Comparison], days: Sequence[str | None]) -> list[Comparison]:
    """Compare what the walks of each day saw of a landmark, where they seem to see it off; ``days`` (b,).

    Left out are those that one of the day's walks alone, or the landmark's survey, accounts for.
    """
    seen: dict[int, dict[str | None, list[Comparison]]] = defaultdict(lambda: defaultdict(list))
    for one in sights:
        if one.walk is not None and np.isfinite(one.sigmas):
            seen[one.landmark][days[one.walk]].append(one)
    found = []
    for landmark, by_day in seen.items():
        others = int(joined.priors.surveyed[landmark]) + sum(map(len, by_day.values()))
        for day, own in by_day.items():
            if day is not None and len(own) >= FEWEST_SIGHTS and others - len(own) >= FEWEST_OTHERS and _suspect(own):
                walks = [one.walk for one in own if one.walk is not None]
                split = apart(joined, landmark, walks)
                compared = seen_apart(split, landmark)
                alone = (seen_apart(apart(joined, landmark, [walk]), landmark).sigmas for walk in walks)
                if all(one <= compared.sigmas for one in alone) and _survey_agrees(split, landmark):
                    found.append(replace(compared, day=day))
    return found


def _survey_agrees(split: LandmarkMap, landmark: int) -> bool:
    """Whether other days have a landmark nearer to its survey than to where the day has it, which is the last one."""
    if not split.priors.surveyed[landmark]:
        return True
    others = predicted(split, landmark)
    worth = np.linalg.inv(others.position_covariance[landmark])
    off = np.array([split.priors.position[landmark], others.position[-1]]) - others.position[landmark]
    to_survey, to_day = np.einsum("ni,ij,nj->n", as_points(off), worth, as_points(off))
    return bool(to_survey < to_day)


def _suspect(sights: Sequence[Comparison]) -> bool:
    worth = np.array([one.sigma_m**-2 for one in sights])
    return bool(abs(worth @ [one.offset for one in sights]) > SUSPECT_SIGMAS * worth.sum() ** 0.5)
