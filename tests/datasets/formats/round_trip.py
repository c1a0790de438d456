"""Writing a data set in a format and reading it back, by our importer or by a reader of the format itself."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import h5py
import numpy as np
import pandas as pd
import polars as pl

from tests.datasets.factory import small_dataset
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ExportContext, ImportContext, export_named, import_named
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS

ODD_DEVICE = 'Pho"ne; 7, "pro"'
ODD_BSSID = 'a,b";c'
Signature = tuple[int, float, float, str | None, tuple[tuple[str, float], ...]]


def exported(dataset: Dataset, name: str, folder: Path, **context: str | bool) -> tuple[Finding, ...]:
    """Write a format; return its findings."""
    writer = export_named(name).write
    assert writer is not None
    return writer(dataset, Folder.at(folder), ExportContext(**context))  # type: ignore[arg-type]


def imported(name: str, path: Path, scratch: Path) -> Dataset:
    return import_named(name).read(path, ImportContext(Folder.at(scratch)))


def through(dataset: Dataset, name: str, folder: Path, **context: str) -> Dataset:
    """Write a format and read it back by our importer."""
    exported(dataset, name, folder / "out", **context)
    return imported(name, folder / "out", folder / "scratch")


def signatures(dataset: Dataset, technology: str | None = None) -> Counter[Signature]:
    """What every format holds of a labelled fingerprint: floor, position, device and the levels heard."""
    known = dataset.fingerprints.filter(pl.all_horizontal(pl.col("x", "y", "floor").is_not_null()))
    if technology:
        known = known.filter(pl.col("technology") == technology)
    levels = (
        dataset.readings.filter(pl.col("rssi_dbm").is_not_null())
        .group_by("scan_id", "bssid")
        .agg(pl.col("rssi_dbm").mean())
        .sort("bssid")
        .group_by("scan_id", maintain_order=True)
        .agg(levels=pl.struct("bssid", "rssi_dbm"))
    )
    rows = known.join(levels, on="scan_id", how="left").select("floor", "x", "y", "device", "levels").collect()
    return Counter(
        (floor, x, y, device, _levels((each["bssid"], each["rssi_dbm"]) for each in heard or ()))
        for floor, x, y, device, heard in rows.iter_rows()
    )


def _levels(pairs: object) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((bssid, round(float(level), 4)) for bssid, level in pairs))  # type: ignore[attr-defined]


def signatures_of_hdf5(folder: Path) -> Counter[Signature]:
    """The same of an HDF5 file, read by h5py alone."""
    found: Counter[Signature] = Counter()
    with h5py.File(folder / "fingerprints.h5") as file:
        for group in (each for each in file.values() if "scan_id" in each):
            levels = group["X"][:]
            bssids = group["access_points/bssid"].asstr()[:]
            devices = [*group["vocabularies/device"].asstr()[:], None]
            rows = zip(group["floor"][:], group["y"][:], group["device"][:], levels, strict=True)
            for floor, (x, y), device, row in rows:
                heard = np.flatnonzero(row != group["X"].attrs["not_heard"])
                pairs = _levels(zip(bssids[heard], row[heard], strict=True))
                found[int(floor), float(x), float(y), devices[device], pairs] += 1
    return found


def signatures_of_geojson(folder: Path) -> Counter[Signature]:
    """The same of a GeoJSON file in metres, read by the standard library alone."""
    content = json.loads((folder / "fingerprints.geojson").read_text(encoding="utf-8"))
    found: Counter[Signature] = Counter()
    for feature in content["features"]:
        about = feature["properties"]
        x, y = feature["geometry"]["coordinates"]
        sums: dict[str, list[float]] = {}
        for each in about["readings"]:
            if each["rssi_dbm"] is not None:
                sums.setdefault(each["bssid"], []).append(float(np.float32(each["rssi_dbm"])))
        pairs = _levels((bssid, float(np.mean(levels))) for bssid, levels in sums.items())
        found[about["floor"], x, y, about["device"], pairs] += 1
    return found


def signatures_of_tables(points: pd.DataFrame, readings: pd.DataFrame) -> Counter[Signature]:
    """The same of two tables that pandas read; coordinates are those of the points if there are any."""
    means = readings.dropna(subset="rssi_dbm").groupby(["scan_id", "bssid"])["rssi_dbm"].mean().reset_index()
    levels: dict[str, list[tuple[str, float]]] = {}
    for scan_id, bssid, level in zip(means["scan_id"], means["bssid"], means["rssi_dbm"], strict=True):
        levels.setdefault(scan_id, []).append((bssid, float(np.float32(level))))
    x, y = (points.geometry.x, points.geometry.y) if "geometry" in points else (points["x"], points["y"])
    heard = (_levels(levels.get(scan_id, ())) for scan_id in points["scan_id"])
    return Counter(zip(points["floor"].astype(int), x, y, points["device"], heard, strict=True))


def signatures_of_csv(folder: Path) -> Counter[Signature]:
    """The same of CSV tables, read by pandas alone."""
    points = pd.read_csv(folder / "fingerprints.csv").dropna(subset=["x", "y", "floor"])
    return signatures_of_tables(points, pd.read_csv(folder / "readings.csv"))


def signatures_of_geoparquet(folder: Path) -> Counter[Signature]:
    """The same of GeoParquet in metres, read by geopandas and pandas."""
    points = gpd.read_parquet(folder / "fingerprints.parquet")
    return signatures_of_tables(points, pd.read_parquet(folder / "readings.parquet"))


def signatures_of_geopackage(folder: Path) -> Counter[Signature]:
    """The same of a GeoPackage in metres, read by geopandas."""
    file = folder / "fingerprints.gpkg"
    return signatures_of_tables(*(gpd.read_file(file, layer=layer) for layer in ("fingerprints", "readings")))


def odd_dataset() -> Dataset:
    """The small set with names that files of text trip over, without a name for a network, and a user."""
    plain = small_dataset()
    first = plain.access_points.select(pl.col("bssid").first()).collect().item()
    swap = pl.col("bssid").replace(first, ODD_BSSID)
    device = pl.col("device").replace("Galaxy", ODD_DEVICE)
    tables = {
        FINGERPRINTS: plain.fingerprints.with_columns(device, user=pl.lit('Ö\'Neil, "B"')),
        READINGS: plain.readings.with_columns(swap),
        ACCESS_POINTS: plain.access_points.with_columns(swap, ssid=pl.lit("")).sort("bssid"),
        SESSIONS: plain.sessions.with_columns(device, user=pl.lit('Ö\'Neil, "B"')),
    }
    return replace(plain, tables=tables)


def with_split(dataset: Dataset, folds: int = 1, kind: str = "trajectory") -> Dataset:
    """Add the split ``by_walk``: a walk a fold tests, the last fingerprint of each is in neither part."""
    ids = dataset.fingerprints.select("scan_id", "session").collect()
    group = pl.when(pl.col("scan_id").is_last_distinct().over("session") & _is_last()).then(None).otherwise("session")
    groups = ids.select(id="scan_id", group=group)
    walks = ids["session"].unique().sort().to_list()
    info = SplitInfo(
        name="by_walk", kind=kind, folds=tuple(Fold(name=f"{walk}/x", test=(walk,)) for walk in walks[:folds])
    )
    return replace(dataset, splits={"by_walk": Split(info, groups)})


def _is_last() -> pl.Expr:
    return pl.int_range(pl.len()).over("session") == 0
