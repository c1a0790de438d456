"""The joint map as it would be if one thing were otherwise: a landmark not surveyed, or sights taken for another's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vislam2tag.core.robust import iterate
from vislam2tag.estimation.landmark_survey.landmark_map import (
    MOST_ROUNDS,
    Doubts,
    LandmarkMap,
    moved_m,
    solved,
    solved_anew,
)

SETTLED_M = 0.01
"""To compare a survey with all others, which tell its place to several centimetres at best, less will do."""


def predicted(joined: LandmarkMap, landmark: int) -> LandmarkMap:
    """Join again as if one landmark were not surveyed, from its best sight in a walk being a usual one.

    Doubts are found anew: a wrong survey has made walks past it look worse than they are.
    """
    trial = replace(_sights_usual(joined, landmark), priors=joined.priors.without(landmark))
    return _joined_again(trial)


def apart(joined: LandmarkMap, landmark: int, walks: Sequence[int]) -> LandmarkMap:
    """Join again as if some walks had seen another landmark, which nobody surveyed: it becomes the last one."""
    new, trial = len(joined.position), _sights_usual(joined, landmark)
    maps = list(joined.maps)
    for number in walks:
        own = maps[number].landmark
        maps[number] = replace(maps[number], landmark=np.where(own == landmark, new, own))
    return _joined_again(
        replace(
            trial,
            maps=tuple(maps),
            priors=joined.priors.with_another(),
            doubts=replace(trial.doubts, survey=np.append(trial.doubts.survey, 1.0)),
            position=np.append(joined.position, joined.position[landmark]),
            heading_rad=np.append(joined.heading_rad, joined.heading_rad[landmark]),
        )
    )


def _sights_usual(joined: LandmarkMap, landmark: int) -> LandmarkMap:
    """Doubt sights of a landmark by as much less that the best of them is a usual one."""
    rows = [one.landmark == landmark for one in joined.maps]
    least = min(
        (shift[row].min() for shift, row in zip(joined.doubts.shift, rows, strict=True) if row.any()), default=1
    )
    shift = tuple(np.where(row, old / least, old) for old, row in zip(joined.doubts.shift, rows, strict=True))
    return replace(joined, doubts=replace(joined.doubts, shift=shift))


def _joined_again(trial: LandmarkMap) -> LandmarkMap:
    """Solve a joint map that differs a little from the one it was made of, its doubts found anew."""
    done = iterate(
        "the joint landmark map with a change",
        solved(trial),
        lambda before, _: solved_anew(before),
        moved_m,
        tolerance=SETTLED_M,
        most_rounds=MOST_ROUNDS,
    )
    return solved_anew(done.state, Doubts.expected)
