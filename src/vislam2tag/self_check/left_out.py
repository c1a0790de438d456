"""Left-out errors: each surveyed landmark in turn is taken for unsurveyed and predicted from all the others.

No truth is needed: the surveyed place of a landmark is the truth for the walk that did without it. The gap to predict
over is twice as long as usual then, so that the errors are larger than those of the labels; but the smoother knows the
gap, and states a covariance for just this error. What says something of the labels is therefore how large the errors
are *compared with what is stated of them* (:mod:`vislam2tag.self_check.accuracy`).

The whole walk is smoothed again without the landmark. Keeping the noise levels and weights that were found with it, and
only solving again, is faster, but takes the tracker for better than it is: they have adapted to the landmark.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.contradictions import discrepancy
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.smoother import SolvedWalk, solve_walk

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

    Where the others do not tie the walk to the building without it, there is no error to tell: it is missing.
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
