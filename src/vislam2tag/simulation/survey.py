"""Write a simulated survey into a folder: the raw files of every session, the site's files and the truth."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building import STATION_LANDMARKS, draw_plan
from vislam2tag.simulation.imu import ImuSettings, simulate_imu, with_pressure
from vislam2tag.simulation.model import SimulatedFloor, TrackerLog, TrueWalk, floor_tour_from, seen_from_first
from vislam2tag.simulation.phone_log import phone_log, phone_script, phone_text, session_name
from vislam2tag.simulation.phones import SimulatedSession, make_device, simulate_fixes, simulate_presses
from vislam2tag.simulation.radio import (
    Beacons,
    RadioEnvironment,
    RadioSettings,
    make_beacons,
    make_radio_environment,
    simulate_ble,
    simulate_ranges,
    simulate_wifi,
)
from vislam2tag.simulation.raw_files import PAPER_NAMES, PUBLISHED_NAMES, session_text, site_text, station_table
from vislam2tag.simulation.scenario import PlannedSession, Scenario
from vislam2tag.simulation.settings import Locale, SessionLayout, SiteColumn, stream
from vislam2tag.simulation.station import (
    StationSettings,
    StationSetup,
    place_station,
    shoot_points,
    simulate_station,
)
from vislam2tag.simulation.tracker import track
from vislam2tag.simulation.traps import SITE_TRAPS, check_traps, left_out, trap_tables, trap_text
from vislam2tag.simulation.walk import make_walk
from vislam2tag.site.model import SessionKey

STALE_SHARE = 0.04
"""Share of access points that are no longer heard and whose row is repeated at severity 1."""
STATION_FILE = "tachymeter/20220214_Tracking.csv"
SCRIPT_FILE = "script.txt"
PLAN_FILE = "floorplan.jpg"
BESIDE = ("truth", "station", "fixes")
"""Roles of files that no phone writes."""
TRACKED = ("poses.csv", "initPoses.csv", "CameraPose.csv", "LandmarkPose.csv", "AnchorPose.csv")
"""Files that a phone without tracker does not write."""
STATION_DAY_NS = 1_644_796_800_000_000_000
"""2022-02-14 00:00, the date in that file's name."""


@dataclass(frozen=True)
class WritingOptions:
    """Options for writing a simulated survey."""

    locale: Locale = Locale.MIXED
    paper_names: bool = False
    """Name files CameraPose.csv, LandmarkPose.csv, Sensors.csv and WiFi.csv instead of the published names."""
    traps: frozenset[str] = frozenset()
    """Names of :data:`~vislam2tag.simulation.traps.TRAP_FINDINGS`; each trap applies to the whole survey."""
    columns: frozenset[SiteColumn] = frozenset()
    """Optional columns of the site's files."""
    layout: SessionLayout = SessionLayout.PUBLISHED
    without_poses: bool = False
    """Whether the phones have no tracker: files contain known positions instead of poses and landmarks."""
    scripts: bool = False
    """Whether each session in the phone app's format has a ``script.txt`` with the phone's input."""


def simulate(
    scenario: Scenario,
    out: AnyPath,
    options: WritingOptions | None = None,
    progress: Progress[SessionKey] = silent,
) -> None:
    """Write a survey of the scenario into ``out``, which must be new or empty.

    ``progress`` is called after each session with its key. The same scenario and options give the same bytes.

    Raises OutputError if ``out`` is not empty or cannot be written, and UsageError for an unknown trap, or a trap that
    is impossible in the phone app's layout.
    """
    out = Path(out)
    chosen = options or WritingOptions()
    check_traps(chosen.traps)
    if chosen.layout is SessionLayout.PHONE and not chosen.traps <= SITE_TRAPS.keys():
        raise UsageError(f"--trap: with --format phone, only these traps are possible: {', '.join(SITE_TRAPS)}")
    try:
        _check_empty(out)
        folder = Folder.at(out)
        _write_site(scenario, folder, chosen)
        radio = RadioSettings(stale_share=STALE_SHARE * scenario.severity)
        environment = make_radio_environment(scenario.building, radio, scenario.place_seed)
        beacons = make_beacons(scenario.building, scenario.place_seed) if scenario.ble else None
        for planned in scenario.sessions:
            session = simulate_session(scenario, planned, environment, chosen.locale, beacons)
            if chosen.without_poses:
                session = replace(
                    session, fixes=simulate_fixes(session.walk, stream(scenario.seed, "fixes", planned.key))
                )
            for path, content in _session_files(session, planned, scenario.seed, chosen).items():
                folder.write(path, content)
            progress(planned.key, len(scenario.sessions))
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {error}") from error


def simulate_session(
    scenario: Scenario,
    planned: PlannedSession,
    environment: RadioEnvironment,
    locale: Locale = Locale.MIXED,
    beacons: Beacons | None = None,
) -> SimulatedSession:
    """Simulate one session. Its random numbers depend only on the scenario's seed and the session's key."""
    seed = scenario.seed
    floor = scenario.building.floor(planned.key.floor)
    device = make_device(planned.key.device, locale, seed)
    walk, tracker = walk_and_track(scenario, planned)
    rng = stream(seed, "sensors", planned.key)
    presses_ns = simulate_presses(walk, device.hand, rng) if planned.presses else np.empty(0, dtype=np.int64)
    wifi = simulate_wifi(environment, walk, device.receiver, rng)
    imu = simulate_imu(walk, ImuSettings(), seed, rng)
    if scenario.pressure:
        imu = with_pressure(imu, walk, floor.elevation_m, stream(seed, "pressure", planned.key))
    session = SimulatedSession(
        building=scenario.building,
        floor=floor,
        walk=walk,
        tracker=tracker,
        wifi=wifi,
        imu=imu,
        presses_ns=presses_ns,
        marks=device.marks,
        ble=None if beacons is None else simulate_ble(beacons, walk, device.receiver, stream(seed, "ble", planned.key)),
        ranges=simulate_ranges(environment, walk, wifi, stream(seed, "rtt", planned.key)) if scenario.rtt else None,
    )
    if not planned.total_station:
        return session
    station = simulate_station(walk, floor, _station(floor, seed), StationSettings(), rng)
    return replace(session, station=station, station_offset_ns=planned.boot_unix_ns + device.station_clock_ns)


def _station(floor: SimulatedFloor, seed: int) -> StationSetup:
    """Set the station up in the corridor of its reference landmarks, if the floor has them."""
    return place_station(floor, _reference_points(floor), stream(seed, "station", floor.number))


def _reference_points(floor: SimulatedFloor) -> FloatArray:
    """BCS positions (2, 2) of the landmarks that the station shoots; the first and last if ids differ."""
    ids = floor.landmark_ids
    known = [ids.index(name) for name in STATION_LANDMARKS if name in ids]
    return floor.landmark_position[known if len(known) == 2 else [0, -1], :2]


def _check_empty(out: Path) -> None:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise OutputError(f"{out}: this already exists and is not an empty folder; choose a new folder or empty it")


def _write_site(scenario: Scenario, out: Folder, options: WritingOptions) -> None:
    """Write the files of the building, ``simulation.json`` and, if a station is used, its own shots."""
    building = scenario.building
    presses = any(planned.presses for planned in scenario.sessions)
    files = site_text(building, presses, options.columns, scenario.place_seed)
    if scenario.site is not None:
        from vislam2tag.simulation.site_building import copied_site_files

        files = copied_site_files(Path(scenario.site), building, files)
    files["simulation.json"] = _description(scenario, options)
    for number in sorted({planned.key.floor for planned in scenario.sessions if planned.total_station}):
        files[f"floor_{number}/{STATION_FILE}"] = _station_shots(scenario.building.floor(number), scenario.seed)
    for path, content in files.items():
        if not left_out(path, options.traps):
            out.write(path, content)
    for floor in building.floors:
        own = out.folder(f"floor_{floor.number}").make()
        if scenario.site is None and not left_out(PLAN_FILE, options.traps):
            draw_plan(floor, own, PLAN_FILE)


def _station_shots(floor: SimulatedFloor, seed: int) -> bytes:
    """The station itself in the first row, then its shots of the reference landmarks, a minute apart."""
    setup = _station(floor, seed)
    points = np.vstack((setup.position_bcs, _reference_points(floor)))
    shots = shoot_points(setup, points, StationSettings(), stream(seed, "station shots", floor.number))
    return station_table(STATION_DAY_NS + np.arange(len(points)) * 60_000_000_000, shots)


def _description(scenario: Scenario, options: WritingOptions) -> bytes:
    """Description of the simulation for the reader of the folder; no program reads it."""
    building = scenario.settings and scenario.settings.model_dump(mode="json", exclude_defaults=True)
    chosen = {
        "columns": sorted(options.columns),
        "pressure": scenario.pressure,
        "ble": scenario.ble,
        "rtt": scenario.rtt,
        "without_poses": options.without_poses,
        "site": scenario.site and Path(scenario.site).name,
        "building": building,
    }
    content = {
        "version": __version__,
        "seed": scenario.seed,
        "severity": scenario.severity,
        "locale": options.locale,
        "names": "paper" if options.paper_names else "published",
        **({} if options.layout is SessionLayout.PUBLISHED else {"layout": options.layout}),
        "traps": sorted(options.traps),
        **{name: value for name, value in chosen.items() if value},
        "sessions": [asdict(planned.key) | _resolved(planned) for planned in scenario.sessions],
    }
    return (json.dumps(content, indent=2) + "\n").encode()


def _resolved(planned: PlannedSession) -> dict[str, object]:
    return {
        "duration_s": planned.duration_s,
        "fault_quantile": planned.fault_quantile,
        "walk": planned.walk.model_dump(mode="json"),
        "tracker": planned.tracker.model_dump(mode="json"),
    } | ({} if planned.climb is None else {"climb": planned.climb.value})


NO_COLONS = os.name == "nt"
"""The published names of sessions contain colons, which are impossible in file names on Windows."""


def _session_files(
    session: SimulatedSession, planned: PlannedSession, seed: int, options: WritingOptions
) -> dict[str, bytes]:
    """Content of each file of a session by its path in the survey; a phone without tracker has no poses."""
    key = planned.key
    if options.layout is SessionLayout.PHONE:
        name, log = session_name(key), phone_log(session, key, seed)
        files = phone_text(log, key, planned.boot_unix_ns)
        files |= {PUBLISHED_NAMES[role]: text for role, text in session_text(session).items() if role in BESIDE}
        if options.scripts:
            files[SCRIPT_FILE] = phone_script(log, key, planned.boot_unix_ns)
    else:
        name, names = (
            session_name(key) if NO_COLONS else key.session,
            PAPER_NAMES if options.paper_names else PUBLISHED_NAMES,
        )
        roles = trap_text(session_text(trap_tables(session, options.traps)), options.traps)
        files = {names[role]: text for role, text in roles.items()}
    folder = f"floor_{key.floor}/{key.device}/{name}"
    untracked = session.fixes is not None
    return {f"{folder}/{file}": text for file, text in files.items() if not (untracked and file in TRACKED)}


def walk_and_track(scenario: Scenario, planned: PlannedSession) -> tuple[TrueWalk, TrackerLog]:
    """Simulate one session's walk and tracker, from random numbers of its own."""
    number = planned.key.floor
    tour = None if planned.climb is None else floor_tour_from(scenario.building, number, planned.climb)
    floor = scenario.building.floor(number) if tour is None else seen_from_first(tour)
    walk = make_walk(
        floor,
        planned.duration_s,
        planned.walk,
        stream(scenario.seed, "walk", planned.key),
        planned.start_ns,
        tour,
    )
    log = track(walk, floor, planned.tracker, stream(scenario.seed, "tracker", planned.key), planned.fault_quantile)
    return walk, log
