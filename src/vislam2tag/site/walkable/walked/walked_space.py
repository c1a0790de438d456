"""What of a floor's walkable space was walked and scanned, area by area, and the walk that would fill the rest.

Near is what lies within a radius of a walk *on foot*, around walls: who passes a room outside has not been in it. The
radius is that of a data set's coverage.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import line_length
from vislam2tag.site.walkable.walked.areas import Areas
from vislam2tag.site.walkable.walked.short_walk import WALKING_M_S, covering_stops, short_order
from vislam2tag.site.walkable.walked.walking_distances import WalkingDistances

RADIUS_M = 2.0
"""Half of what is walked between two scans of a phone (3 to 4 s at 1 m/s)."""
STOP_RADIUS_M = 3.0
"""Stops of the filling walk: it comes nearer on its way from one to the next."""
LEAST_GAP_M2 = 2.0
"""Less than this that was not walked in an area is no reason to go there."""
_OFF_SPACE_M = 0.5
"""Positions may lie so far outside the walkable space: labels are not exact, nor are plans."""
MOST_STOPS = 500
"""A walk has so many stops at most, those that fill most: who walked it checks again."""
_LOOK_M = 25.0
"""Stops that are farther apart on foot come after each other only where nothing is nearer."""
_MANY_STOPS = 400
"""With so many stops one order is tried, with fewer several."""
_APART = 1e4
"""Metres by which stops of different areas are held apart: a stop fills only its own area."""


@dataclass(frozen=True)
class FillingWalk:
    """The walk past all that was not walked: corners (k, 2) of its line and stops (s, 2) in order, BCS metres."""

    line_m: FloatArray
    stops_m: FloatArray

    @property
    def length_m(self) -> float:
        """Length of the walk."""
        return line_length(self.line_m)

    @property
    def minutes(self) -> float:
        """How long it takes."""
        return self.length_m / WALKING_M_S / 60


@dataclass(frozen=True)
class WalkedSpace:
    """``n`` places, an even grid over a walkable space of ``a`` areas, and which of them walks came near."""

    areas: Areas
    distances: WalkingDistances
    walked: BoolArray
    """(n,)."""
    scanned: BoolArray
    """(n,) whether a labelled Wi-Fi scan was near."""
    entered: BoolArray
    """(a,) whether a walk led into the area."""

    @property
    def places_m(self) -> FloatArray:
        """(n, 2) BCS metres."""
        return self.distances.places_m

    @property
    def place_m2(self) -> float:
        """What a place stands for, square metres."""
        return self.distances.step_m**2

    def area_shares(self, near: BoolArray) -> FloatArray:
        """Share (a,) of each area's places that are ``near`` (n,); 0 of an area without any."""
        area, count = self.areas.at(self.places_m), len(self.areas.area_m2)
        on = area >= 0
        whole = np.bincount(area[on], minlength=count)
        return np.asarray(np.bincount(area[on & near], minlength=count) / np.maximum(whole, 1))

    @property
    def never_entered(self) -> list[int]:
        """Rooms that no walk led into."""
        return np.flatnonzero(self.areas.is_room & ~self.entered).tolist()


def walked_space(areas: Areas, walked_m: FloatArray, scanned_m: FloatArray) -> WalkedSpace:
    """Tell what walks came near, by points along them (w, 2) about a metre apart, and places of scans (s, 2)."""
    distances = WalkingDistances(areas.space)
    walked_m, scanned_m = (points[np.isfinite(points).all(axis=1)] for points in (walked_m, scanned_m))
    walked_m = np.vstack((walked_m, scanned_m))  # who scanned was there
    inside = areas.at(walked_m)
    entered = np.zeros(len(areas.area_m2), dtype=np.bool_)
    entered[inside[inside >= 0]] = True
    return WalkedSpace(areas, distances, _near(distances, walked_m), _near(distances, scanned_m), entered)


def _near(distances: WalkingDistances, points_m: FloatArray) -> BoolArray:
    """Places (n,) within the radius of some points (p, 2)."""
    known = points_m[distances.off_space_m(points_m) <= _OFF_SPACE_M]
    if not len(known):
        return np.zeros(len(distances.places_m), dtype=np.bool_)
    return np.asarray(distances.to_nearest(distances.places_m, known, RADIUS_M) <= RADIUS_M)


def filling_walk(space: WalkedSpace) -> FillingWalk | None:
    """The walk through doors that comes near all that was not walked; None where nothing worth a way is left."""
    missing = np.flatnonzero(~space.walked)
    area = space.areas.at(space.places_m[missing])
    enough = np.bincount(area[area >= 0], minlength=len(space.areas.area_m2)) * space.place_m2 >= LEAST_GAP_M2
    worth = (area >= 0) & np.append(enough, False)[area]
    missing, area = missing[worth], area[worth]
    if not len(missing):
        return None
    stops = _stops(space.places_m[missing], area, space.distances.step_m)[:MOST_STOPS]
    length_m = space.distances.between(stops, stops, _LOOK_M)
    straight = np.linalg.norm(stops[:, None] - stops, axis=2)
    order = short_order(
        np.where(np.isfinite(length_m), length_m, _LOOK_M + 2 * straight),
        free=True,
        tries=max(1, min(8, _MANY_STOPS // len(stops))),
    )
    legs = [_leg(space.distances, stops[one], stops[other], length_m[one, other]) for one, other in pairwise(order)]
    line = np.vstack([stops[order[:1]], *(leg[1:] for leg in legs)])
    return FillingWalk(space.distances.off_walls(line), stops[order])


def _stops(places_m: FloatArray, area: IntArray, step_m: float) -> FloatArray:
    """Places (s, 2) so that each of the places (n, 2) lies near one in its own area (n,); every second is looked at."""
    row, column = np.round(places_m / step_m).astype(np.int64).T
    looked = (row % 2 == 0) & (column % 2 == 0)
    kept = looked | ~np.isin(area, area[looked])
    apart = np.column_stack((places_m[kept], _APART * area[kept]))
    return np.asarray(places_m[kept][covering_stops(apart, STOP_RADIUS_M)])


def _leg(distances: WalkingDistances, start: FloatArray, stop: FloatArray, length_m: float) -> FloatArray:
    """The way (k, 2) between two stops, of a length that is known where it is short."""
    return distances.path(start, stop, length_m + 1.0 if np.isfinite(length_m) else np.inf)
