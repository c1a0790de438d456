"""A changed building: what a later survey detects, and what updating a positioning model gains.

Two surveys of one generated building are compared, with and without changes.

With ``--update`` the benchmark prints a model's errors in the changed building without an update, with one of five
minutes, and with a full one. The base has 12 walks of four minutes. Then three access points are removed, three moved
and three added, and eight walks are made: half of them for the update, half for the test.

With ``--library`` the same is done for later months of UJI's long-term library set. The training set is the first
month's ``trn`` walks, the test set the ``tst`` scans of each later month. The model is ``local-kriging`` with its
defaults. ``updated`` is what ``train --update`` does; ``both learned`` is the same without removing anything.

    python benchmarks/changed_building.py                            20 buildings
    python benchmarks/changed_building.py --update --buildings 5     9 of 28 access points changed
    python benchmarks/changed_building.py --library uji-library      the set as imported
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.access_points import access_point_table
from vislam2tag.datasets.changes import APPEARED, CHANGED, CHANGED_POINTS, MOVED, VANISHED, survey_changes
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.model import Dataset, DatasetInfo, FloorInfo, Grouping
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, in_schema
from vislam2tag.positioning.learning_data import LearningData, learning_data, updated
from vislam2tag.positioning.model_scores import score
from vislam2tag.positioning.places import LabelledScans, joined_places
from vislam2tag.positioning.radio_scans import joined_scans
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import SimulatedBuilding, TrueWalk, position_at
from vislam2tag.simulation.phones import make_device
from vislam2tag.simulation.radio import (
    RadioEnvironment,
    RadioSettings,
    make_radio_environment,
    mean_rss_dbm,
    simulate_wifi,
)
from vislam2tag.simulation.settings import BuildingSettings, Locale, WalkStyle, stream, walk_settings
from vislam2tag.simulation.walk import make_walk

FLOORS = (0, 1)
LABEL_SIGMA_M = 0.15
"""Error of a scan's label, per axis: about what the smoother states."""
_MARK = "moved "
HAND_M = 1.37
"""Height of the phone."""
FAINTEST_DBM = -90.0
LITTLE_DB, MUCH_DB = 2.0, 5.0
"""True root mean square changes of a place that should not be reported, and that should."""

MODEL = "local-kriging"
MOST_ASKED = 800
FIVE_MINUTES = 86
"""Scans of the library's phone; of the generated ones about as many."""


def main() -> None:
    """Print what a later survey finds, or what updating a model gains."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", type=int, default=20, help="how many are generated")
    parser.add_argument("--update", action="store_true", help="what updating a model gains in them")
    parser.add_argument("--library", type=Path, help="what updating gains in later months of this data set")
    options = parser.parse_args()
    if not options.update and options.library is None:
        print_changes(options.buildings)
        return
    print("| | not updated | updated by five minutes | updated by all | both learned | gone, moved, new: found |")
    print("| --- |" + " ---: |" * 5)
    if options.library is not None:
        library(options.library)
    if options.update:
        rows = [building(seed) for seed in range(options.buildings)]
        tell(f"mean of {len(rows)} buildings", np.mean([row for row, _ in rows], axis=0).tolist(), "")


@dataclass(frozen=True)
class Changes:
    """What happened between two surveys: indices of the base's access points, and how many are new."""

    removed: tuple[int, ...] = ()
    moved: tuple[int, ...] = ()
    added: tuple[int, ...] = ()
    """Access points of the later building that the base did not have."""


@dataclass(frozen=True)
class Surveys:
    """A base and a later survey, and the truth of what changed."""

    base: Dataset
    later: Dataset
    before: RadioEnvironment
    after: RadioEnvironment
    removed: frozenset[str] = frozenset()
    moved: frozenset[str] = frozenset()
    added: frozenset[str] = frozenset()


def two_surveys(
    seed: int, changes: Changes, minutes: float = 4.0, base_walks: int = 3, later_walks: int = 2
) -> Surveys:
    """Survey a building of 28 access points on two floors, change it, and survey it again with other walks.

    The base by two phones, ``base_walks`` each on each floor; the later one by one of them and a third.
    """
    building = make_building(BuildingSettings(), seed, FLOORS)
    names = building.ap_bssid
    gone = {*changes.removed}
    before = _with_points(building, [index for index in range(len(names)) if index not in changes.added], {})
    places = _other_places(building, changes.moved, seed)
    after = _with_points(building, [index for index in range(len(names)) if index not in gone], places)
    waves = [make_radio_environment(building, RadioSettings(), seed) for building in (before, after)]
    return Surveys(
        before=waves[0],
        after=waves[1],
        base=_surveyed(waves[0], seed, "base", ("LG", "OnePlus"), base_walks, minutes),
        later=_surveyed(waves[1], seed, "later", ("LG", "Galaxy"), later_walks, minutes),
        removed=frozenset(names[index] for index in changes.removed),
        moved=frozenset(names[index] for index in changes.moved),
        added=frozenset(names[index] for index in changes.added),
    )


def _other_places(building: SimulatedBuilding, moved: tuple[int, ...], seed: int) -> dict[int, np.ndarray]:
    """Draw a new place, at least 15 m away on the same floor, for each access point that moves."""
    rng = stream(seed, "moves")
    places = {}
    for index in moved:
        floor = next(item for item in building.floors if item.number == building.ap_floor[index])
        old = building.ap_position[index]
        far = floor.nodes[np.linalg.norm(floor.nodes - old[:2], axis=1) > 15.0]
        places[index] = np.append(rng.choice(far), old[2])
    return places


def _with_points(building: SimulatedBuilding, kept: list[int], places: dict[int, np.ndarray]) -> SimulatedBuilding:
    """Keep some access points; one with another place has another shadowing, so that its name is marked."""
    position = building.ap_position.copy()
    for index, place in places.items():
        position[index] = place
    names = tuple(_MARK * (index in places) + building.ap_bssid[index] for index in kept)
    return replace(
        building,
        ap_floor=building.ap_floor[kept],
        ap_position=position[kept],
        ap_bssid=names,
        ap_ssid=tuple(building.ap_ssid[index] for index in kept),
        ap_frequency_mhz=building.ap_frequency_mhz[kept],
        ap_power_dbm=building.ap_power_dbm[kept],
    )


def _surveyed(
    environment: RadioEnvironment, seed: int, survey: str, devices: tuple[str, ...], walks: int, minutes: float
) -> Dataset:
    building, fingerprints, readings = environment.building, [], []
    for floor in building.floors:
        for name in devices:
            for number in range(walks):
                session = f"floor_{floor.number}.{name}.{survey}-{number}"
                rng = stream(seed, "walk", session)
                walk = make_walk(floor, 60 * minutes, walk_settings(WalkStyle.SURVEY), rng)
                wifi = simulate_wifi(environment, walk, make_device(name, Locale.EN, seed).receiver, rng)
                rows = _rows(session, walk, building, wifi.scan, wifi.time_us, wifi.access_point, wifi.rss_dbm, rng)
                readings.append(rows)
                fingerprints.append(_scans(rows, session, name))
    return _dataset(survey, pl.concat(fingerprints), pl.concat(readings))


def _rows(
    session: str,
    walk: TrueWalk,
    building: SimulatedBuilding,
    scan: np.ndarray,
    time_us: np.ndarray,
    point: np.ndarray,
    rss_dbm: np.ndarray,
    rng: np.random.Generator,
) -> pl.DataFrame:
    """Label readings with the walk's position and one error a scan."""
    number = scan - scan.min()
    error = rng.normal(0, LABEL_SIGMA_M, (number.max() + 1, 2))
    place = position_at(walk, time_us * 1000)[:, :2] + error[number]
    names = np.array([name.removeprefix(_MARK) for name in building.ap_bssid])
    table = pl.DataFrame(
        {
            "scan_id": [f"{session}/wifi/{index:06d}" for index in number.tolist()],
            "bssid": names[point],
            "rssi_dbm": rss_dbm,
            "frequency_mhz": building.ap_frequency_mhz[point],
            "time_ns": time_us * 1000,
            "floor": walk.floor,
            "x": place[:, 0],
            "y": place[:, 1],
            "sigma": LABEL_SIGMA_M,
        }
    )
    return in_schema(READINGS, table).sort("scan_id", "time_ns", "bssid")


def _scans(readings: pl.DataFrame, session: str, device: str) -> pl.DataFrame:
    scans = readings.group_by("scan_id", maintain_order=True).agg(
        pl.col("x", "y").mean(),
        pl.col("floor").first(),
        readings=pl.len(),
        labelled=pl.len(),
        start_ns=pl.col("time_ns").min(),
        end_ns=pl.col("time_ns").max(),
    )
    constants = {"technology": "wifi", "building": "", "status": "ok", "labelled_share": 1.0, "sigma": LABEL_SIGMA_M}
    return in_schema(
        FINGERPRINTS,
        scans.with_columns(
            session=pl.lit(session), device=pl.lit(device), **{k: pl.lit(v) for k, v in constants.items()}
        ),
    )


def _dataset(name: str, fingerprints: pl.DataFrame, readings: pl.DataFrame) -> Dataset:
    names = pl.DataFrame(schema={"bssid": pl.String, "technology": pl.String, "ssid": pl.String, "count": pl.Int64})
    walks = fingerprints.group_by("session", maintain_order=True).agg(
        pl.col("building", "floor", "device").first(), fingerprints=pl.len()
    )
    tables = {
        FINGERPRINTS: fingerprints,
        READINGS: readings,
        ACCESS_POINTS: access_point_table(fingerprints.lazy(), readings.lazy(), names),
        SESSIONS: in_schema(SESSIONS, walks),
    }
    settings = BuildingSettings()
    info = DatasetInfo(
        name=name,
        floors=tuple(FloorInfo(number=floor, width_m=settings.width_m, height_m=settings.height_m) for floor in FLOORS),
        groupings=(Grouping(technology="wifi", by="scan"),),
    )
    return Dataset(info, {key: table.lazy() for key, table in tables.items()})


def _three_changes(seed: int) -> Changes:
    removed, moved, added = stream(seed, "changes").choice(2 * BuildingSettings().access_points, 3, replace=False)
    return Changes(removed=(int(removed),), moved=(int(moved),), added=(int(added),))


def _counted(surveys: Surveys) -> dict[str, int]:
    """Count what the comparison flags, against what is true."""
    found = survey_changes(surveys.base, surveys.later, "wifi")
    kinds = {
        **dict.fromkeys(surveys.removed, VANISHED),
        **dict.fromkeys(surveys.moved, MOVED),
        **dict.fromkeys(surveys.added, APPEARED),
    }
    told = {row["bssid"]: row["change"] for row in found.access_points.iter_rows(named=True)}
    flagged = {bssid for bssid, change in told.items() if change in CHANGED_POINTS}
    common = found.places.filter((pl.col("base") > 0) & (pl.col("later") > 0))
    told_places = (common["change"] == CHANGED).to_numpy()
    true_db = _true_sizes_db(surveys, common)
    return {
        "true": len(kinds),
        "found": len(flagged & kinds.keys()),
        "kind": sum(told.get(bssid) == kind for bssid, kind in kinds.items()),
        "false": len(flagged - kinds.keys()),
        "others": len(told.keys() - kinds.keys()),
        "places": int(told_places.sum()),
        "little": int((told_places & (true_db < LITTLE_DB)).sum()),
        "much": int((true_db > MUCH_DB).sum()),
        "much found": int((told_places & (true_db > MUCH_DB)).sum()),
        "common": common.height,
    }


def _true_sizes_db(surveys: Surveys, places: pl.DataFrame) -> FloatArray:
    """Root mean square change (k,) of the true mean loudness at places' centres, over what can be heard there."""
    sizes = []
    for floor, x, y in places.select("floor", "x", "y").iter_rows():
        loud = [
            _loudness_db(environment, floor, np.array([x, y, HAND_M]))
            for environment in (surveys.before, surveys.after)
        ]
        change = [loud[1].get(name, 0.0) - loud[0].get(name, 0.0) for name in loud[0].keys() | loud[1].keys()]
        sizes.append(float(np.sqrt(np.mean(np.square(change)))))
    return np.array(sizes)


def _loudness_db(environment: RadioEnvironment, floor: int, point: FloatArray) -> dict[str, float]:
    """Loudness above FAINTEST_DBM of each access point that is heard at a point."""
    names = [name.removeprefix(_MARK) for name in environment.building.ap_bssid]
    every = np.arange(len(names))
    rss = mean_rss_dbm(environment, floor, np.tile(point, (len(names), 1)), every, FAINTEST_DBM)
    return {name: float(level - FAINTEST_DBM) for name, level in zip(names, rss, strict=True) if level > FAINTEST_DBM}


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.1f} %"


def print_changes(buildings: int) -> None:
    """Print what is flagged, over generated buildings, where nothing changed and where 3 of 28 access points did."""
    same, changed = Counter[str](), Counter[str]()
    for seed in range(buildings):
        same.update(_counted(two_surveys(seed, Changes())))
        changed.update(_counted(two_surveys(seed, _three_changes(seed))))
    print(
        "| building | access points changed | found | of the right kind | others reported | places reported "
        "| of them changed by < 2 dB | changed by > 5 dB: reported |"
    )
    print("|" + " --- |" * 8)
    for name, counts in (("unchanged", same), ("3 of 28 changed", changed)):
        shares = f"{counts['false']} of {counts['others']} ({_percent(counts['false'], counts['others'])})"
        places = f"{counts['places']} of {counts['common']} ({_percent(counts['places'], counts['common'])})"
        much = f"{counts['much found']} of {counts['much']}"
        print(
            f"| {name} | {counts['true']} | {counts['found']} | {counts['kind']} | {shares} | {places} "
            f"| {counts['little']} | {much} |"
        )


def library(folder: Path) -> None:
    """Ask about each month after the first."""
    data = learning_data(open_dataset(folder))
    month = np.strings.partition(data.scans.session, ".")[0]  # as the set names them; a calendar month may hold two
    walked = np.char.find(data.scans.session, "trn") >= 0
    first = data[(month == np.unique(month)[0]) & walked]
    before = model_named(MODEL).fit(first.scans, first.places)
    for one in np.unique(month)[1:]:
        later = data[(month == one) & walked]
        asked = data[np.flatnonzero((month == one) & ~walked)]
        if len(later) and len(asked):
            tell(str(one), *errors(before, later, asked))


def building(seed: int) -> tuple[list[float], str]:
    """Change a building and ask about half of the later walks."""
    drawn = stream(seed, "changes").choice(2 * BuildingSettings().access_points, 9, replace=False).tolist()
    surveys = two_surveys(seed, Changes(tuple(drawn[:3]), tuple(drawn[3:6]), tuple(drawn[6:])))
    base, later = (learning_data(survey) for survey in (surveys.base, surveys.later))
    half = np.char.endswith(later.scans.session, "-0")
    row = errors(model_named(MODEL).fit(base.scans, base.places), later[half], later[~half])
    tell(f"building {seed}", *row)
    return row


def errors(before: Positioner, later: LearningData, asked: LearningData) -> tuple[list[float], str]:
    """Return mean errors in the plane, metres, of all four ways, and what was found to have changed."""
    asked = asked[slice(None, None, max(1, len(asked) // MOST_ASKED))]
    known = before.learned()
    assert known is not None
    all_of_it = updated(known, (later.scans, later.places))
    parts = [(later.scans[rows], later.places[rows]) for rows in (slice(0, FIVE_MINUTES), slice(None))]
    learned = [updated(known, parts[0]).learned, all_of_it.learned, joined(known, parts[1])]
    models = [before, *(model_named(MODEL).fit(*one) for one in learned)]
    changes = ", ".join(str(len(names)) for names in (all_of_it.gone, all_of_it.moved, all_of_it.new))
    return [mean_m(model, asked) for model in models], changes


def joined(known: LabelledScans, later: LabelledScans) -> LabelledScans:
    """Put both together as they are."""
    return joined_scans([known[0], later[0]]), joined_places([known[1], later[1]])


def mean_m(model: Positioner, asked: LearningData) -> float:
    """Mean error in the plane, metres; NaN where nothing is answered."""
    found = model.predict(asked.scans)
    mean = score(found, asked.places.over(found.storeys)).plane.mean_m
    return float("nan") if mean is None else mean


def tell(name: str, means_m: Sequence[float], changes: str) -> None:
    """Print a line."""
    print(f"| {name} | " + " | ".join(f"{mean:.2f} m" for mean in means_m) + f" | {changes} |", flush=True)


if __name__ == "__main__":
    main()
