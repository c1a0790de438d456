"""How often diagnosis names the faults of a survey, and how often it names a fault that is not there.

Usage: python benchmarks/diagnosis.py --surveys 200 [--first-seed 30000] [--jobs 2]
       python benchmarks/diagnosis.py --real

Generated surveys have one or two floors, with four or six walks of two and a half minutes on each, at any severity of
the tracker's faults. Each survey is diagnosed unchanged, and again with one, two or three faults. A fault concerns a
landmark that was passed at least three times, by walks that passed three others of the floor. It is named correctly if
kind, landmarks (in their order) and sessions are right. Seeds below 30000, and from 51000 to 51199, were used in
development; the figures in docs/results/how-good.md are from other seeds.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from itertools import combinations

import numpy as np
import polars as pl
from data_sets import SHARED
from PIL import Image

from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.findings import FaultKind
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.settings import SmootherSettings
from vislam2tag.pipeline.labels.diagnose import PATH_STEP
from vislam2tag.pipeline.labels.wifi_clocks import wifi_clocks
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.evidence import Evidence, Mark, PlacedWalk, Table
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.search import found_faults
from vislam2tag.quality.diagnosis.stream_faults import StreamSigns, sensor_clock_offset_s, stream_faults
from vislam2tag.quality.diagnosis.turned_tables import Inside, with_turns_by_plan
from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk
from vislam2tag.sessions.readings import repeated_scans
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.building import draw_plan
from vislam2tag.simulation.imu import INERTIAL_TYPES, ImuSettings, simulate_imu
from vislam2tag.simulation.model import SimulatedFloor
from vislam2tag.simulation.phones import make_device
from vislam2tag.simulation.radio import RadioEnvironment, RadioSettings, make_radio_environment, simulate_wifi
from vislam2tag.simulation.scenario import PlannedSession, Scenario, regular_survey
from vislam2tag.simulation.settings import BuildingSettings, Locale, stream
from vislam2tag.simulation.survey import STALE_SHARE, walk_and_track
from vislam2tag.site.corrections.file import UNITS_M, session_start
from vislam2tag.site.model import SessionKey
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.space import walkable_space

FEWEST_PASSES, FEWEST_OTHERS = 3, 3
SQUARE = 0.2
LEAST_CLOCK_S, GREATEST_CLOCK_S = 1.0, 20.0
REPEATED_SHARE = 0.3
GYRO_HZ = 50.0
LEAST_M, GREATEST_M = 1.0, 12.0
DURATION_S = 150.0
SEVERITIES = ("none", "mild", "default", "default", "severe")


@dataclass(frozen=True)
class Streams:
    """What a phone logged besides landmarks: poses, the gyroscope, scans."""

    camera: CameraTrack
    sensors: pl.DataFrame
    wifi: pl.DataFrame
    way_s: FloatArray
    way: ComplexArray

    def signs(self, key: SessionKey) -> StreamSigns:
        """As in the tables of a session."""
        start = session_start(key.session)
        assert start is not None
        since_boot_s = float(self.camera.time_ns[0]) * 1e-9
        scans, repeated = self.wifi["scan"].n_unique(), len(repeated_scans(self.wifi))
        offset_s = sensor_clock_offset_s(self.camera, self.sensors)
        return StreamSigns((start - datetime(1970, 1, 1)).total_seconds() - since_boot_s, scans, repeated, offset_s)

    def heard(self) -> HeardOnWalk:
        """The scans on the tracker's way."""
        columns = (self.wifi[name].to_numpy() for name in ("scan", "bssid", "rssi_dbm"))
        scan, bssid, dbm = columns
        return HeardOnWalk(
            self.wifi["time_ns"].to_numpy() * 1e-9, scan, bssid.astype(str), dbm.astype(float), self.way_s, self.way
        )

    def shifted(self, tables: tuple[str, ...], offset_s: float) -> Streams:
        """The same with these tables on a clock that is behind by this."""
        by = pl.col("time_ns") - round(offset_s * 1e9)
        return replace(self, **{name: getattr(self, name).with_columns(time_ns=by) for name in tables})


@dataclass
class MadeSurvey:
    """Walks reduced to passes, the table, the extents; and what was put in: kind, landmarks, session."""

    walks: list[WalkPasses]
    place: dict[Mark, complex]
    size_m: dict[int, tuple[float, float]]
    streams: list[Streams] = field(default_factory=list)
    """Of each walk, in their order."""
    inside: dict[int, Inside] = field(default_factory=dict)
    faults: list[tuple[FaultKind, tuple[str, ...], str]] = field(default_factory=list)
    touched: set[Mark] = field(default_factory=set)
    last: list[Callable[[], None]] = field(default_factory=list)
    """What is done to whole tables, when everything else has been."""

    def rows(self, mark: Mark) -> list[tuple[int, int]]:
        """Walk and row of each pass of a landmark, in the order of time."""
        return [
            (number, row)
            for number, walk in enumerate(self.walks)
            for row, name in enumerate(walk.landmark)
            if walk.key.floor == mark.floor and name == mark.landmark
        ]

    def counted(self, rows: list[tuple[int, int]]) -> int:
        """How many of these passes are of walks that passed enough other landmarks to judge them."""
        others = [{name for name in walk.landmark if Mark(walk.key.floor, name) in self.place} for walk in self.walks]
        return sum(len(others[number]) > FEWEST_OTHERS for number, _ in rows)

    def untouched(self) -> list[Mark]:
        """Landmarks that were passed often enough and that no fault concerns yet."""
        often = [mark for mark in sorted(self.place) if self.counted(self.rows(mark)) >= FEWEST_PASSES]
        return [mark for mark in often if mark not in self.touched]

    def rename(self, rows: list[tuple[int, int]], name: str) -> None:
        """Let passes be of another landmark."""
        for number, row in rows:
            names = list(self.walks[number].landmark)
            names[row] = name
            self.walks[number] = replace(self.walks[number], landmark=tuple(names))


def main() -> None:
    """Diagnose all surveys and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surveys", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=30000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--show", action="store_true", help="Print every survey that went wrong.")
    parser.add_argument("--real", action="store_true", help="Every swap of two landmarks in the real walks instead.")
    options = parser.parse_args()
    if options.real:
        _print_real_swaps()
        return
    seeds = range(options.first_seed, options.first_seed + options.surveys)
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for outcome in pool.map(outcome_of, seeds):
            outcomes.append(outcome)
            if len(outcomes) % 20 == 0:
                print(f"\nafter {len(outcomes)} surveys", flush=True)
                _print(outcomes, show=False)
    _print(outcomes, show=options.show)


def _print_real_swaps() -> None:
    """Exchange every two landmarks that a real walk passed in its table, and see what is named."""
    survey = open_survey(SHARED / "real-walks")
    print("| walk | landmarks passed (passes) | swaps | named rightly | named otherwise | nothing named |")
    print("| --- | --- | --- | --- | --- | --- |")
    for ref in survey.sessions:
        session = read_session(ref)
        observations = WalkObservations.of(session.camera, session.landmarks, SmootherSettings().sighting_range_m)
        walk = WalkPasses.of(ref.key, observations)
        known = survey.site.landmarks.on_floor(ref.key.floor)
        place = {
            Mark(ref.key.floor, name): complex(*at) for name, at in zip(known.ids, known.position_bcs, strict=True)
        }
        count = Counter(name for name in walk.landmark if Mark(ref.key.floor, name) in place)
        told = defaultdict(list)
        for one, other in combinations(sorted(count), 2):
            made = MadeSurvey([walk], dict(place), {})
            marks = Mark(ref.key.floor, one), Mark(ref.key.floor, other)
            made.place[marks[0]], made.place[marks[1]] = made.place[marks[1]], made.place[marks[0]]
            named = [_named(fault)[:2] for fault in _diagnosed(made)]
            right = named == [(FaultKind.SWAPPED, (one, other))]
            told["right" if right else "otherwise" if named else "nothing"].append(f"{one}-{other}")
        cells = [f"{len(told[what])}: {', '.join(told[what])}" for what in ("right", "otherwise", "nothing")]
        passed = ", ".join(f"{name} ({times})" for name, times in sorted(count.items()))
        print(f"| {ref.key.session} | {passed} | {sum(map(len, told.values()))} | {' | '.join(cells)} |")


@dataclass(frozen=True)
class Outcome:
    """Of one survey: what was named of it as it is, what was put in, and what was named then."""

    seed: int
    alarms: list[str]
    put_in: list[tuple[FaultKind, tuple[str, ...], str]]
    named: list[tuple[FaultKind, tuple[str, ...], str]]
    sentences: list[str]


def outcome_of(seed: int) -> Outcome:
    """Make a survey, diagnose it as it is and with faults."""
    made = _simulated(seed)
    alarms = [fault.summary for fault in _diagnosed(made)]
    rng = np.random.default_rng([seed, 1])
    for _ in range(int(rng.integers(1, 4))):
        _put_in(made, rng)
    for change in made.last:
        change()
    faults = _diagnosed(made)
    return Outcome(seed, alarms, made.faults, [_named(fault) for fault in faults], [fault.summary for fault in faults])


def _named(fault: Fault) -> tuple[FaultKind, tuple[str, ...], str]:
    ids = fault.landmarks or [entry.values["table"] for entry in fault.corrections if entry.table == "shift_clock"]
    first = ids.index(min(ids)) if ids else 0
    place = fault.sessions[0] if fault.sessions else f"floor {fault.floor}"
    return fault.kind, (*ids[first:], *ids[:first]), place


def _simulated(seed: int) -> MadeSurvey:
    rng = np.random.default_rng([seed, 0])
    floors = (0, 1) if rng.random() < 0.4 else (0,)
    width_m, height_m = float(rng.uniform(40, 70)), float(rng.uniform(26, 40))
    height_m = width_m if rng.random() < SQUARE else height_m
    building = BuildingSettings(width_m=width_m, height_m=height_m, landmarks=int(rng.integers(9, 16)))
    severity = str(rng.choice(SEVERITIES))
    sessions = int(rng.integers(2, 4))
    scenario = regular_survey(seed, severity, floors, ("LG", "OnePlus"), sessions, DURATION_S, building=building)
    environment = make_radio_environment(
        scenario.building, RadioSettings(stale_share=STALE_SHARE * scenario.severity), scenario.place_seed
    )
    logged = [_logged(scenario, planned, environment) for planned in scenario.sessions]
    logged.sort(key=lambda one: one[0].key)
    made = scenario.building.floors
    place = {
        Mark(floor.number, name): complex(*(at + rng.normal(0, 0.02, 2)))
        for floor in made
        for name, at in zip(floor.landmark_ids, floor.landmark_position[:, :2], strict=True)
    }
    size_m = {floor.number: (floor.width_m, floor.height_m) for floor in made}
    inside = {floor.number: _inside(floor) for floor in made}
    return MadeSurvey([walk for walk, _ in logged], place, size_m, [streams for _, streams in logged], inside)


def _logged(scenario: Scenario, planned: PlannedSession, environment: RadioEnvironment) -> tuple[WalkPasses, Streams]:
    """Walk once and reduce what the phone logs."""
    walk, log = walk_and_track(scenario, planned)
    camera = CameraTrack(log.time_ns, log.position_acs, log.orientation_acs, np.zeros(len(log.time_ns), dtype=np.int8))
    observations = WalkObservations.of(camera, log.landmarks, SmootherSettings().sighting_range_m)
    rng = stream(scenario.seed, "benchmark of diagnosis", planned.key)
    receiver = make_device(planned.key.device, Locale.MIXED, scenario.seed).receiver
    heard = simulate_wifi(environment, walk, receiver, rng)
    imu = simulate_imu(walk, ImuSettings(rate_hz=GYRO_HZ), scenario.seed, rng)
    gyro = imu.sensor == list(INERTIAL_TYPES).index("GYRO")
    axes = {f"v{i + 1}": imu.values[gyro, i] for i in range(3)}
    sensors = pl.DataFrame({"time_ns": imu.time_ns[gyro], "sensor": "GYRO", "repeated": False, **axes})
    wifi = pl.DataFrame(
        {
            "time_ns": heard.time_us * 1000,
            "scan": heard.scan,
            "bssid": heard.access_point.astype(str),
            "rssi_dbm": heard.rss_dbm,
            "repeated": False,
        }
    )
    odometry = observations.odometry
    way_s = float(camera.time_ns[0]) * 1e-9 + odometry.time_s[::PATH_STEP]
    return WalkPasses.of(planned.key, observations), Streams(camera, sensors, wifi, way_s, odometry.path[::PATH_STEP])


def _inside(floor: SimulatedFloor) -> Inside:
    """Where can be walked by the plan as it is drawn."""
    with scratch_folder() as folder:
        draw_plan(floor, folder, "plan.png")
        image = np.asarray(Image.open(folder / "plan.png"))
    return walkable_space(FloorPlan((0.0, floor.width_m, 0.0, floor.height_m), image)).inside


def _diagnosed(made: MadeSurvey) -> list[Fault]:
    table = Table(made.place, made.size_m)
    walks = tuple(
        PlacedWalk.of(walk, {mark.landmark: mark.floor for mark in made.place if mark.floor == walk.key.floor}, table)
        for walk in made.walks
    )
    faults, corrected = found_faults(Evidence(table, walks))
    heard = {walk.key: one.heard() for walk, one in zip(made.walks, made.streams, strict=False)}
    faults = with_turns_by_plan(faults, corrected, {key: one.as_way for key, one in heard.items()}, made.inside)
    clocks = wifi_clocks(corrected, heard)
    signs = {walk.key: one.signs(walk.key) for walk, one in zip(made.walks, made.streams, strict=False)}
    return faults + stream_faults({key: replace(one, wifi=clocks.get(key)) for key, one in signs.items()}, faults)


def _put_in(made: MadeSurvey, rng: np.random.Generator) -> None:
    """Put in a fault of a kind that is drawn, or of another where the survey does not allow for it."""
    for number in rng.permutation(len(PUT_IN)).tolist():
        if PUT_IN[number](made, rng):
            return


def _drawn(made: MadeSurvey, rng: np.random.Generator, count: int) -> list[Mark]:
    """Landmarks of one floor, none where there are not enough."""
    floors = defaultdict(list)
    for mark in made.untouched():
        floors[mark.floor].append(mark)
    enough = [marks for marks in floors.values() if len(marks) >= count]
    if not enough:
        return []
    marks = enough[int(rng.integers(len(enough)))]
    return [marks[i] for i in rng.permutation(len(marks))[:count].tolist()]


def _note(made: MadeSurvey, kind: FaultKind, marks: list[Mark], place: str = "") -> bool:
    made.touched.update(marks)
    ids = [mark.landmark for mark in marks]
    first = ids.index(min(ids)) if ids else 0
    made.faults.append((kind, (*ids[first:], *ids[:first]), place or f"floor {marks[0].floor}"))
    return True


def swap(made: MadeSurvey, rng: np.random.Generator, count: int = 2) -> bool:
    """Hang sheets in each other's place: each where the next one should hang."""
    marks = _drawn(made, rng, count)
    places = [made.place[mark] for mark in marks]
    if not marks or min(abs(a - b) for a, b in zip(places, [*places[1:], places[0]], strict=True)) < LEAST_M:
        return False
    for mark, place in zip(marks, [places[-1], *places[:-1]], strict=True):
        made.place[mark] = place
    return _note(made, FaultKind.SWAPPED, marks)


def mis_survey(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Write a wrong place into the table."""
    marks = _drawn(made, rng, 1)
    if not marks:
        return False
    made.place[marks[0]] += float(rng.uniform(LEAST_M, GREATEST_M)) * np.exp(1j * float(rng.uniform(0, 2 * np.pi)))
    return _note(made, FaultKind.MIS_SURVEYED, marks)


def move(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Move a sheet amid the survey to where another one hung, which is gone."""
    marks = _drawn(made, rng, 2)
    if not marks:
        return False
    stays, goes = marks
    starts = sorted({made.walks[number].key.session for number, _ in made.rows(stays) + made.rows(goes)})
    rng.shuffle(starts)
    for start in starts:
        before = [at for at in made.rows(stays) if made.walks[at[0]].key.session < start]
        after = [at for at in made.rows(goes) if made.walks[at[0]].key.session >= start]
        if min(made.counted(before), made.counted(after)) >= FEWEST_PASSES:
            made.rename([at for at in made.rows(stays) if at not in before], "gone")
            made.rename([at for at in made.rows(goes) if at not in after], "gone")
            made.rename(after, stays.landmark)
            del made.place[goes]
            return _note(made, FaultKind.MOVED, [stays])
    return False


def second_sheet(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Hang a second sheet with the id of another."""
    marks = _drawn(made, rng, 2)
    if not marks:
        return False
    one, other = marks
    walks = [{number for number, _ in made.rows(mark)} for mark in marks]
    if min(walks[0]) > max(walks[1]) or min(walks[1]) > max(walks[0]) or not walks[0] & walks[1]:
        return False
    made.rename(made.rows(other), one.landmark)
    del made.place[other]
    return _note(made, FaultKind.TWO_PLACES, [one])


def other_floor(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Put a walk into the folder of another floor."""
    floors = sorted(made.size_m)
    taken = {fault[2] for fault in made.faults}
    if len(floors) < 2 or made.faults:
        return False
    number = int(rng.integers(len(made.walks)))
    walk = made.walks[number]
    other = floors[(floors.index(walk.key.floor) + 1) % len(floors)]
    ids = {mark.landmark for mark in made.place if mark.floor == other}
    if str(walk.key) in taken or len(set(walk.landmark) & ids) < FEWEST_PASSES:
        return False
    key = replace(walk.key, floor=other, session=walk.key.session)
    if any(one.key == key for one in made.walks):
        key = replace(key, session=key.session[:-2] + "30")
    made.walks[number] = replace(walk, key=key)
    return _note(made, FaultKind.WRONG_FLOOR, [], str(key))


def units(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Write a floor's table in another unit."""
    metres = UNITS_M[str(rng.choice(list(UNITS_M)))]
    return _whole_floor(made, rng, FaultKind.UNITS, lambda place, _: place / metres)


def turn(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Turn a floor's table by a quarter, as on a plan that was drawn upright."""
    return _whole_floor(made, rng, FaultKind.TURNED, lambda place, width_m: complex(place.imag, width_m - place.real))


def mirror(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Mirror a floor's table."""
    return _whole_floor(made, rng, FaultKind.MIRRORED, lambda place, width_m: complex(width_m - place.real, place.imag))


def _whole_floor(
    made: MadeSurvey, rng: np.random.Generator, kind: FaultKind, changed: Callable[[complex, float], complex]
) -> bool:
    floor = int(rng.choice(sorted(made.size_m)))
    if made.last:
        return False

    def change() -> None:
        for mark in [mark for mark in made.place if mark.floor == floor]:
            made.place[mark] = changed(made.place[mark], made.size_m[floor][0])

    made.last.append(change)
    made.faults.append((kind, (), f"floor {floor}"))
    return True


def _walk(made: MadeSurvey, rng: np.random.Generator) -> int | None:
    """A walk that no fault of a session concerns yet."""
    taken = {fault[2] for fault in made.faults}
    free = [number for number, walk in enumerate(made.walks) if str(walk.key) not in taken]
    repeated = any(kind is FaultKind.REPEATED_SCANS for kind, *_ in made.faults)
    return None if repeated or not free else int(rng.choice(free))


def clock(made: MadeSurvey, rng: np.random.Generator, stream_name: str, tables: tuple[str, ...]) -> bool:
    """Put streams of a walk onto a clock of their own: the poses are off where all others are."""
    number = _walk(made, rng)
    if number is None:
        return False
    offset_s = float(rng.uniform(LEAST_CLOCK_S, GREATEST_CLOCK_S)) * float(rng.choice((-1, 1)))
    made.streams[number] = made.streams[number].shifted(tables, offset_s)
    made.faults.append((FaultKind.CLOCK, (stream_name,), str(made.walks[number].key)))
    return True


def repeat_scans(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Let a device deliver a scan again in place of the next, in all its walks."""
    if any(fault[2].startswith("floor ") and "/" in fault[2] for fault in made.faults):
        return False
    device = str(rng.choice(sorted({walk.key.device for walk in made.walks})))
    numbers = [number for number, walk in enumerate(made.walks) if walk.key.device == device]
    for number in numbers:
        one = made.streams[number]
        scans = one.wifi["scan"].unique(maintain_order=True).to_list()
        again = [i for i in range(1, len(scans)) if rng.random() < REPEATED_SHARE]
        wifi = one.wifi
        for i in again:
            old = wifi.filter(pl.col("scan") == scans[i - 1])
            first_ns = wifi.filter(pl.col("scan") == scans[i])["time_ns"].min()
            later = pl.col("time_ns") - old["time_ns"].min() + first_ns
            moved = old.with_columns(scan=pl.lit(scans[i], pl.Int64), time_ns=later)
            wifi = pl.concat([wifi.filter(pl.col("scan") != scans[i]), moved])
        made.streams[number] = replace(one, wifi=wifi.sort("scan", maintain_order=True))
    made.faults.append((FaultKind.REPEATED_SCANS, (), str(made.walks[numbers[0]].key)))
    return True


def other_device(made: MadeSurvey, rng: np.random.Generator) -> bool:
    """Put a walk into the folder of another device, which has walks of its own, as the right one keeps some."""
    number = _walk(made, rng)
    if number is None:
        return False
    key = made.walks[number].key
    (other,) = {walk.key.device for walk in made.walks} - {key.device}
    moved = replace(key, device=other)
    if sum(walk.key.device == key.device for walk in made.walks) < 3 or moved in {walk.key for walk in made.walks}:
        return False
    made.walks[number] = replace(made.walks[number], key=moved)
    made.faults.append((FaultKind.OTHER_DEVICE, (), str(moved)))
    return True


PUT_IN: tuple[Callable[[MadeSurvey, np.random.Generator], bool], ...] = (
    swap,
    partial(swap, count=3),
    mis_survey,
    move,
    second_sheet,
    other_floor,
    units,
    mirror,
    turn,
    partial(clock, stream_name="sensors", tables=("sensors",)),
    partial(clock, stream_name="wifi", tables=("wifi",)),
    partial(clock, stream_name="camera", tables=("sensors", "wifi")),
    repeat_scans,
    other_device,
)


def _print(outcomes: list[Outcome], *, show: bool) -> None:
    put_in, right = Counter[str](), Counter[str]()
    by_count: dict[int, list[bool]] = defaultdict(list)
    wrong = 0
    for outcome in outcomes:
        for fault in outcome.put_in:
            hit = fault in outcome.named
            kind = f"{fault[0]} ({fault[1][0]})" if fault[0] is FaultKind.CLOCK else str(fault[0])
            put_in[kind] += 1
            right[kind] += hit
            by_count[len(outcome.put_in)].append(hit)
        extra = [fault for fault in outcome.named if fault not in outcome.put_in]
        wrong += len(extra)
        if show and (extra or outcome.alarms or set(outcome.put_in) - set(outcome.named)):
            print(outcome.seed, "alarms:", outcome.alarms, "\n   put in:", outcome.put_in)
            print("   named: ", "\n           ".join(outcome.sentences))
    print("\n| fault | put in | named rightly |\n| --- | --- | --- |")
    for kind, count in sorted(put_in.items()):
        print(f"| {kind} | {count} | {right[kind]} ({100 * right[kind] / count:.0f} %) |")
    total = sum(put_in.values())
    print(f"| all | {total} | {sum(right.values())} ({100 * sum(right.values()) / total:.1f} %) |")
    for count, hits in sorted(by_count.items()):
        print(f"{count} at once: {sum(hits)} of {len(hits)}")
    print(f"named though not put in: {wrong}")
    alarms = sum(bool(outcome.alarms) for outcome in outcomes)
    print(f"clean surveys with a false alarm: {alarms} of {len(outcomes)} ({100 * alarms / len(outcomes):.1f} %)")


if __name__ == "__main__":
    main()
