"""Whether a total station's track lies where walks before it put it: its frame may be off with every shot fitting.

Two shots fit a frame however they are turned, so one of a wrong point may show in nothing but the walks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.quality.evaluation.point_errors import PointErrors

CELL_M = 10.0
"""Tracks are compared place by place, in squares of this side."""
CERTAIN_SIGMAS = 3.0
"""A place contradicts where sessions, together, put the track so many standard deviations away (the mean over a place
is nearer than its labels state: without a fault the worst of six is 1.5 off) ..."""
LEAST_M = 0.2
"""... and at least this far."""
FEWEST_SESSIONS = 2
"""... if so many sessions passed it."""
FEWEST_PLACES, FEWEST_CONTRADICTING, LEAST_SHARE = 3, 2, 0.3
"""A frame is off where, of so many places at least, so many and this share contradict: where only one does, a landmark
near it may be."""
SHARED_M = 0.05
"""All sessions err at a place by this alike, per axis, and by more where places are off by more that no other frame
accounts for: by how landmarks around it are surveyed (assumed)."""


class PlaceApart(NamedTuple):
    """From a station's track to where sessions put it at a ``place``; complex metres, BCS of the floor."""

    place: complex
    offset: complex
    sigma_m: float
    """One standard deviation per axis."""
    sessions: int

    @property
    def contradicts(self) -> bool:
        """Whether the track is elsewhere."""
        return abs(self.offset) > max(CERTAIN_SIGMAS * self.sigma_m, LEAST_M)


def places_apart(walks: Sequence[PointErrors]) -> list[PlaceApart]:
    """Pool the labels of sessions against one station's track, by place.

    Labels of a session in a place err alike: however many they are, they count as one.
    """
    seen: dict[tuple[int, int], list[_Passed]] = defaultdict(list)
    for errors in walks:
        kept = errors.labelled & np.isfinite(errors.sigma_m)
        place, offset = (at[kept] @ (1, 1j) for at in (errors.truth_bcs, errors.residual_bcs))
        label_m, truth_m = errors.sigma_m[kept], np.nan_to_num(errors.truth_sigma_m[kept])
        cell = np.floor(errors.truth_bcs[kept] / CELL_M).astype(np.int64)
        for x, y in np.unique(cell, axis=0).tolist():
            rows = (cell == (x, y)).all(axis=1)
            means = (float(values[rows].mean()) for values in (label_m, truth_m))
            seen[x, y].append(_Passed(complex(place[rows].mean()), complex(offset[rows].mean()), *means))
    places = [_pooled(found) for found in seen.values() if len(found) >= FEWEST_SESSIONS]
    shared_m = _shared_m(places)
    return [one._replace(sigma_m=float(np.hypot(one.sigma_m, shared_m))) for one in places]


class _Passed(NamedTuple):
    """What one session says of a place: means over its labels there."""

    place: complex
    offset: complex
    label_m: float
    truth_m: float
    """Sigma of the track, owed to clock and prism that are those of all sessions."""


def _pooled(found: Sequence[_Passed]) -> PlaceApart:
    place, offset, label_m, truth_m = (np.array(values) for values in zip(*found, strict=True))
    worth = label_m**-2.0
    share = worth / worth.sum()
    sigma_m = np.hypot(worth.sum() ** -0.5, share @ truth_m)
    return PlaceApart(complex(place.mean()), complex(share @ offset), float(sigma_m), len(found))


def _shared_m(places: Sequence[PlaceApart]) -> float:
    """By how much, per axis, all sessions err alike at a place: what places are off by beyond their own sigma.

    Not counted is what another frame, turned and shifted, accounts for: three numbers of two for each place.
    """
    if len(places) < FEWEST_PLACES:
        return SHARED_M
    offset, arm = (np.array([getattr(one, name) for one in places]) for name in ("offset", "place"))
    arm = 1j * (arm - arm.mean())
    frame = np.zeros((2, len(places), 3))
    frame[0, :, 0], frame[1, :, 1], frame[0, :, 2], frame[1, :, 2] = 1, 1, arm.real, arm.imag
    design, values = frame.reshape(-1, 3), np.concatenate((offset.real, offset.imag))
    left = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    beyond_m2 = left @ left / (len(left) - design.shape[1]) - np.mean([one.sigma_m**2 for one in places])
    return float(np.sqrt(max(beyond_m2, SHARED_M**2)))


def frame_against_walks(walks: Sequence[PointErrors]) -> list[Finding]:
    """Report a station whose track is elsewhere than walks of one device put it."""
    places = places_apart(walks)
    contradicting = [one for one in places if one.contradicts]
    enough = max(FEWEST_CONTRADICTING, LEAST_SHARE * len(places))
    if len(places) < FEWEST_PLACES or len(contradicting) < enough:
        return []
    worst = max(contradicting, key=lambda one: abs(one.offset))
    by = f"{abs(worst.offset):.2f} m (usual are {worst.sigma_m:.2f} m)"
    message = (
        f"around ({worst.place.real:.0f}, {worst.place.imag:.0f}) the total station's track is {by} from where "
        f"{worst.sessions} sessions put it: check the ids and coordinates of its common points"
    )
    return [Finding(kind="station_frame", file="", count=len(contradicting), message=message)]
