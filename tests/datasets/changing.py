"""Two small surveys of one corridor building whose access points are known, for tests of what changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from vislam2tag.datasets.access_points import NO_NAMES, access_point_table
from vislam2tag.datasets.model import Dataset, DatasetInfo, FloorInfo, Grouping
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, in_schema

WIDTH_M, HEIGHT_M = 60.0, 30.0
POINTS = 24


def bssid(index: int) -> str:
    return f"04:40:a9:{index:02x}:00:00"


def usual_places() -> dict[int, tuple[float, float]]:
    """Where the access points hang: in a grid over the floor."""
    return {index: (5.0 + 10.0 * (index % 6), 4.0 + 7.0 * (index // 6)) for index in range(POINTS)}


@dataclass(frozen=True)
class Survey:
    """How a survey is made."""

    name: str
    seed: int = 0
    places: Mapping[int, tuple[float, float]] = field(default_factory=usual_places)
    power_dbm: Mapping[int, float] = field(default_factory=dict)
    """Power at one metre of access points that do not have the usual one."""
    offsets_db: Mapping[str, float] = field(default_factory=lambda: {"LG": 0.0})
    """The devices that walk, and how much too loud each hears."""
    rows: Sequence[float] = (3.0, 9.0, 15.0, 21.0, 27.0)
    """The y of the corridors that are walked."""
    wall_db: float = 0.0
    """What a new wall costs everything heard in the last third of the corridors."""
    sensitivity_dbm: float = -88.0
    noise_db: float = 3.0


def surveyed(survey: Survey) -> Dataset:
    """Walk each corridor once with each device, a scan every two metres."""
    rng = np.random.default_rng(survey.seed + 1000 * len(survey.name))
    fingerprints, readings = [], []
    for device, offset_db in survey.offsets_db.items():
        for number, y in enumerate(survey.rows):
            session = f"floor_0.{device}.{survey.name}-{number}"
            x = np.arange(1.0, WIDTH_M, 2.0) + rng.uniform(-0.5, 0.5)
            ids = [f"{session}/wifi/{index:06d}" for index in range(len(x))]
            place = np.column_stack((x, y + rng.normal(0, 0.3, len(x))))
            fingerprints.append(_scans(ids, place, session, device))
            readings.append(_heard(ids, place, survey, offset_db, rng))
    scans, heard = pl.concat(fingerprints), pl.concat(readings)
    walks = scans.group_by("session", maintain_order=True).agg(pl.col("floor", "device").first(), fingerprints=pl.len())
    tables = {
        FINGERPRINTS: scans.sort("session", "start_ns"),
        READINGS: heard.sort("scan_id", "bssid"),
        ACCESS_POINTS: access_point_table(scans.lazy(), heard.lazy(), NO_NAMES),
        SESSIONS: in_schema(SESSIONS, walks).sort("session"),
    }
    floor = FloorInfo(number=0, name="floor 0", width_m=WIDTH_M, height_m=HEIGHT_M)
    info = DatasetInfo(name=survey.name, floors=(floor,), groupings=(Grouping(technology="wifi", by="scan"),))
    return Dataset(info, {name: table.lazy() for name, table in tables.items()})


def _scans(ids: list[str], place: np.ndarray, session: str, device: str) -> pl.DataFrame:
    time_ns = 10**12 + 3 * 10**9 * np.arange(len(ids))
    table = {"scan_id": ids, "technology": "wifi", "building": "", "floor": 0, "x": place[:, 0], "y": place[:, 1]}
    more = {"status": "ok", "sigma": 0.2, "device": device, "session": session, "start_ns": time_ns, "end_ns": time_ns}
    return in_schema(FINGERPRINTS, pl.DataFrame(table | more | {"readings": 1, "labelled": 1, "labelled_share": 1.0}))


def _heard(
    ids: list[str], place: np.ndarray, survey: Survey, offset_db: float, rng: np.random.Generator
) -> pl.DataFrame:
    index = np.array(list(survey.places))
    position = np.array(list(survey.places.values())).reshape(-1, 2)
    power = np.array([survey.power_dbm.get(int(one), -38.0) for one in index])
    distance = np.linalg.norm(place[:, None] - position, axis=2)
    rssi = power - 30 * np.log10(np.maximum(distance, 1.0)) + rng.normal(0, survey.noise_db, distance.shape)
    rssi = rssi + offset_db - np.where(place[:, :1] > WIDTH_M * 2 / 3, survey.wall_db, 0.0)
    scan, point = np.nonzero(rssi >= survey.sensitivity_dbm)
    table = pl.DataFrame(
        {
            "scan_id": np.array(ids)[scan],
            "bssid": [bssid(int(one)) for one in index[point]],
            "rssi_dbm": rssi[scan, point].round(),
            "frequency_mhz": 2412.0,
            "time_ns": 10**12 + 3 * 10**9 * scan,
            "floor": 0,
            "x": place[scan, 0],
            "y": place[scan, 1],
            "sigma": 0.2,
        }
    )
    return in_schema(READINGS, table)
