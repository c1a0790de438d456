"""Scale of a device: the distances between landmarks in all its walks, compared with all others.

A tracker with a wrong scale moves landmarks apart, in all walks of its device equally. At a single landmark this is too
little to contradict the others.
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
"""A device's scale contradicts if it differs by this many standard deviations from survey and other devices ..."""
LEAST_EXCESS = 0.01
"""... and by at least this share."""
FEWEST_WALKS = 2
"""Number of walks of a device that a comparison needs."""
GREATEST_SIGMA = 0.1
"""A walk with a less certain scale is ignored: it saw too few landmarks of known place, or all close together."""
SHARED_SIGMA = 0.005
"""Common scale error of the sightings of all devices (assumed: if headings wander, a chord is shorter than the
path)."""
STATED_COUNTS = 1
"""Weight of the stated spread of walks' scales (2 %), in walks."""


@dataclass(frozen=True)
class DeviceMetre:
    """Scale error ``excess`` of a device: the share by which it sees landmarks too far apart.

    ``walks`` are those used; ``sigma`` is the standard deviation of ``excess`` by the survey, with unknown scales of
    all devices. ``apart_sigmas`` is the difference from the other devices in standard deviations, and ``reach_m`` the
    largest distance of landmarks from the middle of their walk.
    """

    device: str
    walks: tuple[int, ...]
    excess: float
    sigma: float
    apart_sigmas: float
    reach_m: float

    @property
    def off_m(self) -> float:
        """Largest error of landmarks in a walk from this scale, metres."""
        return abs(self.excess) * self.reach_m

    @property
    def sigmas(self) -> float:
        """Contradiction by survey and by other devices in standard deviations; the smaller of both."""
        return min(abs(self.excess) / self.sigma, self.apart_sigmas)

    @property
    def contradicts(self) -> bool:
        """Whether it does not fit the others."""
        return self.sigmas > CERTAIN_SIGMAS and abs(self.excess) > LEAST_EXCESS


@dataclass(frozen=True)
class _Metres:
    """Information of ``t`` walks on their scales, each its own, with the places of all landmarks unknown except for the
    survey.

    ``information`` (t, t) and ``right`` (t,) of the shares by which they see landmarks too far apart; ``survey`` (t, t)
    is the part of the covariance from errors of the survey.
    """

    walks: IntArray
    information: FloatArray
    right: FloatArray
    survey: FloatArray

    @property
    def telling(self) -> BoolArray:
        """(t,) walks with any information."""
        return np.asarray(np.diag(self.information) > GREATEST_SIGMA**-2)

    def select(self, keep: BoolArray) -> _Metres:
        """Select walks (t,), as if the others had the scales that they state."""
        pairs = np.ix_(keep, keep)
        return _Metres(self.walks[keep], self.information[pairs], self.right[keep], self.survey[pairs])

    def pooled(self, device: IntArray) -> tuple[FloatArray, FloatArray]:
        """Scales of ``d`` devices (d,) and their covariance (d, d), from the device (t,) of each walk."""
        of_device = np.eye(int(device.max()) + 1)[device]
        covariance = _inverse(of_device.T @ self.information @ of_device)
        excess = covariance @ of_device.T @ self.right
        gain = covariance @ of_device.T
        factor = self._scale(float(excess @ of_device.T @ self.right), of_device.shape[1])
        own = factor * (self.information - self.survey)
        return excess, gain @ (own + self.survey) @ gain.T + SHARED_SIGMA**2

    def _scale(self, explained: float, devices: int) -> float:
        """Factor by which the variance of walks' scales around that of their device exceeds the stated one."""
        covariance = _inverse(self.information)
        squares = float(self.right @ covariance @ self.right) - explained
        freedom = float(np.trace(covariance @ self.information)) - devices
        return (STATED_COUNTS + max(squares, 0.0)) / (STATED_COUNTS + max(freedom, 0.0))


def device_metres(joined: LandmarkMap, devices: Sequence[str], but: Collection[str] = frozenset()) -> list[DeviceMetre]:
    """Compare the scale of each device with several walks, if there are two or more devices, ``but`` not of some.

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
    """Difference of one of some scales (d,) from the mean of the others, in standard deviations.

    0 if the survey contradicts the others more: of two that differ, they are then wrong.
    """
    worth = np.diag(covariance) ** -1.0 * (np.arange(len(excess)) != number)
    others = worth / worth.sum()
    if abs(excess[number]) <= abs(others @ excess):
        return 0.0
    difference = (np.arange(len(excess)) == number) - others
    return float(abs(difference @ excess) / (difference @ covariance @ difference) ** 0.5)


def in_true_metres(joined: LandmarkMap, odd: DeviceMetre) -> LandmarkMap:
    """Join again with the scale of a device corrected."""
    maps = [
        replace(one, position=one.position / (1 + odd.excess)) if number in odd.walks else one
        for number, one in enumerate(joined.maps)
    ]
    return join(maps, joined.priors)


def _metres(joined: LandmarkMap) -> _Metres:
    """Scales of all connected walks, from the normal equations of landmarks and scales without the landmarks."""
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
    """(r,) derivative of a walk's observations by its scale."""
    arm = np.exp(-1j * joined.turn_rad[number]) * joined.position[joined.maps[number].landmark]
    arm -= arm.mean()
    longer = np.zeros(len(linear.residual))
    longer[: 2 * len(arm)] = np.column_stack((arm.real, arm.imag)).ravel()
    return longer


def _inverse(information: FloatArray) -> FloatArray:
    """Covariance of scales, some of which may be unknown."""
    return np.asarray(np.linalg.inv(information + np.eye(len(information)) * FREE_SCALE**-2))
