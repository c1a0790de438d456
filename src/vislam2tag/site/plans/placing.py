"""From a drawing's own coordinates to the BCS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Affine2, Similarity2
from vislam2tag.site.georeference import Georeference, from_wgs84
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, cropped, mapped
from vislam2tag.site.plans.source import Extent, PlanSource, Point

if TYPE_CHECKING:
    from pyproj import Transformer

_WGS84 = 4326
NO_SCALE = (
    "has no scale: give extent = { width_m = ..., height_m = ... }, two points, a distance, a scale or unit_m in its "
    "[floors.plan] of site.toml"
)
_NO_PAPER = (
    "tells no size on paper, which a scale such as 1:100 needs (PDF, and SVG in mm, cm, in, pt or pc, do); give its "
    "extent or a distance instead"
)


@dataclass(frozen=True)
class _Plane:
    """Projects the coordinates of a file that lies on earth onto the plane that touches the earth at ``frame``."""

    to_wgs84: Transformer
    frame: Georeference

    def __call__(self, points: FloatArray) -> FloatArray:
        """Project points (..., 2)."""
        return from_wgs84(_degrees(self.to_wgs84, points), self.frame).reshape(points.shape)


def placed(drawing: PlanDrawing, source: PlanSource, georeference: Georeference | None) -> tuple[PlanDrawing, Affine2]:
    """Return a drawing (its ``area``) on a plane, and the map ``bcs_T_plan`` from that plane to the BCS.

    A drawing that lies on earth is projected: into the BCS where the floor's ``georeference`` tells where that is,
    else around its own middle. Then its scale counts. Raises OSError, whose text completes a sentence about the file,
    where it has none.
    """
    epsg = source.epsg or drawing.epsg
    points = _as_given(drawing, _points(source))
    if source.area is not None:
        corners = _as_given(drawing, [source.area[:2], source.area[2:]])
        (left, low), (right, high) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        drawing = cropped(drawing, (left, right, low, high))
    if epsg is None:
        return drawing, _scaled(drawing, source, points, drawing.unit_m)
    to_wgs84 = _transformer(epsg)
    plane = _Plane(to_wgs84, georeference or _middle(drawing.bounds, to_wgs84))
    projected = mapped(drawing, plane)
    return projected, _scaled(projected, source, plane(points), None if georeference is None else 1.0)


def _scaled(plane: PlanDrawing, source: PlanSource, points: FloatArray, unit_m: float | None) -> Affine2:
    """The map by whichever scale is given; ``points`` (n, 2) are the known ones on the plane."""
    left, right, low, high = plane.bounds
    if source.extent is not None:
        scale = np.array(extent_sides_m(source.extent, plane.bounds)) / (right - left, high - low)
        return _axis_parallel(scale, plane.bounds, source.extent.lower_left_m)
    if source.points is not None:
        return affine(Similarity2.from_two_points(points, np.array([point.bcs_m for point in source.points])))
    if source.distance is not None:
        scale = np.full(2, source.distance.metres / np.linalg.norm(points[1] - points[0]))
        return _axis_parallel(scale, plane.bounds, source.distance.lower_left_m)
    if source.scale is not None:
        if plane.paper_m is None:
            raise OSError(_NO_PAPER)
        scale = np.full(2, plane.paper_m * source.scale.one_to)
        return _axis_parallel(scale, plane.bounds, source.scale.lower_left_m)
    unit_m = source.unit_m or unit_m
    if unit_m is None:
        raise OSError(NO_SCALE)
    return Affine2(np.eye(2) * unit_m, np.zeros(2))


def extent_sides_m(extent: Extent, bounds: Bounds) -> tuple[float, float]:
    """Width and height, metres; one that is not given follows from the shape of ``bounds``."""
    shape = (bounds[1] - bounds[0]) / (bounds[3] - bounds[2])
    if extent.width_m is None:
        assert extent.height_m is not None
        return extent.height_m * shape, extent.height_m
    return extent.width_m, extent.width_m / shape if extent.height_m is None else extent.height_m


def affine(similarity: Similarity2) -> Affine2:
    """Return a similarity as an affine map."""
    a, b = similarity.a, similarity.b
    return Affine2(np.array([[a.real, -a.imag], [a.imag, a.real]]), np.array([b.real, b.imag]))


def _axis_parallel(scale: FloatArray, bounds: Bounds, lower_left_m: Point) -> Affine2:
    """The map that scales the axes by ``scale`` (2,), metres a unit, with the lower left corner of the bounds at a
    point.
    """
    return Affine2(np.diag(scale), np.array(lower_left_m) - scale * (bounds[0], bounds[2]))


def _points(source: PlanSource) -> Sequence[Point]:
    """The points that a scale names in the plan's own coordinates."""
    if source.points is not None:
        return [point.plan for point in source.points]
    return [] if source.distance is None else [source.distance.start, source.distance.end]


def _as_given(drawing: PlanDrawing, given: Sequence[Point]) -> FloatArray:
    """Points (n, 2) that a user names in the file's coordinates, with y upwards."""
    points = np.array(given, dtype=np.float64).reshape(len(given), 2)
    if drawing.downwards:
        points[:, 1] = drawing.bounds[2] + drawing.bounds[3] - points[:, 1]
    return points


def _middle(bounds: Bounds, to_wgs84: Transformer) -> Georeference:
    left, right, low, high = bounds
    longitude, latitude = _degrees(to_wgs84, np.array([[(left + right) / 2, (low + high) / 2]]))[0].tolist()
    return Georeference(latitude_deg=latitude, longitude_deg=longitude)


def _degrees(to_wgs84: Transformer, points: FloatArray) -> FloatArray:
    """Longitudes and latitudes (n, 2) of points (..., 2)."""
    degrees = np.column_stack(to_wgs84.transform(*points.reshape(-1, 2).T))
    if not np.isfinite(degrees).all():
        raise OSError("has coordinates that its reference system does not have; correct epsg")
    return degrees


def _transformer(epsg: int) -> Transformer:
    from pyproj import Transformer  # slow to load, and few sites need it
    from pyproj.exceptions import ProjError

    try:
        return Transformer.from_crs(epsg, _WGS84, always_xy=True)
    except ProjError as error:
        raise OSError(f"is said to be in EPSG:{epsg}, which is no reference system known") from error
