"""GeoTIFF: layers over a floor's grid with their place, in the floor's own metres or on the earth (OGC 19-008r4)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import tifffile
from numpy.typing import NDArray

from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.survey.georeference import Georeference

_DOUBLE, _SHORT, _ASCII = "d", "H", "s"
_TRANSFORMATION, _KEYS, _DOUBLES, _TEXTS = 34264, 34735, 34736, 34737
_GDAL_METADATA, _GDAL_NODATA = 42112, 42113
_MODEL, _RASTER, _CITATION = 1024, 1025, 1026
_GEODETIC, _PROJECTED, _CONVERSION, _METHOD, _UNIT = 2048, 3072, 3074, 3075, 3076
_ORIGIN_LONGITUDE, _ORIGIN_LATITUDE, _EASTING, _NORTHING, _SCALE = 3080, 3081, 3082, 3083, 3092
_USER_DEFINED, _PIXEL_IS_AREA, _METRE, _WGS84, _TRANSVERSE_MERCATOR = 32767, 1, 9001, 4326, 1


def pixel_transform(grid: CellGrid) -> FloatArray:
    """Affine map (2, 3) from column and row of an image, row 0 at the top, to x and y in the BCS."""
    left, _, _, top = grid.extent_m
    return np.array([[grid.cell_m, 0.0, left], [0.0, -grid.cell_m, top]])


def site_transform(georeference: Georeference | None) -> FloatArray:
    """Affine map (2, 3) from x and y in the BCS to the GeoTIFF's frame.

    That is the BCS itself, or, where the floor's place on the earth is known, easting and northing from its origin.
    """
    turn = 0.0 if georeference is None else np.radians(georeference.bearing_deg)
    return np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0]])


def write_geotiff(
    folder: Folder,
    name: str,
    layers: Mapping[str, NDArray[np.float32]],
    grid: CellGrid,
    georeference: Georeference | None,
    tags: Mapping[str, str],
) -> None:
    """Write layers (rows, columns), row 0 at the lower edge, by name as bands of 32-bit floats; NaN is no data.

    ``tags`` are texts about the whole image. Without a georeference the frame is a local one in metres; with one it is
    a transverse Mercator projection about the origin of the BCS.
    """
    site, pixel = (np.vstack((part, (0, 0, 1))) for part in (site_transform(georeference), pixel_transform(grid)))
    affine = site @ pixel
    matrix = np.eye(4)
    matrix[:2, :2], matrix[:2, 3] = affine[:2, :2], affine[:2, 2]
    keys, doubles, text = _geo_keys(georeference)
    extra = [
        (_TRANSFORMATION, _DOUBLE, 16, tuple(matrix.ravel().tolist()), True),
        (_KEYS, _SHORT, len(keys), keys, True),
        (_TEXTS, _ASCII, 0, text, True),
        (_GDAL_METADATA, _ASCII, 0, _metadata(list(layers), tags), True),
        (_GDAL_NODATA, _ASCII, 0, "nan", True),
    ]
    if doubles:
        extra.insert(2, (_DOUBLES, _DOUBLE, len(doubles), doubles, True))
    content = io.BytesIO()
    tifffile.imwrite(
        content,
        np.stack([layer[::-1] for layer in layers.values()]).astype(np.float32),
        photometric="minisblack",
        planarconfig="separate",
        compression="zlib",
        metadata=None,
        software=False,
        extratags=extra,
    )
    folder.write(name, content.getvalue())


def _geo_keys(georeference: Georeference | None) -> tuple[tuple[int, ...], tuple[float, ...], str]:
    """Key directory, double parameters and text parameters of the frame; keys rise, as the standard has it."""
    if georeference is None:
        text = "BCS of a floor: x to the right and y up on its plan|"
        values: dict[int, int | float | str] = {_MODEL: _USER_DEFINED, _RASTER: _PIXEL_IS_AREA, _CITATION: text}
        values[_UNIT] = _METRE
    else:
        text = "Transverse Mercator about the origin of a building|"
        values = {
            _MODEL: 1,
            _RASTER: _PIXEL_IS_AREA,
            _CITATION: text,
            _GEODETIC: _WGS84,
            _PROJECTED: _USER_DEFINED,
            _CONVERSION: _USER_DEFINED,
            _METHOD: _TRANSVERSE_MERCATOR,
            _UNIT: _METRE,
            _ORIGIN_LONGITUDE: georeference.longitude_deg,
            _ORIGIN_LATITUDE: georeference.latitude_deg,
            _EASTING: 0.0,
            _NORTHING: 0.0,
            _SCALE: 1.0,
        }
    doubles = tuple(value for value in values.values() if isinstance(value, float))
    directory = [1, 1, 0, len(values)]
    place = 0
    for key, value in values.items():
        if isinstance(value, float):
            directory += [key, _DOUBLES, 1, place]
            place += 1
        elif isinstance(value, str):
            directory += [key, _TEXTS, len(value), 0]
        else:
            directory += [key, 0, 1, value]
    return tuple(directory), doubles, text


def _metadata(names: list[str], tags: Mapping[str, str]) -> str:
    """GDAL's XML: names of the bands, and texts about the image; beyond ASCII as character references.

    GDAL itself escapes texts, then the XML that holds them, and reads them so.
    """
    items = [f"<Item name={quoteattr(name)}>{escape(escape(text))}</Item>" for name, text in tags.items()]
    items += [
        f'<Item name="DESCRIPTION" sample="{number}" role="description">{escape(name)}</Item>'
        for number, name in enumerate(names)
    ]
    xml = f"<GDALMetadata>{''.join(items)}</GDALMetadata>"
    return xml.encode("ascii", "xmlcharrefreplace").decode("ascii")
