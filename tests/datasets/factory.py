"""Small data sets with known contents for tests: two floors, two phones, four walks along corridors."""

from __future__ import annotations

import datetime as dt

import numpy as np
import polars as pl

from vislam2tag.datasets.model import Dataset, DatasetInfo, FloorInfo, Grouping
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, in_schema

FLOORS = (0, 1)
DEVICES = ("Galaxy", "Pixel")
SCANS = 12
"""Scans of a walk."""
SCAN_STEP_M = 3.0
SCAN_STEP_NS = 3_000_000_000
FIRST_NS = 1_000_000_000_000
ACCESS_POINTS_A_FLOOR = 5
RADIUS_M = 45.0
"""Access points farther than this are not heard."""
SESSION_KEYS = [(floor, device, f"floor_{floor}.{device}.walk") for floor in FLOORS for device in DEVICES]


def bssid(floor: int, index: int) -> str:
    return f"00:11:22:33:{floor:02x}:{index:02x}"


def small_dataset(unlabelled: int = 1) -> Dataset:
    """Make a data set in memory; the last ``unlabelled`` scans of each walk have no label."""
    fingerprints = pl.concat([_fingerprints(*key, unlabelled) for key in SESSION_KEYS])
    readings = pl.concat([_readings(*key, unlabelled) for key in SESSION_KEYS])
    tables = {
        FINGERPRINTS: fingerprints,
        READINGS: readings,
        ACCESS_POINTS: _access_points(readings),
        SESSIONS: _sessions(fingerprints),
    }
    info = DatasetInfo(
        name="small",
        title="A small data set",
        floors=tuple(
            FloorInfo(number=floor, name=f"floor {floor}", elevation_m=3.5 * floor, width_m=60.0, height_m=30.0)
            for floor in FLOORS
        ),
        groupings=(Grouping(technology="wifi", by="scan"),),
    )
    return Dataset(info, {name: in_schema(name, table).lazy() for name, table in tables.items()})


def scan_id(session: str, index: int) -> str:
    return f"{session}/wifi/{index:06d}"


def _positions(floor: int, device: str) -> np.ndarray:
    """Where the scans of a walk were taken (SCANS, 2): along a corridor, another one for each phone."""
    x = 5.0 + SCAN_STEP_M * np.arange(SCANS)
    return np.stack([x, np.full(SCANS, 10.0 + 5.0 * DEVICES.index(device) + floor)], axis=1)


def _fingerprints(floor: int, device: str, session: str, unlabelled: int) -> pl.DataFrame:
    position = _positions(floor, device)
    known = np.arange(SCANS) < SCANS - unlabelled
    start_ns = FIRST_NS + SCAN_STEP_NS * np.arange(SCANS)
    heard = [len(_heard(floor, point)) for point in position]
    return in_schema(
        FINGERPRINTS,
        pl.DataFrame(
            {
                "scan_id": [scan_id(session, index) for index in range(SCANS)],
                "technology": "wifi",
                "building": "",
                "x": position[:, 0],
                "y": position[:, 1],
                "x_median": position[:, 0],
                "y_median": position[:, 1],
                "z": 3.5 * floor + 1.3,
                "sigma": 0.1,
                "spread": 0.3,
                "labelled_share": 1.0,
                "status": "ok",
                "floor": floor,
                "heading_deg": 0.0,
                "speed_m_s": 1.0,
                "readings": heard,
                "labelled": heard,
                "device": device,
                "session": session,
                "start_ns": start_ns,
                "end_ns": start_ns + SCAN_STEP_NS // 2,
                "date": dt.date(2026, 3, 1 + DEVICES.index(device)),
            }
        ).with_columns(
            *(
                pl.when(pl.Series(known)).then(pl.col(name))
                for name in ("x", "y", "z", "sigma", "spread", "x_median", "y_median", "heading_deg", "speed_m_s")
            ),
            floor=pl.when(pl.Series(known)).then(pl.col("floor")),
            labelled=pl.when(pl.Series(known)).then(pl.col("labelled")).otherwise(0),
            labelled_share=pl.when(pl.Series(known)).then(1.0).otherwise(0.0),
            status=pl.when(pl.Series(known)).then(pl.lit("ok")).otherwise(pl.lit("after_last_landmark")),
        ),
    )


def _heard(floor: int, point: np.ndarray) -> list[tuple[str, float]]:
    """The access points heard at a point of a floor, and how loud (dBm)."""
    found = []
    for storey in FLOORS:
        for index in range(ACCESS_POINTS_A_FLOOR):
            distance = float(np.hypot(*(point - [6.0 + 12.0 * index, 12.0])))
            if distance < RADIUS_M:
                found.append((bssid(storey, index), -40.0 - distance - 20.0 * abs(storey - floor)))
    return found


def _readings(floor: int, device: str, session: str, unlabelled: int) -> pl.DataFrame:
    rows = []
    for index, point in enumerate(_positions(floor, device)):
        known = index < SCANS - unlabelled
        for number, (transmitter, rssi_dbm) in enumerate(_heard(floor, point)):
            rows.append(
                {
                    "scan_id": scan_id(session, index),
                    "bssid": transmitter,
                    "rssi_dbm": rssi_dbm,
                    "frequency_mhz": 2412.0,
                    "time_ns": FIRST_NS + SCAN_STEP_NS * index + number * 1_000_000,
                    "floor": floor if known else None,
                    "x": float(point[0]) if known else None,
                    "y": float(point[1]) if known else None,
                    "sigma": 0.1 if known else None,
                }
            )
    return in_schema(READINGS, pl.DataFrame(rows, infer_schema_length=None))


def _access_points(readings: pl.DataFrame) -> pl.DataFrame:
    return in_schema(
        ACCESS_POINTS,
        readings.with_columns(session=pl.col("scan_id").str.split("/").list.first())
        .group_by("bssid", maintain_order=True)
        .agg(
            technology=pl.lit("wifi"),
            ssid=pl.lit("eduroam"),
            frequency_mhz=pl.col("frequency_mhz").first(),
            readings=pl.len(),
            fingerprints=pl.col("scan_id").n_unique(),
            sessions=pl.col("session").n_unique(),
            floors=pl.col("floor").drop_nulls().unique().sort(),
            strongest_dbm=pl.col("rssi_dbm").max(),
            randomised=pl.lit(False),
            mobile=pl.lit(False),
            nomap=pl.lit(False),
        )
        .with_columns(radio=pl.col("bssid"))
        .sort("bssid"),
    )


def _sessions(fingerprints: pl.DataFrame) -> pl.DataFrame:
    return in_schema(
        SESSIONS,
        fingerprints.group_by("session", maintain_order=True).agg(
            building=pl.lit(""),
            floor=pl.col("floor").first(),
            device=pl.col("device").first(),
            name=pl.lit("walk"),
            started=pl.col("date").first().cast(pl.Datetime("us")),
            duration_s=pl.lit(SCANS * SCAN_STEP_NS / 1e9),
            distance_m=pl.lit(SCANS * SCAN_STEP_M),
            labelled_s=pl.col("x").count() * (SCAN_STEP_NS / 1e9),
            labelled_m=pl.col("x").count() * SCAN_STEP_M,
            fingerprints=pl.len(),
            source=pl.lit("0" * 64),
        ),
    )
