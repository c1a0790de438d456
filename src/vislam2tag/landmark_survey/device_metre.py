"""Whether a device's metre is a metre: what all its walks say of distances between landmarks, against all others.

A tracker that takes its way for longer than it is puts landmarks apart, in all walks of its device alike: too little to
contradict the others at any one landmark.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, joint_columns
from vislam2tag.landmark_survey.landmark_map import LandmarkMap, join, linear_map
from vislam2tag.landmark_survey.other_walks import OtherWalks, ToldPlaces

CERTAIN_SIGMAS = 2.5
"""A device's metre contradicts where it is so many standard deviations off, from survey and from other devices' ..."""
LEAST_EXCESS = 0.01
"""... and by this share at least."""
FEWEST_WALKS, FEWEST_LANDMARKS = 2, 2
"""Of a device whose walks are compared, and of a walk."""
STATED_COUNTS = 1
"""That walks' metres differ as is stated (2 %) counts as much as so many walks."""


@dataclass(frozen=True)
class DeviceMetre:
    """By which share ``excess`` what a device takes for a metre is too short: it sees landmarks too far apart by that.

    ``sigma`` is the usual size of that, ``reach_m`` how far landmarks of its walks are from their middles, at most;
    ``apart_sigmas``, by how many standard deviations it differs from that of the other devices.
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


def device_metres(joined: LandmarkMap, devices: Sequence[str]) -> list[DeviceMetre]:
    """Compare each of two devices or more that several tied walks are of; ``devices`` (b,), of each map's walk."""
    walks = {
        device: tuple(n for n in np.flatnonzero(joined.tied).tolist() if devices[n] == device)
        for device in sorted(set(devices))
    }
    pooled = {device: _metre(joined, own, own) for device, own in walks.items() if len(own) >= FEWEST_WALKS}
    pooled = {device: one for device, one in pooled.items() if np.isfinite(one[1])}
    if len(pooled) < 2:
        return []
    factor = _scale(joined, {device: walks[device] for device in pooled}, pooled)
    return [_compared(joined, device, walks[device], pooled, factor) for device in pooled]


def _compared(
    joined: LandmarkMap, device: str, own: tuple[int, ...], pooled: Mapping[str, tuple[float, float]], factor: float
) -> DeviceMetre:
    excess, sigma = pooled[device]
    others = np.array([one for other, one in pooled.items() if other != device])
    worth = others[:, 1] ** -2
    usual = float(worth @ others[:, 0] / worth.sum())
    apart = abs(excess - usual) / float(np.hypot(sigma, worth.sum() ** -0.5)) / factor
    # Of two that contradict one another, it is the one that the survey contradicts more.
    apart = apart if abs(excess) > abs(usual) else 0.0
    places = [joined.maps[number].position for number in own]
    reach_m = max(float(np.abs(place - place.mean()).max()) for place in places)
    return DeviceMetre(device, own, excess, sigma * factor, apart, reach_m)


def in_true_metres(joined: LandmarkMap, odd: DeviceMetre) -> LandmarkMap:
    """Join again with a device's metre put right."""
    maps = [
        replace(one, position=one.position / (1 + odd.excess)) if number in odd.walks else one
        for number, one in enumerate(joined.maps)
    ]
    return join(maps, joined.priors)


def _scale(
    joined: LandmarkMap, walks: Mapping[str, tuple[int, ...]], pooled: Mapping[str, tuple[float, float]]
) -> float:
    """By which factor walks' metres differ more than stated from that of their device."""
    squares = 0.0
    for device, own in walks.items():
        for number in own:
            excess, sigma = _metre(joined, (number,), own)
            squares += ((excess - pooled[device][0]) / sigma) ** 2
    freedom = sum(map(len, walks.values())) - len(walks)
    return float(np.sqrt((STATED_COUNTS + squares) / (STATED_COUNTS + freedom)))


def _metre(joined: LandmarkMap, walks: Sequence[int], device: Sequence[int]) -> tuple[float, float]:
    """By which share some walks of a device see landmarks too far apart, and its standard deviation.

    One least squares of all of them, where survey and walks of other devices have the landmarks.
    """
    turn_rad = joined.turn_rad.copy()
    turn_rad[list(device)] = np.nan
    told = OtherWalks(replace(joined, turn_rad=turn_rad)).told(device[0])
    parts = [part for number in walks if (part := _part(joined, told, number)) is not None]
    if not parts:
        return 0.0, float("inf")
    from scipy.linalg import block_diag  # SciPy, which nobody needs who maps walks alone

    residual, longer = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    frame, own = (block_diag(*[part[i] for part in parts]) for i in (2, 3))
    design = np.vstack([part[4] for part in parts])
    worth = np.linalg.inv(own + design @ told.covariance @ design.T)
    pull = frame.T @ worth
    worth -= pull.T @ np.linalg.solve(pull @ frame, pull)
    information = float(longer @ worth @ longer)
    return float(longer @ worth @ residual) / information, information**-0.5


def _part(joined: LandmarkMap, told: ToldPlaces, number: int) -> tuple[FloatArray, ...] | None:
    """Of the positions (r,) that a walk saw, where others have the landmarks: what they are off by, what a longer metre
    would put them off by, design by the walk's frame (r, 3), covariance (r, r), and design by what is told (r, 3k).
    """
    own = joined.maps[number]
    rows = np.flatnonzero(np.isin(own.landmark, told.landmark))
    if len(rows) < FEWEST_LANDMARKS:
        return None
    moved = replace(joined, position=joined.position.copy())
    moved.position[told.landmark] = told.position
    linear = linear_map(moved, number)
    keep = (2 * rows[:, None] + (0, 1)).ravel()
    arm = np.exp(-1j * joined.turn_rad[number]) * (told.position[np.searchsorted(told.landmark, own.landmark[rows])])
    arm -= arm.mean()
    at = joint_columns(np.searchsorted(told.landmark, own.landmark[rows]), len(told.landmark))[: len(keep)]
    design = np.zeros((len(keep), len(told.covariance)))
    design[:, at] = linear.design[np.ix_(keep, keep)]
    noise = linear.own[np.ix_(keep, keep)] + np.diag(linear.shift[keep])
    return linear.residual[keep], np.column_stack((arm.real, arm.imag)).ravel(), linear.frame[keep], noise, design
