"""Where sheets may hang: flat stretches of wall that who passes on a corridor faces, near enough, for long enough.

Beside each *station*, a point of a corridor, lines are cast to the walls on both sides, and ahead where the corridor
ends. A wall counts if it is flat over a sheet and a margin on both sides (away from doors and corners). The sheet must
be in view over enough of the corridor, and some sheet must fill its share of the picture for a passing phone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.preparation.planning.corridors import Corridors
from vislam2tag.preparation.planning.settings import DETOUR_M, CameraSettings, PlanSettings
from vislam2tag.preparation.sheets.settings import SHEET_SIZES
from vislam2tag.site.walkable.space import WalkableSpace

_AT_ONCE = 2_000_000
"""Lines times walls that are intersected at once: what bounds memory."""
LOOK_STEP_M = 0.25
"""Views along the corridor are tried this densely ..."""
LOOK_FROM_M = 1.5
"""... from the middle of the corridor, or from so far off the wall where it is further."""
MARGIN_M = 0.5
"""The wall is flat this far on both sides of a sheet's middle: off doors and corners, metres."""
FLAT_M = 0.12
"""A wall that is uneven by less than this is flat, metres."""
OFF_TURN_M = 1.0
"""No sheet closer to a turn than this: who turns would not see it in time, metres."""
STEEPEST = 0.4
"""Greatest slope of a wall against the corridor beside it: a passer-by faces it."""
OFF_DOOR_M = 0.9
"""No sheet closer to a door's middle than this."""
HALL_REACH_M = 8.0
"""In open areas people walk along the walls as well: a sheet may hang this far off the net of corridors."""


@dataclass(frozen=True)
class Stations:
    """``s`` points of the corridors at which a landmark would be passed: ``corridor`` (s,), ``offset_m`` (s,) from its
    first end, ``point`` (s, 2) BCS; sorted by corridor and offset.
    """

    corridor: IntArray
    offset_m: FloatArray
    point: FloatArray


@dataclass(frozen=True)
class SheetPlaces:
    """``p`` places for sheets: ``station`` (p,), ``position`` (p, 2) on the wall, ``normal`` (p, 2) out of it,
    ``line_m`` (p,) from the middle of the corridor. ``visible_m`` (p,) of the corridor from which the sheet can be
    seen, ``pass_m`` (p,) distance in passing, ``sheet`` (p) size of paper.
    """

    station: IntArray
    position: FloatArray
    normal: FloatArray
    line_m: FloatArray
    visible_m: FloatArray
    pass_m: FloatArray
    sheet: tuple[str, ...]

    def take(self, rows: IntArray) -> SheetPlaces:
        """Some of the places, by rows (k,), in this order."""
        columns = {field.name: getattr(self, field.name)[rows] for field in fields(self) if field.name != "sheet"}
        return SheetPlaces(**columns, sheet=tuple(self.sheet[row] for row in rows.tolist()))


def stations_along(corridors: Corridors, step_m: float) -> Stations:
    """Spread stations evenly over all corridors, about ``step_m`` apart, one at each dead end."""
    corridor, offset = [], []
    for number, length in enumerate(corridors.length_m.tolist()):
        count = max(1, round(length / step_m))
        at = (np.arange(count) + 0.5) * length / count
        dead = [
            len(corridors.leaving[end]) == 1 and not corridors.is_open[end] for end in corridors.joined[number].tolist()
        ]
        at = np.concatenate(([0.0] * dead[0], at, [length] * dead[1]))
        corridor += [number] * len(at)
        offset.append(at)
    index = np.array(corridor, dtype=np.int64)
    offsets = np.concatenate([*offset, np.zeros(0)])
    points = [corridors.place(number, offsets[index == number]) for number in range(len(corridors.lines))]
    return Stations(index, offsets, np.vstack([*points, np.zeros((0, 2))]))


def first_hits(origin: FloatArray, direction: FloatArray, walls: FloatArray, reach_m: float) -> FloatArray:
    """Distance (k,) along unit ``direction`` (k, 2) from ``origin`` (k, 2) to the first of the walls (w, 2, 2).

    Infinite where there is none within ``reach_m``.
    """
    found = np.full(len(origin), np.inf)
    if not len(walls):
        return found
    start, edge = walls[:, 0], walls[:, 1] - walls[:, 0]
    rows = max(1, _AT_ONCE // len(walls))
    for first in range(0, len(origin), rows):
        part = slice(first, first + rows)
        offset = start[None] - origin[part, None]
        ahead = direction[part, None]
        across = ahead[..., 0] * edge[None, :, 1] - ahead[..., 1] * edge[None, :, 0]
        with np.errstate(all="ignore"):
            distance = (offset[..., 0] * edge[None, :, 1] - offset[..., 1] * edge[None, :, 0]) / across
            share = (offset[..., 0] * ahead[..., 1] - offset[..., 1] * ahead[..., 0]) / across
            hit = (np.abs(across) > 1e-12) & (share >= -1e-9) & (share <= 1 + 1e-9) & (distance > 0)
        found[part] = np.where(hit & (distance <= reach_m), distance, np.inf).min(axis=1)
    return found


def find_sheet_places(
    space: WalkableSpace,
    corridors: Corridors,
    stations: Stations,
    settings: PlanSettings,
    forbidden: FloatArray | None = None,
) -> SheetPlaces:
    """All places for sheets; none within the ``forbidden`` rectangles (f, 4), x0, y0, x1, y1, BCS metres."""
    cast = _casts(corridors, stations)
    camera = settings.camera
    largest = max(camera.fill_distance_m(SHEET_SIZES[name]) for name in settings.sheets)
    in_hall = corridors.in_hall[stations.corridor[cast.station]]
    detour = np.where(in_hall, HALL_REACH_M, DETOUR_M)
    position, normal, line_m, fine = _flat_walls(space, cast, detour + largest)
    rows = np.flatnonzero(fine & _off_turns(corridors, stations, cast))
    rows = rows[_allowed(position[rows], corridors.doors, forbidden)]
    found = [
        camera.sheet_for(line, settings.sheets, reach)
        for line, reach in zip(line_m[rows].tolist(), detour[rows].tolist(), strict=True)
    ]
    places = SheetPlaces(
        cast.station[rows],
        position[rows],
        normal[rows],
        line_m[rows],
        _visible(space, corridors, stations, cast.station[rows], position[rows], normal[rows], camera),
        np.array([np.inf if one is None else one[1] for one in found]),
        tuple("" if one is None else one[0].name for one in found),
    )
    return places.take(np.flatnonzero((places.visible_m >= settings.visible_m) & np.isfinite(places.pass_m)))


@dataclass(frozen=True)
class _Casts:
    """Lines from stations (k,) to walls: ``origin`` (k, 2), ``towards`` (k, 2), ``ahead`` (k,) along the corridor."""

    station: IntArray
    origin: FloatArray
    towards: FloatArray
    ahead: BoolArray


def _casts(corridors: Corridors, stations: Stations) -> _Casts:
    station, towards, ahead = [], [], []
    for corridor, length in enumerate(corridors.length_m.tolist()):
        rows = np.flatnonzero(stations.corridor == corridor)
        along = corridors.direction(corridor, stations.offset_m[rows])
        left = np.column_stack((-along[:, 1], along[:, 0]))
        for side in (left, -left):
            station.append(rows)
            towards.append(side)
            ahead.append(np.zeros(len(rows), dtype=np.bool_))
        for end, offset, sign in ((0, 0.0, -1.0), (1, length, 1.0)):
            if len(corridors.leaving[int(corridors.joined[corridor, end])]) == 1:
                at_end = np.flatnonzero(stations.offset_m[rows] == offset)
                station.append(rows[at_end])
                towards.append(sign * along[at_end])
                ahead.append(np.ones(len(at_end), dtype=np.bool_))
    index = np.concatenate([*station, np.zeros(0, dtype=np.int64)]).astype(np.int64)
    return _Casts(
        index,
        stations.point[index],
        np.vstack([*towards, np.zeros((0, 2))]),
        np.concatenate([*ahead, np.zeros(0, dtype=np.bool_)]),
    )


def _flat_walls(
    space: WalkableSpace, cast: _Casts, reach_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Where each line meets a wall (k, 2), the wall's normal (k, 2), the distance (k,), and whether it is flat there.

    Three lines beside each other show it: through the sheet's middle and a margin to both sides.
    """
    beside = np.column_stack((-cast.towards[:, 1], cast.towards[:, 0])) * MARGIN_M
    greatest = float(reach_m.max(initial=0.0)) + MARGIN_M
    left, middle, right = (
        first_hits(cast.origin + shift * beside, cast.towards, space.walls, greatest) for shift in (-1.0, 0.0, 1.0)
    )
    with np.errstate(invalid="ignore"):
        uneven = np.abs(left + right - 2 * middle)
        slope = (right - left) / (2 * MARGIN_M)
        flat = (uneven < FLAT_M) & (np.abs(slope) < STEEPEST) & (middle <= reach_m)
    flat &= np.isfinite(left) & np.isfinite(right) & np.isfinite(middle)
    slope, middle = np.where(flat, slope, 0.0), np.where(flat, middle, 0.0)
    normal = slope[:, None] * (beside / MARGIN_M) - cast.towards
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return cast.origin + middle[:, None] * cast.towards, normal, middle, flat


def _off_turns(corridors: Corridors, stations: Stations, cast: _Casts) -> BoolArray:
    """Return (k,) what is far enough off turns along the corridor; what hangs ahead at a dead end is seen all along."""
    offset, corridor = stations.offset_m[cast.station], stations.corridor[cast.station]
    leaving = np.array([len(halves) for halves in corridors.leaving])
    turns = (leaving > 1) & ~corridors.is_open
    near = turns[corridors.joined[corridor, 0]] & (offset < OFF_TURN_M)
    near |= turns[corridors.joined[corridor, 1]] & (corridors.length_m[corridor] - offset < OFF_TURN_M)
    return np.asarray(~near | cast.ahead)


def _allowed(position: FloatArray, doors: FloatArray, forbidden: FloatArray | None) -> BoolArray:
    """Return (k,) which places lie off doors and outside the forbidden rectangles."""
    fine = np.ones(len(position), dtype=np.bool_)
    for door in doors:
        fine &= np.linalg.norm(position - door, axis=1) > OFF_DOOR_M
    for x0, y0, x1, y1 in [] if forbidden is None else forbidden.tolist():
        inside = (position >= (min(x0, x1), min(y0, y1))) & (position <= (max(x0, x1), max(y0, y1)))
        fine &= ~inside.all(axis=1)
    return fine


def _visible(
    space: WalkableSpace,
    corridors: Corridors,
    stations: Stations,
    station: IntArray,
    position: FloatArray,
    normal: FloatArray,
    camera: CameraSettings,
) -> FloatArray:
    """Length (p,) of the corridor about each station from which the sheet is seen; no one looks from far off."""
    steps = np.arange(-camera.range_m, camera.range_m + 1e-9, LOOK_STEP_M)
    corridor = stations.corridor[station]
    offset = stations.offset_m[station][:, None] + steps
    on_way = (offset >= 0) & (offset <= corridors.length_m[corridor][:, None])
    points = np.zeros((len(station), len(steps), 2))
    for number in np.unique(corridor).tolist():
        rows = np.flatnonzero(corridor == number)
        line = corridors.place(number, offset[rows].ravel().clip(0, corridors.length_m[number]))
        points[rows] = line.reshape(len(rows), len(steps), 2)
    to_wall = position - stations.point[station]
    line_m = np.linalg.norm(to_wall, axis=1)
    nearer = np.maximum(line_m - LOOK_FROM_M, 0.0) / np.maximum(line_m, 1e-9)
    points += (nearer[:, None] * to_wall)[:, None]
    view = position[:, None] - points
    distance = np.linalg.norm(view, axis=2)
    facing = -np.einsum("psk,pk->ps", view, normal) / np.maximum(distance, 1e-9)
    seen = on_way & (distance <= camera.range_m) & (facing > np.cos(camera.angle_rad))
    rows, columns = np.nonzero(seen)
    seen[rows, columns] = space.clear_line(points[rows, columns], position[rows] + 0.1 * normal[rows])
    return np.asarray(seen.sum(axis=1) * LOOK_STEP_M)
