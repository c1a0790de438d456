"""From a data set to a folder of radio maps: NumPy, GeoTIFF (OGC 19-008r4), figures, an index and a page."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import tifffile
from numpy.typing import NDArray

from vislam2tag import __version__
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.datasets.folder import MANIFEST, dataset_in, open_dataset_to_share, sha256_of
from vislam2tag.datasets.map_process import MapKernel
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.radio_maps import FloorMaps, RadioMap, radio_maps
from vislam2tag.datasets.settings import RadioMapSettings
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.model import unique_slugs
from vislam2tag.views.panels import rendered
from vislam2tag.views.radio_map_page import access_point_map, contact_sheet, map_floor, write_radio_map_page

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

    That is the BCS itself or, with a georeference, easting and northing from its origin.
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
    """Write layers (rows, columns), row 0 at the lower edge, by name as bands of 32-bit floats; NaN means no data.

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
    """Key directory, double parameters and text parameters of the frame; keys are sorted, as the standard requires."""
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

    GDAL escapes texts twice, and reads them accordingly.
    """
    items = [f"<Item name={quoteattr(name)}>{escape(escape(text))}</Item>" for name, text in tags.items()]
    items += [
        f'<Item name="DESCRIPTION" sample="{number}" role="description">{escape(name)}</Item>'
        for number, name in enumerate(names)
    ]
    xml = f"<GDALMetadata>{''.join(items)}</GDALMetadata>"
    return xml.encode("ascii", "xmlcharrefreplace").decode("ascii")


INDEX_FILE, PAGE_FILE = "radio_maps.json", "index.html"
FIGURES, IMAGES = "figures", "geotiff"
LAYERS = ("mean_dbm", "deviation_db", "sigma_db", "heard")
"""Bands of a GeoTIFF and arrays of a NumPy file."""


class MapFile(RadioMap):
    """One access point of the index."""

    geotiff: str


class FloorIndex(Record):
    """One floor and technology of the index."""

    building: str
    floor: int
    technology: str
    npz: str
    fingerprints: int
    rows: int
    columns: int
    cell_m: float
    pixel_to_bcs: tuple[tuple[float, float, float], ...]
    """Affine map from column and row of an image (row 0 at the top) to x and y, metres."""
    bcs_to_site: tuple[tuple[float, float, float], ...]
    """Affine map from x and y to the GeoTIFFs' frame."""
    georeference: Georeference | None
    kernel: MapKernel
    heard_width_m: float
    offsets_db: dict[str, float]
    access_points: tuple[MapFile, ...]


class RadioMapIndex(Result):
    """``radio_maps.json``: sources, files and accuracy of the maps."""

    main_table: ClassVar[str] = "floors"

    version: str
    dataset: str
    dataset_sha256: str
    """SHA-256 of the data set's manifest, which contains the checksums of its tables."""
    settings: RadioMapSettings
    layers: tuple[str, ...] = LAYERS
    floors: tuple[FloorIndex, ...]


def is_radio_maps(folder: Path) -> bool:
    """Whether the folder contains radio maps."""
    return (folder / INDEX_FILE).is_file()


def write_radio_maps(
    source: AnyPath,
    out: AnyPath,
    settings: RadioMapSettings,
    access_points: Sequence[str] = (),
    progress: Progress[int] = silent,
    *,
    follow_links: bool = False,
) -> RadioMapIndex:
    """Write the radio maps of the data set in ``source`` to ``out``, which appears complete or not at all.

    Raises DatasetError and UsageError as :func:`vislam2tag.datasets.radio_maps.radio_maps` does,
    and for links to files outside ``source`` without ``follow_links``, OutputError if ``out`` contains something
    else or cannot be written.
    """
    source, out = Path(source), Path(out)
    dataset = open_dataset_to_share(source, follow_links=follow_links)
    with whole_folder(out, is_radio_maps) as folder:
        floors, shown = [], []
        for maps in radio_maps(dataset, settings, access_points, progress):
            index = _write_floor(folder, dataset, maps)
            floors.append(index)
            floor = dataset.site_floor(Storey(maps.place.building, maps.place.floor))
            files = [one.geotiff for one in index.access_points]
            shown.append(map_floor(maps, floor, Path(index.npz).stem, files))
        write_radio_map_page(folder / PAGE_FILE, dataset.info.title or dataset.info.name, shown)
        index_of_all = RadioMapIndex(
            version=__version__,
            dataset=dataset.info.name,
            dataset_sha256=sha256_of(dataset_in(source) / MANIFEST),
            settings=settings,
            floors=tuple(floors),
        )
        folder.write(INDEX_FILE, index_of_all.model_dump_json(indent=1) + "\n")
    return index_of_all


def _write_floor(folder: Folder, dataset: Dataset, maps: FloorMaps) -> FloorIndex:
    """Write the files of one floor."""
    stem = _stem(dataset, maps)
    georeference = dataset.site_floor(Storey(maps.place.building, maps.place.floor)).georeference
    names = [f"{IMAGES}/{stem}/{slug}.tif" for slug in unique_slugs([one.bssid for one in maps.maps])]
    for number, (one, name) in enumerate(zip(maps.maps, names, strict=True)):
        layers = {layer: getattr(maps, layer)[number] for layer in LAYERS}
        tags = {"bssid": one.bssid, "ssid": one.ssid or "", "technology": maps.place.technology}
        write_geotiff(folder, name, layers, maps.grid, georeference, tags)
    _write_arrays(folder, f"{stem}.npz", maps)
    _write_figures(folder.folder(FIGURES), stem, dataset, maps)
    return FloorIndex(
        **maps.place._asdict(),
        npz=f"{stem}.npz",
        fingerprints=maps.scans,
        rows=maps.grid.rows,
        columns=maps.grid.columns,
        cell_m=maps.grid.cell_m,
        pixel_to_bcs=_rows(pixel_transform(maps.grid)),
        bcs_to_site=_rows(site_transform(georeference)),
        georeference=georeference,
        kernel=maps.kernel,
        heard_width_m=maps.heard_width_m,
        offsets_db=maps.offsets_db,
        access_points=tuple(
            MapFile(**one.model_dump(), geotiff=name) for one, name in zip(maps.maps, names, strict=True)
        ),
    )


def _write_arrays(folder: Folder, name: str, maps: FloorMaps) -> None:
    """Write the layers, (access points, rows, columns) with row 0 at the lower edge, and their georeference."""
    with folder.writing(name) as file:
        np.savez_compressed(
            file,
            bssids=np.array([one.bssid for one in maps.maps]),
            origin_m=np.array(maps.grid.origin_m),
            cell_m=np.array(maps.grid.cell_m),
            **{layer: getattr(maps, layer) for layer in LAYERS},
        )


def _write_figures(folder: Folder, stem: str, dataset: Dataset, maps: FloorMaps) -> None:
    floor = dataset.site_floor(Storey(maps.place.building, maps.place.floor))
    sheet, most_heard = contact_sheet(maps, floor), access_point_map(maps, floor, 0)
    for kind in ("png", "pdf"):
        folder.write(f"{stem}.{kind}", rendered(sheet, kind))
        folder.write(f"{stem}.most_heard.{kind}", rendered(most_heard, kind))


def _stem(dataset: Dataset, maps: FloorMaps) -> str:
    """Stem of a floor's files, such as ``floor_1.wifi``; with the building if several buildings have this floor."""
    buildings = sorted({floor.building for floor in dataset.info.floors} | {maps.place.building})
    slugs = dict(zip(buildings, unique_slugs(buildings), strict=True))
    parts = [slugs[maps.place.building]] if len(buildings) > 1 else []
    return ".".join([*parts, f"floor_{maps.place.floor}", maps.place.technology])


def _rows(affine: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    """Rows of an affine map (2, 3)."""
    return tuple((float(a), float(b), float(c)) for a, b, c in affine)
