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
_Floor = tuple[str, int]


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.geojson``, session by session.

    Raises DatasetError if no fingerprint has a position.
    """
    fingerprints, findings = labelled_fingerprints(dataset)
    used = set(fingerprints.select("building", "floor").unique().collect(engine="streaming").rows())
    known = {(floor.building, floor.number): floor.georeference for floor in dataset.info.floors if floor.georeference}
    georeferenced = used <= set(known)
    with folder.writing(FILE) as file:
        file.write(_head(dataset, georeferenced=georeferenced).encode())
        separator = ""
        for tables in labelled_by_session(dataset, fingerprints, context.progress):
            for feature in _features(tables, known if georeferenced else {}):
                file.write(f"{separator}{feature}".encode())
                separator = ",\n"
        file.write(b"\n]}\n")
    return (*findings, *_not_georeferenced(used - set(known)))


def _head(dataset: Dataset, *, georeferenced: bool) -> str:
    head: dict[str, object] = {"type": "FeatureCollection", "name": dataset.info.name}
    if not georeferenced:
        head |= {"crs": None, "frame": f"{dataset.info.frame}; not longitude and latitude"}
    return json.dumps(head, ensure_ascii=False)[:-1] + ', "features": [\n'


def _features(tables: SessionTables, known: Mapping[_Floor, Georeference]) -> list[str]:
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
        for (first, second), text in zip(_coordinates(points, known), texts, strict=True)
    ]


def _coordinates(points: pl.DataFrame, known: Mapping[_Floor, Georeference]) -> list[list[float]]:
    """Longitude and latitude, degrees, or x and y, metres, of each point."""
    position = points.select("x", "y").to_numpy()
    if known:
        floors = points.select("building", "floor").rows()
        for floor in set(floors):
            own = np.array([each == floor for each in floors])
            position[own] = np.round(to_wgs84(position[own], known[floor]), _DECIMALS)
    coordinates: list[list[float]] = position.tolist()
    return coordinates


def _not_georeferenced(floors: set[_Floor]) -> tuple[Finding, ...]:
    named = ", ".join(f"{building} {floor}".strip() for building, floor in sorted(floors))
    message = (
        f"floors without a georeference ({named}): all coordinates are metres in the frame of each floor; add a "
        "georeference to site.toml, make the data set again with `dataset --survey`, and export again"
    )
    return finding_if(len(floors), "no_georeference", message, FILE)


register(writes=ExportFormat("geojson", HOLDS, write=write))
