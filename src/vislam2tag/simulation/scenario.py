"""Plans of simulated surveys: the building, and the floor, device, walk and faults of each session."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from itertools import product
from typing import TypedDict, Unpack

import numpy as np

from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.notebook import Summarised
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import SimulatedBuilding
from vislam2tag.simulation.settings import (
    BuildingSettings,
    Climb,
    SiteBuildingSettings,
    TrackerSettings,
    WalkSettings,
    WalkStyle,
    severity_level,
    stream,
    walk_settings,
)
from vislam2tag.site.model import SessionKey

GOLDEN = (5**0.5 - 1) / 2
"""Successive multiples modulo 1 are spread evenly, whatever their number."""
FIRST_DAY = datetime(2021, 12, 20, tzinfo=UTC)
"""No simulated session starts before this day; devices were started before it."""
WALKING_DAY = date(2021, 12, 20)
"""Default day of the walks; each further floor has the next day."""
SITE_SEED = 0
_MOST_DAYS = 3000
POSE_LAGS_S = {"LG": 0.055, "OnePlus": 0.035, "Galaxy": 0.045, "S20": 0.03}

STATION_BREAK_M = (13.0, 15.0)
"""Camera jumps in short walks along one corridor."""
FIRST_STARTS = {
    (1, "LG_ref"): "2022-01-19T16:06:28",
    (1, "OnePlus_ref"): "2022-01-19T15:51:00",
    (4, "LG_ref"): "2022-01-14T14:12:09",
    (4, "OnePlus_ref"): "2022-01-14T14:20:31",
    (4, "LG_tachy"): "2022-01-14T16:08:47",
    (4, "OnePlus_tachy"): "2022-01-14T16:01:04",
}

ILLUSTRATIONS = (
    (SessionKey(4, "Subtrajectory_split", "2022-01-14T16:35:30"), 180.0, 0.2),
    (SessionKey(4, "Galaxy", "2021-12-20T14:17:21"), 150.0, 0.3),
)
"""Additional walks without presses for figures of the paper: key, duration in seconds, rank among the faults."""


@dataclass(frozen=True)
class PlannedSession:
    """One session to simulate."""

    key: SessionKey
    start_ns: int
    """Boot-clock time at which the walk starts."""
    boot_unix_ns: int
    """Time of the device's start: boot clock plus this is the wall clock in the session's folder name."""
    duration_s: float
    walk: WalkSettings
    tracker: TrackerSettings
    fault_quantile: float
    """Rank of this session among all, from 0 (best tracked) to 1 (worst)."""
    presses: bool
    """Whether the walker presses at control points."""
    total_station: bool
    """Whether a total station tracks the phone."""
    climb: Climb | None = None
    """How the walk changes floors; None if it stays on its own."""


@dataclass(frozen=True, repr=False)
class Scenario(Summarised):
    """A survey to simulate."""

    seed: int
    severity: float
    building: SimulatedBuilding
    sessions: tuple[PlannedSession, ...]
    pressure: bool = False
    """Whether the phones log air pressure."""
    ble: bool = False
    """Whether there are BLE beacons, and the phones log them."""
    rtt: bool = False
    """Whether the phones log ranges to access points, if their format supports this."""
    site: AnyPath | None = None
    """Folder of the site that provides plans and ``site.toml``; None for a generated building."""
    settings: BuildingSettings | SiteBuildingSettings | None = None
    """Settings that the building was made with, if users chose them."""
    site_seed: int | None = None
    """Seed of access points, beacons and survey errors; None: ``seed``, as for walks."""

    def _facts(self) -> dict[str, object]:
        floors = ", ".join(str(number) for number in sorted({one.key.floor for one in self.sessions}))
        return {"seed": self.seed, "severity": self.severity, "sessions": len(self.sessions), "floors": floors}

    @property
    def place_seed(self) -> int:
        """Seed of everything that stays the same in the building for other walks."""
        return self.seed if self.site_seed is None else self.site_seed


class FurtherChoices(TypedDict, total=False):
    """More options of a regular survey."""

    walk: WalkSettings | None
    climb: Climb | None
    """How walks change floors; no landmark id is then used on two floors."""
    pressure: bool
    ble: bool
    rtt: bool
    day: date
    """Day of the walks. Walks on other days use the same building."""


def regular_survey(
    seed: int,
    severity: str | float = "default",
    floors: tuple[int, ...] = (0, 1),
    devices: tuple[str, ...] = ("LG", "OnePlus"),
    sessions: int = 2,
    duration_s: float = 180.0,
    building: BuildingSettings | None = None,
    **more: Unpack[FurtherChoices],
) -> Scenario:
    """Plan ``sessions`` walks of ``duration_s`` on each floor with each device.

    With ``climb`` each walk starts on its floor and continues on others; additional floors change such walks. Otherwise
    additional floors, devices or sessions do not change the others.

    Raises ValueError if the severity is below zero, or if there is no other floor to climb to, and TypeError for an
    unknown keyword.
    """
    if unknown := more.keys() - FurtherChoices.__annotations__.keys():  # Unpack is for type checkers only
        raise TypeError(f"regular_survey() got unexpected keyword arguments: {', '.join(sorted(unknown))}")
    level, climb = severity_level(severity), more.get("climb")
    if climb is not None and len(floors) < 2:
        raise ValueError("walks that change floors need at least two floors")
    walk, day = more.get("walk"), more.get("day", WALKING_DAY)
    walks = _planned_walks(floors, devices, sessions, seed, level, duration_s, day, walk)
    planned = tuple(replace(session, climb=climb) for session in walks)
    made = make_building(building or BuildingSettings(), seed, floors, distinct_ids=climb is not None)
    pressure, ble, rtt = more.get("pressure", False), more.get("ble", False), more.get("rtt", False)
    return Scenario(seed, level, made, planned, pressure, ble, rtt, settings=building)


def site_survey(
    building: SimulatedBuilding,
    site: AnyPath,
    seed: int,
    severity: str | float = "default",
    devices: tuple[str, ...] = ("LG", "OnePlus"),
    sessions: int = 2,
    duration_s: float = 180.0,
    day: date | None = None,
) -> Scenario:
    """Plan walks as :func:`regular_survey` does, on all floors of a building made from the site in this folder.

    Access points belong to the building and do not depend on the walks. ``seed`` is the seed of the walks; walks on
    different days (``day``) differ.
    """
    level = severity_level(severity)
    day = day or WALKING_DAY + timedelta(days=seed % _MOST_DAYS)
    floors = tuple(one.number for one in building.floors)
    planned = _planned_walks(floors, devices, sessions, seed, level, duration_s, day)
    return Scenario(seed, level, building, tuple(planned), site=site, site_seed=SITE_SEED)


def _planned_walks(
    floors: tuple[int, ...],
    devices: tuple[str, ...],
    sessions: int,
    seed: int,
    level: float,
    duration_s: float,
    day: date,
    walk: WalkSettings | None = None,
) -> list[PlannedSession]:
    """Walks of a survey over every floor with every device."""
    planned = []
    for floor, device in product(floors, devices):
        offset = float(stream(seed, "faults", floor, device).uniform())
        for number in range(sessions):
            later = timedelta(minutes=47 * number + 7 * len(device), days=floor % 25)
            key = SessionKey(floor, device, (datetime.combine(day, time(9)) + later).isoformat())
            planned.append(_planned(seed, level, key, (offset + number * GOLDEN) % 1.0, duration_s, walk=walk))
    return planned


def paper_evaluation(seed: int, severity: str | float = "default") -> Scenario:
    """Plan a copy of the paper's evaluation: 24 walks over control points, 10 in view of a total station.

    Walks are on floors 1 and 4 with LG_ref and OnePlus_ref, with a median duration of three minutes and one walk of
    fifteen minutes, and on floor 4 with LG_tachy and OnePlus_tachy (paper, section VI). Faults are spread evenly over
    the walks' ranks, and longer walks are tracked worse. Two well-tracked walks without known truth are included for
    the paper's figures.

    Raises ValueError if the severity is below zero.
    """
    level = severity_level(severity)
    rng = stream(seed, "paper")
    planned = []
    ranks = _strata(24, rng)
    # The published walk of fifteen minutes was tracked well.
    typical = int(np.argmin(np.abs(ranks - 0.4)))
    ranks[[0, typical]] = ranks[[typical, 0]]
    for key, rank in zip(_paper_keys((1, 4), ("LG_ref", "OnePlus_ref"), 6), ranks.tolist(), strict=True):
        long_walk = key.session == FIRST_STARTS[1, "LG_ref"]
        duration_s = 900.0 if long_walk else round(150 + 60 * rank + float(rng.uniform(-25, 25)))
        planned.append(_planned(seed, level, key, rank, duration_s, WalkStyle.CONTROL_POINTS))
    ranks = _strata(10, rng)
    for key, rank in zip(_paper_keys((4,), ("LG_tachy", "OnePlus_tachy"), 5), ranks.tolist(), strict=True):
        duration_s = round(60 + 50 * rank + float(rng.uniform(0, 10)))
        planned.append(_planned(seed, level, key, rank, duration_s, WalkStyle.TOTAL_STATION))
    calm = walk_settings(WalkStyle.SURVEY)
    planned += [_planned(seed, level, key, rank, duration_s, walk=calm) for key, duration_s, rank in ILLUSTRATIONS]
    building = BuildingSettings(landmarks=14, control_point_spacing_m=11.0)
    return Scenario(seed, level, make_building(building, seed, (1, 4)), tuple(planned))


def _paper_keys(floors: tuple[int, ...], devices: tuple[str, ...], sessions: int) -> list[SessionKey]:
    """Session folders named as in the published evaluation, each 17 minutes after the one before."""
    starts = [(floor, device, FIRST_STARTS[floor, device]) for floor in floors for device in devices]
    return [
        SessionKey(floor, device, (datetime.fromisoformat(first) + timedelta(minutes=17 * n)).isoformat())
        for floor, device, first in starts
        for n in range(sessions)
    ]


def _strata(count: int, rng: np.random.Generator) -> FloatArray:
    """Quantiles (count,), one near the middle of each of ``count`` equal parts of 0..1, in random order."""
    return np.asarray((rng.permutation(count) + rng.uniform(0.4, 0.6, count)) / count)


def _provoked(style: WalkStyle, badness: float) -> WalkSettings:
    """Choose causes for the faults: worse sessions contain more people and running."""
    if style is WalkStyle.TOTAL_STATION:
        return walk_settings(style, runs=int(badness > 0.7))
    return walk_settings(style, runs=1 if badness > 0.8 else 0, people=1 if badness > 0.5 else 0)


def _planned(
    seed: int,
    level: float,
    key: SessionKey,
    rank: float,
    duration_s: float,
    style: WalkStyle = WalkStyle.SURVEY,
    walk: WalkSettings | None = None,
) -> PlannedSession:
    """Plan a session of this rank, from 0 (best tracked) to 1, walked in a style or by ``walk``."""
    up_hours = stream(seed, "boot", key.device).uniform(2.0, 200.0)
    start = datetime.fromisoformat(key.session).replace(tzinfo=UTC)
    first = FIRST_DAY if start < FIRST_DAY + timedelta(days=60) else start.replace(hour=0, minute=0, second=0)
    boot = first - timedelta(hours=float(up_hours))
    tracker = TrackerSettings(severity=level, pose_lag_s=POSE_LAGS_S.get(key.device.split("_")[0], 0.045))
    if style is WalkStyle.TOTAL_STATION:
        tracker = tracker.model_copy(update={"break_m": STATION_BREAK_M, "reexpression_m": (0.0, 0.0)})
    return PlannedSession(
        key=key,
        start_ns=(start - boot) // timedelta(microseconds=1) * 1000,
        boot_unix_ns=(boot - datetime.fromtimestamp(0, UTC)) // timedelta(microseconds=1) * 1000,
        duration_s=duration_s,
        walk=walk or _provoked(style, rank * min(level, 1.0)),
        tracker=tracker,
        fault_quantile=rank,
        presses=style is WalkStyle.CONTROL_POINTS,
        total_station=style is WalkStyle.TOTAL_STATION,
    )
