"""Between a floor's building frame and longitude and latitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import Similarity2

if TYPE_CHECKING:
    from pyproj import CRS

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
"""Of the WGS84 ellipsoid."""
_SQUARED_ECCENTRICITY = FLATTENING * (2 - FLATTENING)
_BASE_M = 100.0
"""Of the direction of an axis: long enough to be exact, short enough that the earth is flat."""
_TOWN_DEG = 0.5
"""What is further away is no part of the same site, degrees."""
_ROUNDS = 4
"""Each leaves a thousandth of the latitude's error, so that this many leave nothing that a double holds."""


class Georeference(Record):
    """Where a floor's BCS is on the earth (WGS84)."""

    latitude_deg: float = Field(ge=-90, le=90)
    """Of the BCS origin."""
    longitude_deg: float = Field(ge=-180, le=180)
    """Of the BCS origin."""
    bearing_deg: float = 0.0
    """Direction of the BCS y axis (up on the plan), clockwise from true north."""


def to_wgs84(position_bcs: FloatArray, georeference: Georeference) -> FloatArray:
    """Turn positions (n, 2), metres in the BCS, into longitude and latitude (n, 2), degrees.

    The BCS is the plane that touches the ellipsoid at its origin: buildings are small enough for that (2 cm of height
    in 500 m).
    """
    bearing = np.radians(georeference.bearing_deg)
    x, y = position_bcs.T
    east = x * np.cos(bearing) + y * np.sin(bearing)
    north = y * np.cos(bearing) - x * np.sin(bearing)
    return _to_geodetic(_to_earth(east, north, georeference))


def from_wgs84(position: FloatArray, georeference: Georeference) -> FloatArray:
    """Turn longitudes and latitudes (n, 2), degrees, into positions (n, 2), metres in the BCS.

    The inverse of :func:`to_wgs84`: points of the ellipsoid, seen straight down on the plane that touches it.
    """
    place, origin = (
        _on_ellipsoid(*np.radians(degrees).T)
        for degrees in (position, np.array([[georeference.longitude_deg, georeference.latitude_deg]]))
    )
    latitude, longitude = np.radians((georeference.latitude_deg, georeference.longitude_deg))
    dx, dy, dz = place - origin
    east = dy * np.cos(longitude) - dx * np.sin(longitude)
    north = dz * np.cos(latitude) - (dx * np.cos(longitude) + dy * np.sin(longitude)) * np.sin(latitude)
    bearing = np.radians(georeference.bearing_deg)
    return np.column_stack(
        (east * np.cos(bearing) - north * np.sin(bearing), east * np.sin(bearing) + north * np.cos(bearing))
    )


def georeference_in_grid(epsg: int, origin_m: tuple[float, float], rotation_deg: float) -> Georeference:
    """Georeference of a frame whose origin's easting and northing are known in a projected reference system.

    ``rotation_deg`` turns grid east into the frame's x axis, counter-clockwise. Raises ValueError where there is no
    such system, it is not projected, or does not reach there, and for exchanged coordinates.
    """
    from pyproj import CRS, Transformer  # slow to load, and few sites need it
    from pyproj.exceptions import ProjError

    try:
        system = CRS.from_epsg(epsg)
        grid = Transformer.from_crs(system, 4326, always_xy=True)
    except ProjError as error:
        raise ValueError(f"EPSG:{epsg} is not a known reference system") from error
    if not system.is_projected:
        raise ValueError(f"EPSG:{epsg} ({system.name}) has no eastings and northings; give latitude_deg, longitude_deg")
    turn = np.radians(rotation_deg)
    up = np.array(origin_m) + _BASE_M * np.array([-np.sin(turn), np.cos(turn)])
    degrees = np.column_stack(grid.transform(*np.array([origin_m, up]).T))
    exchanged = np.array(grid.transform(*origin_m[::-1]))
    if _is_used_at(system, exchanged) and not _is_used_at(system, degrees[0]):
        raise ValueError(
            f"easting and northing are exchanged: EPSG:{epsg} ({system.name}) is not used at easting {origin_m[0]:.10g}"
            f" and northing {origin_m[1]:.10g}, but at easting {origin_m[1]:.10g} and northing {origin_m[0]:.10g}"
        )
    if not np.isfinite(degrees).all():
        raise ValueError(f"EPSG:{epsg} ({system.name}) is not defined at {origin_m[0]:g}, {origin_m[1]:g}")
    return _between(degrees)


def _is_used_at(system: CRS, place: FloatArray) -> bool:
    """Whether a reference system is meant for a longitude and latitude (2,), or none is known to be."""
    area = system.area_of_use
    return area is None or bool(area.west <= place[0] <= area.east and area.south <= place[1] <= area.north)


def place_doubt(georeference: Georeference, other: Georeference) -> str:
    """Why what is at ``other`` is in another town, the end of a sentence about it; empty if it is not."""
    here, there = ((each.latitude_deg, each.longitude_deg) for each in (georeference, other))
    if _are_near(here, there):
        return ""
    places = f"is at latitude {there[0]:.4f} and longitude {there[1]:.4f}, but the georeference of the site at "
    cure = "latitude and longitude of one are exchanged" if _are_near(here, there[::-1]) else "correct one of them"
    return f"{places}latitude {here[0]:.4f} and longitude {here[1]:.4f}: {cure}"


def _are_near(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) <= _TOWN_DEG


def georeference_of(outer: Georeference, outer_T_inner: Similarity2) -> Georeference:
    """Georeference of a frame that is in another one."""
    if outer_T_inner == Similarity2.identity():
        return outer
    return _between(to_wgs84(outer_T_inner @ np.array([[0.0, 0.0], [0.0, _BASE_M]]), outer))


def _between(degrees: FloatArray) -> Georeference:
    """Georeference of the frame whose origin, and a point up its y axis, have these longitudes and latitudes (2, 2)."""
    longitude, latitude = degrees[0].tolist()
    east, north = from_wgs84(degrees[1:], Georeference(latitude_deg=latitude, longitude_deg=longitude))[0]
    return Georeference(
        latitude_deg=latitude, longitude_deg=longitude, bearing_deg=float(np.degrees(np.arctan2(east, north)))
    )


def _on_ellipsoid(longitude: FloatArray, latitude: FloatArray) -> FloatArray:
    """Earth-centred coordinates (3, n), metres, of points (n,) on the ellipsoid, radians."""
    radius = SEMI_MAJOR_M / np.sqrt(1 - _SQUARED_ECCENTRICITY * np.sin(latitude) ** 2)
    outward = radius * np.cos(latitude)
    upward = radius * (1 - _SQUARED_ECCENTRICITY) * np.sin(latitude)
    return np.stack((outward * np.cos(longitude), outward * np.sin(longitude), upward))


def _to_earth(east: FloatArray, north: FloatArray, georeference: Georeference) -> FloatArray:
    """Earth-centred coordinates (3, n), metres, of points on the tangent plane."""
    latitude, longitude = np.radians((georeference.latitude_deg, georeference.longitude_deg))
    radius = SEMI_MAJOR_M / np.sqrt(1 - _SQUARED_ECCENTRICITY * np.sin(latitude) ** 2)
    outward = radius * np.cos(latitude) - north * np.sin(latitude)
    upward = radius * (1 - _SQUARED_ECCENTRICITY) * np.sin(latitude) + north * np.cos(latitude)
    return np.stack(
        (
            outward * np.cos(longitude) - east * np.sin(longitude),
            outward * np.sin(longitude) + east * np.cos(longitude),
            upward,
        )
    )


def _to_geodetic(earth: FloatArray) -> FloatArray:
    """Longitude and latitude (n, 2), degrees, of places (3, n) in the earth's frame, metres."""
    x, y, z = earth
    distance = np.hypot(x, y)
    latitude = np.arctan2(z, distance * (1 - _SQUARED_ECCENTRICITY))
    for _ in range(_ROUNDS):
        sine = np.sin(latitude)
        radius = SEMI_MAJOR_M / np.sqrt(1 - _SQUARED_ECCENTRICITY * sine**2)
        latitude = np.arctan2(z + _SQUARED_ECCENTRICITY * radius * sine, distance)
    degrees: FloatArray = np.degrees(np.column_stack((np.arctan2(y, x), latitude)))
    return degrees
