"""Fingerprints as GeoJSON points (RFC 7946): WGS84 if every floor has a georeference, else metres in the BCS.

A file in metres names its frame in the member ``frame``. Its ``crs`` is null, which tools of the format's first version
read as a local frame.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.model import Dataset, SessionTables
from vislam2tag.datasets.schema import FINGERPRINTS, SCHEMAS
from vislam2tag.datasets.writing import labelled_by_session, labelled_fingerprints
from vislam2tag.site.georeference import Georeference, to_wgs84

FILE = "fingerprints.geojson"
READINGS = ("bssid", "rssi_dbm", "frequency_mhz", "time_ns")
"""Columns that are written for each reading of a fingerprint."""
_DECIMALS = 9
"""Decimals of degrees: a tenth of a millimetre."""
HOLDS = {
    FINGERPRINTS: tuple(SCHEMAS[FINGERPRINTS]),
    "readings": ("scan_id", *READINGS),
    "access_points": ("bssid", "technology", "frequency_mhz"),
    "sessions": ("session", "building", "device", "user"),
}
Floor = tuple[str, int]
"""Building and number of a floor."""


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.geojson``, session by session.

    Raises DatasetError if no fingerprint has a position.
    """
    fingerprints, findings = labelled_fingerprints(dataset)
    known, missing = georeferences(dataset, fingerprints, FILE)
    with folder.writing(FILE) as file:
        file.write(_head(dataset, georeferenced=bool(known)).encode())
        separator = ""
        for tables in labelled_by_session(dataset, fingerprints, context.progress):
            for feature in _features(tables, known):
                file.write(f"{separator}{feature}".encode())
                separator = ",\n"
        file.write(b"\n]}\n")
    return (*findings, *missing)


def georeferences(
    dataset: Dataset, fingerprints: pl.LazyFrame, file: str
) -> tuple[dict[Floor, Georeference], tuple[Finding, ...]]:
    """The georeference of each floor if all floors of the fingerprints have one, else none and a finding."""
    used = set(fingerprints.select("building", "floor").unique().collect(engine="streaming").rows())
    known = {(floor.building, floor.number): floor.georeference for floor in dataset.info.floors if floor.georeference}
    missing = used - set(known)
    named = ", ".join(f"{building} {floor}".strip() for building, floor in sorted(missing))
    message = (
        f"floors without a georeference ({named}): all coordinates are metres in the frame of each floor, but GIS "
        "programs read them as degrees. Export to geopackage, or add a georeference to site.toml, make the data set "
        "again with `dataset --survey`, and export again"
    )
    return {} if missing else known, finding_if(len(missing), "no_georeference", message, file)


def _head(dataset: Dataset, *, georeferenced: bool) -> str:
    head: dict[str, object] = {"type": "FeatureCollection", "name": dataset.info.name}
    if not georeferenced:
        head |= {"crs": None, "frame": f"{dataset.info.frame}; not longitude and latitude"}
    return json.dumps(head, ensure_ascii=False)[:-1] + ', "features": [\n'


def _features(tables: SessionTables, known: Mapping[Floor, Georeference]) -> list[str]:
    """Write each fingerprint as a feature with all other columns and its readings as properties."""
    heard = tables.readings.group_by("scan_id", maintain_order=True).agg(readings=pl.struct(READINGS))
    points = tables.fingerprints.drop("readings").join(heard, on="scan_id", how="left", maintain_order="left")
    # Metres are among the properties if coordinates are degrees.
    dropped = [] if known else ["x", "y"]
    properties = points.drop(dropped).with_columns(pl.col("date").cast(pl.String), pl.col("readings").fill_null([]))
    texts = properties.select(pl.struct(pl.all()).struct.json_encode()).to_series()
    return [
        f'{{"type": "Feature", "geometry": {{"type": "Point", "coordinates": [{first!r}, {second!r}]}}, '
        f'"properties": {text}}}'
        for (first, second), text in zip(coordinates(points, known).tolist(), texts, strict=True)
    ]


def coordinates(points: pl.DataFrame, known: Mapping[Floor, Georeference]) -> FloatArray:
    """Longitude and latitude, degrees, of each point (n, 2), or its x and y, metres, if nothing is ``known``."""
    position = points.select("x", "y").to_numpy()
    if known:
        floors = points.select("building", "floor").rows()
        for floor in set(floors):
            own = np.array([each == floor for each in floors])
            position[own] = np.round(to_wgs84(position[own], known[floor]), _DECIMALS)
    return position


register(writes=ExportFormat("geojson", HOLDS, write=write))
