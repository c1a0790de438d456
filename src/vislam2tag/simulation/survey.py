"""Simulating a whole survey into a folder: the raw files of every session, the site's files and the truth."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building.building import STATION_LANDMARKS, draw_plan
from vislam2tag.simulation.choices import Locale, SessionLayout, SiteColumn
from vislam2tag.simulation.model import SimulatedFloor, TrackerLog, TrueWalk
from vislam2tag.simulation.scenario import PlannedSession, Scenario
from vislam2tag.simulation.sensors.beacons import Beacons, make_beacons, simulate_ble
from vislam2tag.simulation.sensors.devices import make_device, simulate_presses
from vislam2tag.simulation.sensors.fixes import simulate_fixes
from vislam2tag.simulation.sensors.imu import ImuSettings, simulate_imu, with_pressure
from vislam2tag.simulation.sensors.radio import RadioEnvironment, RadioSettings, make_radio_environment, simulate_wifi
from vislam2tag.simulation.sensors.ranges import simulate_ranges
from vislam2tag.simulation.sensors.station import (
    StationSettings,
    StationSetup,
    place_station,
    shoot_points,
    simulate_station,
)
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.tracking.tracker import track
from vislam2tag.simulation.walking.floor_tour import floor_tour_from, seen_from_first
from vislam2tag.simulation.walking.walk import make_walk
from vislam2tag.simulation.writing.phone_log import phone_log, phone_text, session_name
from vislam2tag.simulation.writing.phone_script import phone_script
from vislam2tag.simulation.writing.session import SimulatedSession
from vislam2tag.simulation.writing.site_files import site_text
from vislam2tag.simulation.writing.traps import SITE_TRAPS, check_traps, left_out, trap_tables, trap_text
from vislam2tag.simulation.writing.writer import PAPER_NAMES, PUBLISHED_NAMES, session_text, station_table
from vislam2tag.site.model import SessionKey

STALE_SHARE = 0.04
"""Share of lost access points whose row is repeated at severity 1."""
STATION_FILE = "tachymeter/20220214_Tracking.csv"
SCRIPT_FILE = "script.txt"
PLAN_FILE = "floorplan.jpg"
BESIDE = ("truth", "station", "fixes")
"""Roles of files that no phone writes."""
TRACKED = ("poses", "landmarks")
PHONE_TRACKED = ("CameraPose.csv", "LandmarkPose.csv", "AnchorPose.csv")
"""What a phone without tracker does not write."""
STATION_DAY_NS = 1_644_796_800_000_000_000
"""2022-02-14 00:00, the date in that file's name."""


@dataclass(frozen=True)
class WritingOptions:
    """How a simulated survey is written, and what is wrong with it."""

    locale: Locale = Locale.MIXED
    paper_names: bool = False
    """CameraPose.csv, LandmarkPose.csv, Sensors.csv and WiFi.csv instead of the published names."""
    traps: frozenset[str] = frozenset()
    """Names of :data:`~vislam2tag.simulation.writing.traps.TRAP_FINDINGS`; each holds for the whole survey."""
    columns: frozenset[SiteColumn] = frozenset()
    """Optional columns of the site's files."""
    layout: SessionLayout = SessionLayout.PUBLISHED
    without_poses: bool = False
    """Whether the phones have no tracker: known positions are written in place of poses and landmarks."""
    scripts: bool = False
    """Whether ``script.txt`` beside each session in the phone app's format tells what the phone saw."""


def simulate(
    scenario: Scenario,
    out: AnyPath,
    options: WritingOptions | None = None,
    progress: Progress[SessionKey] = silent,
) -> None:
    """Write a survey of the scenario into ``out``, which must be new or empty.

    ``progress`` is called after each session with its key. The same scenario and options give the same bytes. Raises
    OutputError where ``out`` holds something or cannot be written, UsageError for an unknown trap, or one that the
    phone app's layout cannot hold.
    """
    out = Path(out)
    chosen = options or WritingOptions()
    check_traps(chosen.traps)
    if chosen.layout is SessionLayout.PHONE and not chosen.traps <= SITE_TRAPS.keys():
        raise UsageError("sessions in the phone app's format have no traps, only the site's files do")
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
            if chosen.layout is SessionLayout.PHONE:
                _write_phone_session(session, planned, scenario.seed, folder, chosen)
            else:
                _write_session(session, planned.key, folder, chosen)
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
    """Simulate one session; its random numbers depend on the scenario's seed and the session's key alone."""
    seed = scenario.seed
    floor = simulated_floor(scenario, planned.key.floor)
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
    """Set the station up in the corridor of its reference landmarks, where the floor has them."""
    return place_station(floor, _reference_points(floor), stream(seed, "station", floor.number))


def _reference_points(floor: SimulatedFloor) -> FloatArray:
    """BCS positions (2, 2) of the landmarks that the station shoots; the first and last where ids differ."""
    ids = floor.landmark_ids
    known = [ids.index(name) for name in STATION_LANDMARKS if name in ids]
    return floor.landmark_position[known if len(known) == 2 else [0, -1], :2]


def _check_empty(out: Path) -> None:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise OutputError(f"{out}: exists and is not an empty folder; name a new one or empty it")


def _write_site(scenario: Scenario, out: Folder, options: WritingOptions) -> None:
    """Write the files of the building, ``simulation.json`` and, where one is used, the station's own shots."""
    building = scenario.building
    presses = any(planned.presses for planned in scenario.sessions)
    files = site_text(building, presses, options.columns, scenario.place_seed)
    if scenario.site is not None:
        from vislam2tag.simulation.building.site_survey import copied_site_files

        files = copied_site_files(Path(scenario.site), building, files)
    files["simulation.json"] = _description(scenario, options)
    for number in sorted({planned.key.floor for planned in scenario.sessions if planned.total_station}):
        files[f"floor_{number}/{STATION_FILE}"] = _station_shots(simulated_floor(scenario, number), scenario.seed)
    _write_files(out, {path: text for path, text in files.items() if not left_out(path, options.traps)})
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
    """What was simulated, for the reader of the folder; nothing reads it back."""
    chosen = scenario.settings and scenario.settings.model_dump(mode="json", exclude_defaults=True)
    content = {
        "version": __version__,
        "seed": scenario.seed,
        "severity": scenario.severity,
        "locale": options.locale,
        "names": "paper" if options.paper_names else "published",
        **({"layout": options.layout} if options.layout is not SessionLayout.PUBLISHED else {}),
        "traps": sorted(options.traps),
        **({"columns": sorted(options.columns)} if options.columns else {}),
        **({"pressure": True} if scenario.pressure else {}),
        **({"ble": True} if scenario.ble else {}),
        **({"rtt": True} if scenario.rtt else {}),
        **({"without_poses": True} if options.without_poses else {}),
        **({"site": Path(scenario.site).name} if scenario.site else {}),
        **({"building": chosen} if chosen else {}),
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
"""The published names of sessions hold colons, which file names on Windows cannot."""


def _write_session(session: SimulatedSession, key: SessionKey, out: Folder, options: WritingOptions) -> None:
    names = PAPER_NAMES if options.paper_names else PUBLISHED_NAMES
    text = trap_text(session_text(trap_tables(session, options.traps)), options.traps)
    name = session_name(key) if NO_COLONS else key.session
    folder = out.folder(f"floor_{key.floor}/{key.device}/{name}")
    _write_files(folder, {names[role]: content for role, content in text.items() if _written(session, role)})


def _written(session: SimulatedSession, role: str) -> bool:
    """Whether a role's file is written: a phone without tracker has no poses."""
    return session.fixes is None or role not in TRACKED


def _write_phone_session(
    session: SimulatedSession, planned: PlannedSession, seed: int, out: Folder, options: WritingOptions
) -> None:
    key = planned.key
    log = phone_log(session, key, seed)
    files = phone_text(log, key, planned.boot_unix_ns)
    beside = {PUBLISHED_NAMES[role]: text for role, text in session_text(session).items() if role in BESIDE}
    if options.scripts:
        beside[SCRIPT_FILE] = phone_script(log, key, planned.boot_unix_ns)
    if session.fixes is not None:
        files = {name: text for name, text in files.items() if name not in PHONE_TRACKED}
    _write_files(out.folder(f"floor_{key.floor}/{key.device}/{session_name(key)}"), files | beside)


def _write_files(folder: Folder, files: dict[str, bytes]) -> None:
    for name, content in files.items():
        folder.write(name, content)


def simulated_floor(scenario: Scenario, number: int) -> SimulatedFloor:
    """Return the floor with this number; raises KeyError where the building has none."""
    for floor in scenario.building.floors:
        if floor.number == number:
            return floor
    raise KeyError(number)


def walk_and_track(scenario: Scenario, planned: PlannedSession) -> tuple[TrueWalk, TrackerLog]:
    """Simulate one session's walk and tracker, from random numbers of its own."""
    number = planned.key.floor
    tour = None if planned.climb is None else floor_tour_from(scenario.building, number, planned.climb)
    floor = simulated_floor(scenario, number) if tour is None else seen_from_first(tour)
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
