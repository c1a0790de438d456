"""A plan in its file's own coordinates, the formats that read one, and its place in the floor's frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from PIL import Image
from shapely.geometry.base import BaseGeometry

from vislam2tag.common import plugins
from vislam2tag.common.errors import missing_extra
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.plugins import Registry
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import Affine2, Similarity2
from vislam2tag.site.georeference import Georeference, from_wgs84, place_doubt
from vislam2tag.site.plans.source import Extent, PlanPolygon, PlanSource, PlanText, Point
from vislam2tag.site.plans.taken_parts import TakenPart

if TYPE_CHECKING:
    from pyproj import Transformer


Bounds = tuple[float, float, float, float]
"""Left, right, lower, upper."""
MOST_SIDE_PX = 12_000
"""Longer side of a picture of which a part is taken."""
MOST_POINTS = 1_000_000
"""Of a plan's geometry: a floor of a hundred rooms has some ten thousand."""


@dataclass(frozen=True)
class PlanDrawing:
    """A plan in its file's coordinates, but with y upwards: a picture, or polygons, walls and passages.

    ``walls`` (w, 2, 2) are segments, ``passages`` (k, 2) polylines across which people walk from one polygon to the
    next.
    """

    bounds: Bounds
    picture: Callable[[int], Image.Image] | None = None
    """Draws what is between the bounds as an RGB image of about so many pixels on its longer side; raises OSError.
    None: the geometry is all there is."""
    polygons: tuple[PlanPolygon, ...] = ()
    walls: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    doors: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(d, 2, 2) lines of door leaves, drawn pale: no one is stopped by them."""
    door: float | None = None
    """Radius of the usual door swing, units of the file; None if no swing is drawn."""
    passages: tuple[FloatArray, ...] = ()
    texts: tuple[PlanText, ...] = ()
    """What is written on it; each place is a point in the drawing's coordinates."""
    downwards: bool = False
    """Whether the file counts y downwards from the upper edge: known points are given so."""
    pixels: bool = False
    """Whether a unit is a pixel: more of them than units show nothing more."""
    levels: tuple[str, ...] = ()
    """Names of all levels of its file, where that has levels."""
    unit_m: float | None = None
    """Metres a unit, if the file says so; its origin is then the BCS's."""
    paper_m: float | None = None
    """Metres on paper a unit, if the file says so."""
    epsg: int | None = None
    """Reference system of the coordinates, if the file says so."""
    taken: tuple[TakenPart, ...] = ()
    """What each part of the file became; empty for pictures."""
    notes: tuple[str, ...] = ()
    """What the user should check about how the file was read, sentences."""

    @property
    def point_count(self) -> int:
        """How many points its geometry has."""
        rings = (ring for each in self.polygons for ring in (each.outline, *each.holes))
        return 2 * (len(self.walls) + len(self.doors)) + sum(map(len, rings)) + sum(map(len, self.passages))


def refuse_too_many(points: int) -> None:
    """Raise OSError, whose text completes a sentence about the file, for more points than plans have."""
    if points > MOST_POINTS:
        raise OSError(f"has more than {MOST_POINTS:,} points; keep the layers that show walls only")


def bounds_of(points: FloatArray) -> Bounds:
    """Box around points (n, 2).

    Raises OSError, whose text completes a sentence about the file, where they span no area.
    """
    if not len(points) or not np.isfinite(points).all():
        raise OSError("contains nothing to draw")
    (left, low), (right, high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    if not (left < right and low < high):
        raise OSError("spans no area: everything in it is on one line")
    return left, right, low, high


def mapped(drawing: PlanDrawing, to: Callable[[FloatArray], FloatArray]) -> PlanDrawing:
    """Map the geometry of a drawing; ``to`` maps points (..., 2). Raises OSError as :func:`bounds_of` does."""
    polygons = tuple(
        PlanPolygon(to(each.outline), tuple(to(hole) for hole in each.holes), each.use, each.name)
        for each in drawing.polygons
    )
    walls, doors, passages = to(drawing.walls), to(drawing.doors), tuple(to(line) for line in drawing.passages)
    lines = (walls.reshape(-1, 2), doors.reshape(-1, 2), *passages)
    bounds = bounds_of(np.concatenate([*(each.outline for each in polygons), *lines]))
    return replace(
        drawing,
        bounds=bounds,
        polygons=polygons,
        walls=walls,
        doors=doors,
        passages=passages,
        texts=mapped_texts(drawing.texts, to),
    )


def mapped_texts(texts: tuple[PlanText, ...], to: Callable[[FloatArray], FloatArray]) -> tuple[PlanText, ...]:
    """Map the places of texts; ``to`` maps points (..., 2)."""
    if not texts:
        return ()
    places = to(np.array([one.place_m for one in texts])).tolist()
    return tuple(PlanText(one.text, (x, y)) for one, (x, y) in zip(texts, places, strict=True))


def cropped(drawing: PlanDrawing, area: Bounds) -> PlanDrawing:
    """Keep what is between ``area``, in the drawing's coordinates with y upwards.

    Raises OSError, whose text completes a sentence about the file, where that is nothing.
    """
    whole, picture = drawing.bounds, drawing.picture
    left, right, low, high = (
        max(area[0], whole[0]), min(area[1], whole[1]), max(area[2], whole[2]), min(area[3], whole[3])
    )  # fmt: skip
    if not (left < right and low < high):
        raise OSError("has nothing in that area; correct area")
    if picture is None:
        return _cropped_geometry(drawing, (left, right, low, high))
    size = (whole[1] - whole[0], whole[3] - whole[2])
    enlarged = max(size) / max(right - left, high - low)

    def part(side_px: int) -> Image.Image:
        image = picture(min(round(side_px * enlarged), MOST_SIDE_PX))
        across, down = image.width / size[0], image.height / size[1]
        box = (left - whole[0]) * across, (whole[3] - high) * down, (right - whole[0]) * across, (whole[3] - low) * down
        return image.crop((round(box[0]), round(box[1]), max(round(box[2]), 1), max(round(box[3]), 1)))

    return replace(drawing, bounds=(left, right, low, high), picture=part)


def _cropped_geometry(drawing: PlanDrawing, area: Bounds) -> PlanDrawing:
    left, right, low, high = area

    def parts(shapes: object, kind: type[BaseGeometry]) -> list[BaseGeometry]:
        clipped = shapely.get_parts(shapely.intersection(shapes, shapely.box(left, low, right, high)))
        return [part for part in clipped if isinstance(part, kind) and not part.is_empty]

    def segments(lines: FloatArray) -> FloatArray:
        found = [
            shapely.get_coordinates(part)[[0, -1]] for part in parts(shapely.linestrings(lines), shapely.LineString)
        ]
        return np.array(found).reshape(-1, 2, 2)

    polygons = tuple(
        PlanPolygon(_ring(part.exterior), tuple(map(_ring, part.interiors)), each.use, each.name)
        for each in drawing.polygons
        for part in parts(shapely.make_valid(shapely.Polygon(each.outline, each.holes)), shapely.Polygon)
    )
    kept = replace(
        drawing,
        polygons=polygons,
        walls=segments(drawing.walls),
        doors=segments(drawing.doors),
        passages=tuple(
            shapely.get_coordinates(part)
            for line in drawing.passages
            for part in parts(shapely.linestrings(line), shapely.LineString)
        ),
        texts=tuple(one for one in drawing.texts if left <= one.place_m[0] <= right and low <= one.place_m[1] <= high),
    )
    try:
        return mapped(kept, lambda points: points)
    except OSError as error:
        raise OSError("has nothing in that area; correct area") from error


def _ring(ring: BaseGeometry) -> FloatArray:
    """Corners (k, 2) of a ring, the first one once."""
    return np.asarray(shapely.get_coordinates(ring)[:-1])


def file_bytes(path: Path) -> bytes:
    """Read a plan's file; raises OSError, whose text completes a sentence about the file."""
    try:
        return read_bytes(path)
    except OSError as error:
        raise OSError(f"cannot be opened ({error.strerror})") from error


@dataclass(frozen=True)
class PlanFormat:
    """Reads the plans of one format."""

    name: str
    suffixes: tuple[str, ...]
    """Of its files, lower case, with the dot; empty for folders."""
    read: Callable[[Path, PlanSource], PlanDrawing]
    """Read a plan; raises OSError, whose text completes a sentence about the file."""
    recognises: Callable[[Path], bool] = Path.is_file
    """Whether a path with one of the suffixes is of this format; may look inside."""
    options: tuple[str, ...] = ()
    """Entries of a :class:`PlanSource` that apply to this format, besides its file and those that apply to all."""


FORMATS: Registry[PlanFormat] = Registry(plugins.PLAN_FORMATS)


def register(plan_format: PlanFormat) -> None:
    """Make a format known by its name; called once at the end of the format's own module."""
    FORMATS.add(plan_format.name, plan_format)


def format_of(path: Path) -> PlanFormat:
    """The format of a plan's file or folder; raises OSError, whose text completes a sentence about it."""
    if not path.exists():
        raise OSError("does not exist: correct its name, or add the file")
    suffix = "" if path.is_dir() else path.suffix.lower()
    for known in FORMATS.all().values():
        if suffix in known.suffixes and known.recognises(path):
            return known
    if suffix == ".dwg":
        raise OSError("is a DWG file, which cannot be read; save it as DXF")
    if path.is_dir():
        raise OSError("is a folder, but not an IMDF archive, because it has no level.geojson; pass the plan's file")
    raise OSError(f"has an unknown format; plans end with {', '.join(plan_suffixes())}")


def read_drawing(path: Path, source: PlanSource) -> PlanDrawing:
    """Read a plan of any known format; raises OSError, whose text completes a sentence about the file."""
    try:
        drawing = format_of(path).read(path, source)
    except ModuleNotFoundError as error:
        raise OSError(missing_extra(error) or str(error)) from error
    refuse_too_many(drawing.point_count)
    return drawing


def plan_suffixes() -> tuple[str, ...]:
    """Endings of all plan files, sorted."""
    return tuple(sorted({suffix for known in FORMATS.all().values() for suffix in known.suffixes if suffix}))


_WGS84 = 4326
_BEYOND = 1.0
"""Pixels, or units of a page, by which an area may reach beyond a picture: it was rounded."""
NO_SCALE = (
    "has no scale: specify extent = { width_m = ..., height_m = ... }, two points, a distance, a scale or unit_m in "
    "its [floors.plan] of site.toml"
)
_NO_PAPER = (
    "has no size on paper, which a scale such as 1:100 needs (PDF, and SVG in mm, cm, in, pt or pc, have one); "
    "specify its extent or a distance instead"
)


def placed(drawing: PlanDrawing, source: PlanSource, georeference: Georeference | None) -> tuple[PlanDrawing, Affine2]:
    """Return a drawing (its ``area``) on a plane, and the map ``bcs_T_plan`` from that plane to the BCS.

    A drawing that is on earth is projected: into the BCS where the floor's ``georeference`` says where that is, else
    around its own middle. Then its scale counts. Raises OSError, whose text completes a sentence about the file, where
    it has none.
    """
    epsg = source.epsg or drawing.epsg
    points = _as_given(drawing, _points(source))
    if source.area is not None:
        corners = _as_given(drawing, [source.area[:2], source.area[2:]])
        (left, low), (right, high) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        _refuse_beyond(drawing, (left, right, low, high))
        drawing = cropped(drawing, (left, right, low, high))
    if epsg is None:
        return drawing, _scaled(drawing, source, points, drawing.unit_m)
    to_wgs84 = _transformer(epsg)
    middle = _middle(drawing.bounds, to_wgs84)
    if georeference is not None and (doubt := place_doubt(georeference, middle)):
        raise OSError(doubt)
    frame = georeference or middle

    def plane(points: FloatArray) -> FloatArray:
        """Project points (..., 2) onto the plane that touches the earth at the frame."""
        return from_wgs84(_degrees(to_wgs84, points), frame).reshape(points.shape)

    projected = mapped(drawing, plane)
    return projected, _scaled(projected, source, plane(points), None if georeference is None else 1.0)


def _refuse_beyond(drawing: PlanDrawing, area: Bounds) -> None:
    """Raise OSError, whose text completes a sentence about the file, for an area beyond the edges of a picture: its
    scale would be that of another area.
    """
    left, right, low, high = drawing.bounds
    beyond = max(left - area[0], area[1] - right, low - area[2], area[3] - high)
    if drawing.picture is not None and beyond > _BEYOND:
        raise OSError(
            f"shows only {left:g},{low:g},{right:g},{high:g}, but area reaches up to {beyond:g} beyond its edges; "
            "correct area"
        )


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
        raise OSError("has coordinates outside its reference system; correct epsg")
    return degrees


def _transformer(epsg: int) -> Transformer:
    from pyproj import Transformer  # slow to load, and few sites need it
    from pyproj.exceptions import ProjError

    try:
        return Transformer.from_crs(epsg, _WGS84, always_xy=True)
    except ProjError as error:
        raise OSError(f"is said to be in EPSG:{epsg}, which is not a known reference system") from error
