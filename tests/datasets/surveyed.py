"""Fingerprints of simulated floors whose true radio field is known at every point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.stats import norm

from tests.datasets.factory import scan_id
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.model import Dataset, DatasetInfo, FloorInfo, Grouping
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, empty_table, in_schema
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import SimulatedFloor
from vislam2tag.simulation.radio import RadioEnvironment, RadioSettings, make_radio_environment, mean_rss_dbm
from vislam2tag.simulation.settings import BuildingSettings

OFFSETS_DB = {"Galaxy": 3.0, "Pixel": -3.0}
SENSITIVITY_DBM = -90.0
MISS = RadioSettings().miss_share
FADING_DB = RadioSettings().fading_sigma_db
STEP_M = 2.0


@dataclass(frozen=True)
class Surveyed:
    """A data set and the field that it was drawn from."""

    dataset: Dataset
    environment: RadioEnvironment

    @property
    def floor(self) -> SimulatedFloor:
        return self.environment.building.floors[0]

    def truth(self, bssid: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean RSSI of the readings that are heard, less the device's offset, and the share of scans that hear one."""
        index = self.environment.building.ap_bssid.index(bssid)
        place = np.column_stack((points, np.full(len(points), 1.4)))
        own = np.full(len(points), index)
        mean = mean_rss_dbm(self.environment, self.floor.number, place, own, -200.0)
        heard, level = [], []
        for offset in OFFSETS_DB.values():
            above = (mean + offset - (SENSITIVITY_DBM - 0.5)) / FADING_DB
            heard.append((1 - MISS) * norm.cdf(above))
            level.append(mean + FADING_DB * np.exp(norm.logpdf(above) - norm.logcdf(above)))
        level_dbm: FloatArray = np.average(level, axis=0, weights=np.array(heard) + 1e-12)
        return level_dbm, np.mean(heard, axis=0)

    def points(self, count: int, seed: int) -> FloatArray:
        """Random points of the ways."""
        rng = np.random.default_rng(seed)
        start, stop = self.floor.nodes[self.floor.edges].transpose(1, 0, 2)
        length = np.linalg.norm(stop - start, axis=1)
        edge = rng.choice(len(length), count, p=length / length.sum())
        points: FloatArray = start[edge] + rng.random((count, 1)) * (stop - start)[edge]
        return points


def surveyed(walks: int = 8, scans: int = 60, seed: int = 1, access_points: int = 14) -> Surveyed:
    """Walk a floor with two phones in turn; each walk strolls along its ways."""
    building = make_building(BuildingSettings(access_points=access_points), seed)
    environment = make_radio_environment(building, RadioSettings(), seed)
    rng = np.random.default_rng(seed)
    names = [f"walk_{number}" for number in range(walks)]
    parts = [
        _walk(environment, name, device, scans, rng) for name, device in zip(names, [*OFFSETS_DB] * walks, strict=False)
    ]
    fingerprints = pl.concat([part[0] for part in parts])
    readings = pl.concat([part[1] for part in parts])
    tables = {
        FINGERPRINTS: fingerprints,
        READINGS: readings,
        ACCESS_POINTS: _access_points(environment),
        SESSIONS: empty_table(SESSIONS),
    }
    floor = building.floors[0]
    info = DatasetInfo(
        name="surveyed",
        floors=(FloorInfo(number=floor.number, width_m=floor.width_m, height_m=floor.height_m),),
        groupings=(Grouping(technology="wifi", by="scan"),),
    )
    return Surveyed(Dataset(info, {name: table.lazy() for name, table in tables.items()}), environment)


def _walk(
    environment: RadioEnvironment, session: str, device: str, scans: int, rng: np.random.Generator
) -> tuple[pl.DataFrame, pl.DataFrame]:
    floor = environment.building.floors[0]
    position = _stroll(floor, scans, rng)
    points = len(environment.building.ap_bssid)
    scan, point = (index.ravel() for index in np.indices((scans, points)))
    place = np.column_stack((position[scan], np.full(len(scan), 1.4)))
    mean = mean_rss_dbm(environment, floor.number, place, point, SENSITIVITY_DBM - 10)
    rssi = (mean + OFFSETS_DB[device] + rng.normal(0, FADING_DB, len(mean))).round()
    heard = np.flatnonzero((rssi >= SENSITIVITY_DBM) & (rng.random(len(mean)) > MISS))
    ids = np.array([scan_id(session, number) for number in range(scans)])
    fingerprints = pl.DataFrame(
        {
            "scan_id": ids,
            "technology": "wifi",
            "building": "",
            "floor": floor.number,
            "x": position[:, 0],
            "y": position[:, 1],
            "status": "ok",
            "device": device,
            "session": session,
        }
    )
    readings = pl.DataFrame(
        {
            "scan_id": ids[scan[heard]],
            "bssid": np.array(environment.building.ap_bssid)[point[heard]],
            "rssi_dbm": rssi[heard],
            "floor": floor.number,
            "x": place[heard, 0],
            "y": place[heard, 1],
        }
    )
    return in_schema(FINGERPRINTS, fingerprints), in_schema(READINGS, readings)


def _stroll(floor: SimulatedFloor, scans: int, rng: np.random.Generator) -> FloatArray:
    """Points every STEP_M on a random walk over the floor's graph that does not turn back where it need not."""
    node, before = int(rng.integers(len(floor.nodes))), -1
    path = [floor.nodes[node]]
    while sum(np.linalg.norm(np.diff(path, axis=0), axis=1)) < scans * STEP_M:
        ends = [int(end) for edge in floor.edges for end in edge if node in edge and end != node]
        onward = [end for end in ends if end != before] or ends
        node, before = int(rng.choice(onward)), node
        path.append(floor.nodes[node])
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))))
    at = STEP_M * np.arange(scans)
    return np.column_stack([np.interp(at, way, axis) for axis in np.array(path).T])


def _access_points(environment: RadioEnvironment) -> pl.DataFrame:
    building = environment.building
    return in_schema(
        ACCESS_POINTS,
        pl.DataFrame({"bssid": building.ap_bssid, "ssid": building.ap_ssid, "technology": "wifi"}),
    )
