"""Fingerprints as points for GIS: GeoParquet 1.1 (OGC 24-013) and GeoPackage (OGC 12-128), beside their readings.

Coordinates are longitude and latitude if every floor has a georeference. Otherwise they are metres in the frame of each
floor, which the files describe as an engineering CRS, so that no program takes them for degrees.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

import polars as pl
import shapely
from pyproj import CRS

from vislam2tag.common.errors import import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_parquet
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.formats.geojson import HOLDS as POINTS_AND_READINGS
from vislam2tag.datasets.formats.geojson import Floor, coordinates, georeferences
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS, SCHEMAS
from vislam2tag.datasets.writing import labelled_by_session, labelled_fingerprints
from vislam2tag.site.georeference import Georeference

HOLDS = {**POINTS_AND_READINGS, READINGS: tuple(SCHEMAS[READINGS])}
GEOMETRY = "geometry"
GEOPACKAGE_FILE = "fingerprints.gpkg"
_WRITTEN = "2000-01-01T00:00:00.000Z"
"""Written as the date of the last change, so that the same data give the same bytes."""
_DEGREES = "OGC:CRS84"
_METRES = (
    'ENGCRS["Building frame of each floor",EDATUM["Lower left corner of the plan"],CS[Cartesian,2],'
    'AXIS["right on the plan (x)",east,ORDER[1]],AXIS["up on the plan (y)",north,ORDER[2]],LENGTHUNIT["metre",1]]'
)


def _crs(known: Mapping[Floor, Georeference]) -> CRS:
    return CRS.from_user_input(_DEGREES) if known else CRS.from_wkt(_METRES)


def _with_points(rows: pl.DataFrame, known: Mapping[Floor, Georeference]) -> pl.DataFrame:
    """Add the point of each fingerprint as well-known binary."""
    points = shapely.to_wkb(shapely.points(coordinates(rows, known)), byte_order=1)
    return rows.with_columns(pl.Series(GEOMETRY, points.tolist(), dtype=pl.Binary))


def write_geoparquet(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.parquet`` with points, and ``readings.parquet``.

    Raises DatasetError if no fingerprint has a position.
    """
    fingerprints, findings = labelled_fingerprints(dataset)
    file = f"{FINGERPRINTS}.parquet"
    known, missing = georeferences(dataset, fingerprints, file)
    column = {"encoding": "WKB", "geometry_types": ["Point"], "crs": json.loads(_crs(known).to_json())}
    about = {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    points = fingerprints.map_batches(
        lambda rows: _with_points(rows, known),
        schema=dict(fingerprints.collect_schema()) | {GEOMETRY: pl.Binary()},
        streamable=True,
    )
    write_parquet(points, folder, file, compression="snappy", metadata={"geo": json.dumps(about)})
    context.progress(FINGERPRINTS, 2)
    readings = dataset.readings.join(fingerprints.select("scan_id"), on="scan_id", how="semi", maintain_order="left")
    write_parquet(readings, folder, f"{READINGS}.parquet", compression="snappy")
    context.progress(READINGS, 2)
    return (*findings, *missing)


def write_geopackage(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.gpkg`` with the layers ``fingerprints`` (points) and ``readings``, session by session.

    Raises DatasetError if no fingerprint has a position.
    """
    pyogrio = import_extra("pyogrio")
    fingerprints, findings = labelled_fingerprints(dataset)
    known, missing = georeferences(dataset, fingerprints, GEOPACKAGE_FILE)
    point = {"geometry_name": GEOMETRY, "geometry_type": "Point", "crs": _crs(known).to_wkt()}
    with folder.filling(GEOPACKAGE_FILE) as path, _dated(pyogrio):
        further = False
        for tables in labelled_by_session(dataset, fingerprints, context.progress):
            points = _with_points(tables.fingerprints, known)
            for layer, rows, about in ((FINGERPRINTS, points, point), (READINGS, tables.readings, {})):
                arrow = rows.to_arrow(compat_level=pl.CompatLevel.oldest())
                pyogrio.write_arrow(arrow, path, layer=layer, driver="GPKG", append=further, **about)
            further = True
    return (*findings, *missing)


@contextmanager
def _dated(pyogrio: ModuleType) -> Iterator[None]:
    """Write a fixed date while the block runs; GDAL's setting is that of the whole process."""
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": _WRITTEN})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})


register(writes=ExportFormat("geoparquet", HOLDS, write=write_geoparquet))
register(writes=ExportFormat("geopackage", HOLDS, write=write_geopackage))
