"""What of each floor was walked, as JSON: shares of the walkable space, room by room, and the walk that fills it."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.site.walkable.walked.walked_space import FillingWalk, WalkedSpace


class WalkedArea(Record):
    """A room, a corridor or a hall."""

    name: str
    """As people call it, ``room 2.114``; with its place where it has no name."""
    room: bool
    """Whether it lies behind doors."""
    area_m2: float
    walked: float
    """Share of it within 2 m of a walk, on foot, 0 to 1."""
    scanned: float
    """Share of it within 2 m of a labelled Wi-Fi scan."""
    entered: bool
    place_m: tuple[float, float]
    """A place in it, far from its walls; BCS."""


class WalkToFill(Record):
    """The walk past all that was not walked; corners and stops in order, BCS metres."""

    length_m: float
    minutes: float
    points_m: list[tuple[float, float]]
    stops_m: list[tuple[float, float]]


class WalkedFloor(Record):
    """One floor."""

    number: int
    note: str = ""
    """Why nothing is known of it; empty where it is."""
    walkable_m2: float | None = None
    walked: float | None = None
    """Share of the walkable space within 2 m of a walk, on foot, 0 to 1."""
    scanned: float | None = None
    areas: list[WalkedArea] = []
    """Rooms by name, then the rest."""
    walk: WalkToFill | None = None
    """None where nothing worth a way is left."""
    findings: list[Finding] = []
    """What is wrong with the table of the rooms' names."""

    @property
    def rooms(self) -> list[WalkedArea]:
        """What lies behind doors."""
        return [area for area in self.areas if area.room]

    @property
    def never_entered(self) -> list[WalkedArea]:
        """Rooms that no walk led into."""
        return [area for area in self.rooms if not area.entered]


def walked_floor(number: int, space: WalkedSpace, walk: FillingWalk | None) -> WalkedFloor:
    """Reduce a floor to its record."""
    areas, walked, scanned = space.areas, space.area_shares(space.walked), space.area_shares(space.scanned)
    rows = [
        WalkedArea(
            name=areas.called(area),
            room=bool(areas.is_room[area]),
            area_m2=round(float(areas.area_m2[area]), 2),
            walked=round(float(walked[area]), 4),
            scanned=round(float(scanned[area]), 4),
            entered=bool(space.entered[area]),
            place_m=_point(areas.middle_m[area].tolist()),
        )
        for area in range(len(areas.area_m2))
    ]
    return WalkedFloor(
        number=number,
        walkable_m2=round(float(areas.area_m2.sum()), 2),
        walked=round(float(np.mean(space.walked)), 4),
        scanned=round(float(np.mean(space.scanned)), 4),
        areas=sorted(rows, key=lambda area: (not area.room, area.name)),
        walk=None if walk is None else _walk(walk),
    )


def _walk(walk: FillingWalk) -> WalkToFill:
    return WalkToFill(
        length_m=round(walk.length_m, 2),
        minutes=round(walk.minutes, 2),
        points_m=[_point(point) for point in walk.line_m.tolist()],
        stops_m=[_point(point) for point in walk.stops_m.tolist()],
    )


def _point(place: list[float]) -> tuple[float, float]:
    return round(place[0], 2), round(place[1], 2)
