"""Whether a device's metre is a metre: what all its walks say of distances between landmarks, against all others.

A tracker that takes its way for longer than it is puts landmarks apart, in all walks of its device alike: too little to
contradict the others at any one landmark.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.estimation.factors import FREE_SCALE
from vislam2tag.estimation.landmark_survey.landmark_map import LandmarkMap, join, linear_map, survey_equations
from vislam2tag.estimation.landmark_survey.local_map import LinearMap

CERTAIN_SIGMAS = 2.5
"""A device's metre contradicts where it is so many standard deviations off, from survey and from other devices' ..."""
LEAST_EXCESS = 0.01
"""... and by this share at least."""
FEWEST_WALKS = 2
"""Of a device that is compared."""
GREATEST_SIGMA = 0.1
"""A walk whose metre is not known better than this by all else tells nothing of it: it saw too few landmarks whose
places are known, or all near one another."""
SHARED_SIGMA = 0.005
"""Walks of all devices see landmarks too near, or too far apart, by this alike (assumed: where headings wander, a chord
is shorter than the way)."""
STATED_COUNTS = 1
"""That walks' metres differ as is stated (2 %) counts as much as so many walks."""


@dataclass(frozen=True)
class DeviceMetre:
    """By which share ``excess`` what a device takes for a metre is too short: it sees landmarks too far apart by that.

    ``walks`` are those that tell; ``sigma`` is the usual size of ``excess``, by the survey with the metres of all
    devices unknown; ``apart_sigmas``, by how many standard deviations it differs from that of the other devices;
    ``reach_m`` how far landmarks of its walks are from their middles, at most.
    """

    device: str
    walks: tuple[int, ...]
    excess: float
    sigma: float
    apart_sigmas: float
    reach_m: float

    @property
    def off_m(self) -> float:
        """How far off, at most, it puts landmarks of a walk, metres."""
        return abs(self.excess) * self.reach_m

    @property
    def sigmas(self) -> float:
        """By how many standard deviations survey and other devices, each, contradict it."""
        return min(abs(self.excess) / self.sigma, self.apart_sigmas)

    @property
    def contradicts(self) -> bool:
        """Whether it does not fit the others."""
        return self.sigmas > CERTAIN_SIGMAS and abs(self.excess) > LEAST_EXCESS


@dataclass(frozen=True)
class _Metres:
    """What ``t`` walks tell of their metres, each its own, with the places of all landmarks unknown except for the
    survey.

    ``information`` (t, t) and ``right`` (t,) of the shares by which they see landmarks too far apart; ``survey``
    (t, t), the part of the information's covariance that is owed to errors of the survey.
    """

    walks: IntArray
    information: FloatArray
    right: FloatArray
    survey: FloatArray

    @property
    def telling(self) -> BoolArray:
        """(t,) walks that tell something."""
        return np.asarray(np.diag(self.information) > GREATEST_SIGMA**-2)

    def select(self, keep: BoolArray) -> _Metres:
        """Those of some walks (t,), as if the metres of the others were as they state."""
        pairs = np.ix_(keep, keep)
        return _Metres(self.walks[keep], self.information[pairs], self.right[keep], self.survey[pairs])

    def pooled(self, device: IntArray) -> tuple[FloatArray, FloatArray]:
        """Metres of ``d`` devices (d,) and their covariance (d, d), from the device (t,) of each walk."""
        of_device = np.eye(int(device.max()) + 1)[device]
        covariance = _inverse(of_device.T @ self.information @ of_device)
        excess = covariance @ of_device.T @ self.right
        gain = covariance @ of_device.T
        factor = self._scale(float(excess @ of_device.T @ self.right), of_device.shape[1])
        own = factor * (self.information - self.survey)
        return excess, gain @ (own + self.survey) @ gain.T + SHARED_SIGMA**2

    def _scale(self, explained: float, devices: int) -> float:
        """By which factor the variance of walks' metres about that of their device exceeds what is stated."""
        covariance = _inverse(self.information)
        squares = float(self.right @ covariance @ self.right) - explained
        freedom = float(np.trace(covariance @ self.information)) - devices
        return (STATED_COUNTS + max(squares, 0.0)) / (STATED_COUNTS + max(freedom, 0.0))


def device_metres(joined: LandmarkMap, devices: Sequence[str], but: Collection[str] = frozenset()) -> list[DeviceMetre]:
    """Compare each of two devices or more of which several walks tell, ``but`` some.

    ``devices`` (b,) are those of the maps' walks.
    """
    metres = _metres(joined)
    metres = metres.select(metres.telling)
    of_walk = [devices[number] for number in metres.walks.tolist()]
    names = sorted(name for name in {*of_walk} - {*but} if of_walk.count(name) >= FEWEST_WALKS)
    if len(names) < 2:
        return []
    metres = metres.select(np.isin(of_walk, names))
    device = np.array([names.index(devices[number]) for number in metres.walks.tolist()])
    excess, covariance = metres.pooled(device)
    found = []
    for number, name in enumerate(names):
        walks = tuple(metres.walks[device == number].tolist())
        places = [joined.maps[walk].position for walk in walks]
        reach_m = max(float(np.abs(place - place.mean()).max()) for place in places)
        apart, sigma = _apart(excess, covariance, number), float(covariance[number, number] ** 0.5)
        found.append(DeviceMetre(name, walks, float(excess[number]), sigma, apart, reach_m))
    return found


def _apart(excess: FloatArray, covariance: FloatArray, number: int) -> float:
    """By how many standard deviations one of some metres (d,) differs from the mean of the others.

    0 if the survey contradicts these more: of two that differ, they are the culprit then.
    """
    worth = np.diag(covariance) ** -1.0 * (np.arange(len(excess)) != number)
    others = worth / worth.sum()
    if abs(excess[number]) <= abs(others @ excess):
        return 0.0
    difference = (np.arange(len(excess)) == number) - others
    return float(abs(difference @ excess) / (difference @ covariance @ difference) ** 0.5)


def in_true_metres(joined: LandmarkMap, odd: DeviceMetre) -> LandmarkMap:
    """Join again with a device's metre put right."""
    maps = [
        replace(one, position=one.position / (1 + odd.excess)) if number in odd.walks else one
        for number, one in enumerate(joined.maps)
    ]
    return join(maps, joined.priors)


def _metres(joined: LandmarkMap) -> _Metres:
    """Of all walks that are tied, by the normal equations of landmarks and metres, the landmarks eliminated."""
    walks = np.flatnonzero(joined.tied)
    of_survey, right = survey_equations(joined)
    of_places, both = of_survey.copy(), np.zeros((len(right), len(walks)))
    information, own_right = np.zeros((2, len(walks)))
    for row, number in enumerate(walks.tolist()):
        linear = linear_map(joined, number)
        of_map, of_right = linear.equations()
        of_places[np.ix_(linear.column, linear.column)] += of_map
        right[linear.column] += of_right
        longer = _longer(joined, number, linear)
        pull = longer @ linear.worth
        pull -= (pull @ linear.frame) @ linear.frame_gain
        both[linear.column, row] = pull @ linear.design
        information[row], own_right[row] = pull @ longer, pull @ linear.residual
    moved = np.linalg.solve(of_places, both)
    return _Metres(
        walks,
        np.diag(information) - both.T @ moved,
        own_right - moved.T @ right,
        moved.T @ of_survey @ moved,
    )


def _longer(joined: LandmarkMap, number: int, linear: LinearMap) -> FloatArray:
    """(r,) by what a walk's observations change with its metre."""
    arm = np.exp(-1j * joined.turn_rad[number]) * joined.position[joined.maps[number].landmark]
    arm -= arm.mean()
    longer = np.zeros(len(linear.residual))
    longer[: 2 * len(arm)] = np.column_stack((arm.real, arm.imag)).ravel()
    return longer


def _inverse(information: FloatArray) -> FloatArray:
    """Covariance of metres of which some may not be known at all."""
    return np.asarray(np.linalg.inv(information + np.eye(len(information)) * FREE_SCALE**-2))
