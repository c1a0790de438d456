"""Whether a total station's track lies where walks before it put it: its frame may be off with every shot fitting.

Two shots fit a frame however they are turned, so one of a wrong point may show in nothing but the walks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.evaluation.point_errors import PointErrors

CELL_M = 10.0
"""Tracks are compared place by place, in squares of this side."""
CERTAIN_SIGMAS = 3.0
"""A place contradicts where sessions, together, put the track so many standard deviations away (the mean over a place
is nearer than its labels state: without a fault the worst of six is 1.5 off) ..."""
LEAST_M = 0.2
"""... and at least this far."""
FEWEST_SESSIONS = 2
"""... if so many sessions passed it."""
LEAST_SHARE = 0.3
"""A frame is off where this share of places contradicts: where only one of several does, a landmark near it may be."""


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
    seen: dict[tuple[int, int], list[tuple[complex, complex, float]]] = defaultdict(list)
    for errors in walks:
        sigma_m = np.hypot(errors.sigma_m, np.nan_to_num(errors.truth_sigma_m))
        kept = errors.labelled & np.isfinite(sigma_m)
        place, offset = (at[kept] @ (1, 1j) for at in (errors.truth_bcs, errors.residual_bcs))
        cell = np.floor(errors.truth_bcs[kept] / CELL_M).astype(np.int64)
        for x, y in np.unique(cell, axis=0).tolist():
            rows = (cell == (x, y)).all(axis=1)
            values = place[rows].mean(), offset[rows].mean(), float(sigma_m[kept][rows].mean())
            seen[x, y].append((complex(values[0]), complex(values[1]), values[2]))
    return [_pooled(found) for found in seen.values() if len(found) >= FEWEST_SESSIONS]


def _pooled(found: Sequence[tuple[complex, complex, float]]) -> PlaceApart:
    place, offset, sigma_m = (np.array(values) for values in zip(*found, strict=True))
    worth = sigma_m**-2.0
    share = worth / worth.sum()
    return PlaceApart(complex(place.mean()), complex(share @ offset), float(worth.sum() ** -0.5), len(found))


def frame_against_walks(walks: Sequence[PointErrors]) -> list[Finding]:
    """Report a station whose track is elsewhere than walks of one device put it."""
    places = places_apart(walks)
    contradicting = [one for one in places if one.contradicts]
    if not contradicting or len(contradicting) < LEAST_SHARE * len(places):
        return []
    worst = max(contradicting, key=lambda one: abs(one.offset))
    by = f"{abs(worst.offset):.2f} m (usual are {worst.sigma_m:.2f} m)"
    message = (
        f"around ({worst.place.real:.0f}, {worst.place.imag:.0f}) the total station's track is {by} from where "
        f"{worst.sessions} sessions put it: check the ids and coordinates of the points that it shot"
    )
    return [Finding(kind="station_frame", file="", count=len(contradicting), message=message)]
