"""Data sets built of simulated surveys, beside the simulator's truth and the paper's rule computed anew."""

from __future__ import annotations

import json
import shutil
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.surveys import bytes_of
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import REQUIRED, RTT, SCHEMAS
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb, SiteColumn
from vislam2tag.simulation.survey import WritingOptions, simulate

SECONDS = 90.0
BY_PLAN = ("Walkable (plan)", "Coverage by room", "Rooms entered")
"""What the page of a data set says where the survey's plans are at hand."""


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two floors, two phones, ordinary faults, beacons."""
    out = tmp_path_factory.mktemp("survey") / "campus"
    simulate(regular_survey(4, "default", (0, 1), ("LG", "OnePlus"), 1, SECONDS, ble=True), out)
    return out


@pytest.fixture(scope="module")
def labels(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("labels") / "labels"
    assert process(survey, out).failed == 0
    return out


@pytest.fixture(scope="module")
def built(labels: Path, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return build_dataset(labels, tmp_path_factory.mktemp("built") / "set")


def test_labels_that_were_mapped_together_stay_so(survey: Path, tmp_path: Path) -> None:
    together = process(survey, tmp_path / "labels", Settings(together=True))
    build_dataset(survey, tmp_path / "set", options=BuildOptions(labels=tmp_path / "labels"))
    assert json.loads((tmp_path / "labels" / "run.json").read_text())["settings"]["together"] is True
    assert json.loads((tmp_path / "labels" / "summary.json").read_text())["frames"] == together.frames


def true_position(survey: Path, row: dict[str, object], time_ns: object) -> np.ndarray:
    """Where the camera truly was, (2,), at times (k,): the mean."""
    _, device, name = str(row["session"]).split(".")
    (file,) = survey.glob(f"floor_{row['floor']}/{device}/{name[:13]}:{name[13:15]}:{name[15:]}/truth.csv")
    truth = pl.read_csv(file)
    times = truth["time_ns"].to_numpy()
    return np.array([np.interp(np.asarray(time_ns), times, truth[axis].to_numpy()).mean() for axis in "xy"])


def test_fingerprints_lie_where_the_phone_was(survey: Path, built: Dataset) -> None:
    readings = built.readings.collect()
    errors, sigma = [], []
    for row in built.fingerprints.filter(technology="wifi", status="ok").collect().iter_rows(named=True):
        times = readings.filter(scan_id=row["scan_id"])["time_ns"]
        truth = true_position(survey, row, times.to_numpy())
        errors.append(np.hypot(row["x"] - truth[0], row["y"] - truth[1]))
        sigma.append(row["sigma"])
        assert 0.0 < row["spread"] < 3.0
    assert len(errors) > 80
    assert np.median(errors) < 0.3
    assert np.mean(np.array(errors) < 2.45 * np.array(sigma)) > 0.8


def test_every_reading_of_the_survey_is_there_once(labels: Path, built: Dataset) -> None:
    raw = pl.read_parquet(labels / "wifi/*.parquet")
    fresh = raw.filter(pl.col("status") != "duplicate")
    beacons = pl.read_parquet(labels / "ble/*.parquet")
    assert raw.height > fresh.height
    readings = built.readings.collect()
    assert readings.height == fresh.height + beacons.height
    counted = {finding.kind: finding.count for finding in built.info.findings}
    assert counted["repeated_readings"] == raw.height - fresh.height
    wifi = readings.filter(pl.col("scan_id").str.contains("/wifi/"))
    columns = ["bssid", "rssi_dbm", "time_ns", "x", "y"]
    assert wifi.select(columns).sort(columns).equals(fresh.select(columns).sort(columns))
    scans = built.fingerprints.filter(technology="wifi").collect()
    assert scans["readings"].sum() == fresh.height
    assert len(scans) == fresh.select("device", "session", "scan").n_unique()


def test_the_papers_positions_computed_anew(survey: Path, tmp_path: Path) -> None:
    """The paper: the mean of the positions of a scan's readings; its strategy states no sigma."""
    process(survey, tmp_path / "labels", Settings(strategy="local-corrected"))
    built = build_dataset(tmp_path / "labels", tmp_path / "set")
    places: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for file in (tmp_path / "labels/wifi").iterdir():
        for row in pl.read_parquet(file).iter_rows(named=True):
            if row["status"] == "ok":
                places[f"{file.stem}/wifi/{row['scan']:06d}"].append((row["x"], row["y"]))
    scans = built.fingerprints.filter(technology="wifi").collect()
    labelled = scans.filter(status="ok")
    assert len(places) == len(labelled) > 50
    assert len(labelled) < len(scans)
    assert scans.filter(pl.col("x").is_null())["status"].is_in(["ok", "uncertain"]).sum() == 0
    for row in labelled.iter_rows(named=True):
        assert (row["x"], row["y"]) == pytest.approx(np.mean(places[row["scan_id"]], axis=0))
    assert scans["sigma"].null_count() == len(scans)


def test_tables_have_the_schema_and_are_in_order(built: Dataset) -> None:
    assert set(built.tables) == set(SCHEMAS) - {RTT}
    for name, table in built.tables.items():
        assert list(table.collect_schema().items()) == list(SCHEMAS[name].items())
    scans = built.fingerprints.collect()
    assert scans["scan_id"].is_unique().all()
    assert scans.select("session", "start_ns").equals(scans.select("session", "start_ns").sort("session", "start_ns"))
    assert built.readings.collect()["scan_id"].unique(maintain_order=True).to_list() == scans["scan_id"].to_list()
    assert set(scans["technology"]) == {"ble", "wifi"}
    windows = scans.filter(technology="ble").select((pl.col("end_ns") - pl.col("start_ns")).max()).item()
    assert windows < 1_000_000_000
    walks = built.sessions.collect()
    assert walks["fingerprints"].to_list() == [scans.filter(session=session).height for session in walks["session"]]
    assert walks["duration_s"].min() > SECONDS - 1  # type: ignore[operator]
    assert (walks["labelled_m"] <= walks["distance_m"]).all()


def test_the_manifest_tells_what_it_was_made_of(labels: Path, built: Dataset) -> None:
    info = built.info
    assert info.name == "campus"
    assert [(floor.number, floor.width_m, floor.plan) for floor in info.floors] == [(0, 60.0, None), (1, 60.0, None)]
    assert [(group.technology, group.by, group.window_s) for group in info.groupings] == [
        ("ble", "window", 1.0),
        ("wifi", "scan", None),
    ]
    (source,) = info.sources
    assert (source.kind, source.name) == ("process", "campus")
    assert source.settings["dataset"] == DatasetSettings().model_dump(mode="json")
    assert set(built.splits) >= {"random", "device", "floor"}


@pytest.mark.slow
def test_the_same_bytes_whichever_way(survey: Path, labels: Path, built: Dataset, tmp_path: Path) -> None:
    once = build_dataset(labels, tmp_path / "once")
    again = build_dataset(labels, tmp_path / "again", jobs=2)
    assert bytes_of(tmp_path / "once") == bytes_of(tmp_path / "again")
    assert once.info == again.info == built.info
    of_survey = build_dataset(survey, tmp_path / "of_survey", options=BuildOptions(labels=tmp_path / "kept"))
    assert of_survey.info.tables == once.info.tables
    assert [floor.plan for floor in of_survey.info.floors] == ["plans/floor_0.jpg", "plans/floor_1.jpg"]
    assert (tmp_path / "of_survey/plans/floor_1.jpg").read_bytes() == (survey / "floor_1/floorplan.jpg").read_bytes()
    assert bytes_of(tmp_path / "kept") == bytes_of(labels)
    with_plans = build_dataset(labels, tmp_path / "with_plans", options=BuildOptions(surveys=(survey,)))
    assert bytes_of(tmp_path / "with_plans") == bytes_of(tmp_path / "of_survey")
    assert with_plans.files
    page = (tmp_path / "with_plans" / "report.html").read_text()
    assert all(text in page for text in BY_PLAN)
    assert not any(text in (tmp_path / "once" / "report.html").read_text() for text in BY_PLAN)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again", "kept", "of_survey", "once", "with_plans"]


def test_windows_instead_of_scans(labels: Path, built: Dataset, tmp_path: Path) -> None:
    short = build_dataset(labels, tmp_path / "set", DatasetSettings(wifi_window_s=0.5))
    scans, windows = (part.fingerprints.filter(technology="wifi").collect() for part in (built, short))
    assert windows["readings"].sum() == scans["readings"].sum()
    assert len(windows) > 2 * len(scans)
    assert windows["spread"].median() < 0.5 * scans["spread"].median()  # type: ignore[operator]
    assert short.info.groupings[1].window_s == 0.5


def test_less_certain_fingerprints_are_marked(labels: Path, built: Dataset, tmp_path: Path) -> None:
    strict = build_dataset(labels, tmp_path / "set", options=BuildOptions(max_sigma_m=0.1)).fingerprints.collect()
    usual = built.fingerprints.collect()
    assert strict.drop("status").equals(usual.drop("status"))
    placed = strict.filter(pl.col("x").is_not_null())
    assert (placed["status"] == "uncertain").equals(placed["sigma"] > 0.1)
    assert (usual.filter(pl.col("x").is_not_null())["status"] == "uncertain").equals(
        usual.filter(pl.col("x").is_not_null())["sigma"] > 0.5
    )


def test_sources_of_one_building_and_of_two(labels: Path, tmp_path: Path) -> None:
    other = shutil.copytree(labels, tmp_path / "other")
    run = json.loads((other / "run.json").read_text())
    run["floors"][1]["width_m"] = 99.0
    (other / "run.json").write_text(json.dumps(run))
    both = build_dataset([labels, other], tmp_path / "set", options=BuildOptions(buildings=("Main hall", "annex")))
    assert [(floor.building, floor.number, floor.width_m) for floor in both.info.floors] == [
        ("Main hall", 0, 60.0),
        ("Main hall", 1, 60.0),
        ("annex", 0, 60.0),
        ("annex", 1, 99.0),
    ]
    scans = both.fingerprints.collect()
    assert scans["scan_id"].is_unique().all()
    assert set(scans["building"]) == {"Main hall", "annex"}
    assert scans.filter(building="annex")["session"].str.starts_with("annex.floor_").all()
    assert scans.filter(building="Main hall")["session"].str.starts_with("Main-hall.floor_").all()
    assert set(both.tables["imu_windows"].collect()["building"]) == {"Main hall", "annex"}


def test_a_walk_over_two_floors_has_fingerprints_on_both(tmp_path: Path) -> None:
    columns = frozenset({SiteColumn.ELEVATION})
    planned = regular_survey(2, "none", (0, 1), ("LG",), 1, 120.0, climb=Climb.STAIRS, pressure=True)
    simulate(replace(planned, sessions=planned.sessions[:1]), tmp_path / "survey", WritingOptions(columns=columns))
    built = build_dataset(tmp_path / "survey", tmp_path / "set")
    scans = built.fingerprints.filter(pl.col("x").is_not_null()).collect()
    (file,) = (tmp_path / "survey").glob("floor_0/LG/*/truth.csv")
    middle = scans.select(time_ns=(pl.col("start_ns") + pl.col("end_ns")) // 2, floor="floor", z="z").sort("time_ns")
    both = middle.join_asof(pl.read_csv(file).sort("time_ns"), on="time_ns", strategy="nearest", suffix="_true")
    assert set(scans["floor"]) == {0, 1}
    assert np.mean((both["floor"] == both["floor_true"]).to_numpy()) > 0.9
    assert np.median((both["z"] - both["z_true"]).abs().to_numpy()) < 0.5


def without(labels: Path, copy: Path, slugs: list[str], *tables: str) -> Path:
    """Empty these sessions' radio tables in a copy of the labels."""
    shutil.copytree(labels, copy)
    for slug in slugs:
        for table in tables:
            path = copy / table / f"{slug}.parquet"
            pl.read_parquet(path).clear().write_parquet(path)
    return copy


def test_walks_and_phones_without_readings_are_counted(labels: Path, tmp_path: Path) -> None:
    slugs = sorted(path.stem for path in (labels / "sessions").iterdir())
    mute = [slug for slug in slugs if ".LG." in slug]
    found = build_dataset(without(labels, tmp_path / "mute", mute, "wifi", "ble"), tmp_path / "set").info.findings
    kinds = {finding.kind: finding for finding in found}
    assert kinds["session_without_scan"].count == len(mute)
    assert "LG" in kinds["device_without_scan"].message
    nothing = build_dataset(without(labels, tmp_path / "none", slugs, "wifi", "ble"), tmp_path / "empty")
    assert nothing.fingerprints.collect().height == 0
    assert nothing.tables["imu_windows"].collect().height > 0
    assert {finding.kind for finding in nothing.info.findings} >= {"no_radio_reading", "session_without_scan"}
    assert set(nothing.tables) >= set(REQUIRED)
    next((tmp_path / "none" / "wifi").iterdir()).unlink()
    with pytest.raises(DatasetError, match=r"wifi.*parquet: cannot be read"):
        build_dataset(tmp_path / "none", tmp_path / "damaged")


def test_walks_that_could_not_be_mapped_and_columns_nobody_knows(survey: Path, tmp_path: Path) -> None:
    lone = tmp_path / "survey"
    shutil.copytree(survey, lone)
    (session,) = lone.glob("floor_0/LG/*")
    (session / "initPoses.csv").unlink()
    (gone,) = lone.glob("floor_1/LG/*")
    (gone / "poses.csv").unlink()
    process(lone, tmp_path / "labels")
    slug = next((tmp_path / "labels/wifi").glob("floor_1.OnePlus*")).name
    table = tmp_path / "labels/wifi" / slug
    pl.read_parquet(table).with_columns(mood=pl.lit("fine")).write_parquet(table)
    built = build_dataset(tmp_path / "labels", tmp_path / "set")
    kinds = {finding.kind: finding for finding in built.info.findings}
    assert kinds["session_without_label"].count == 2
    assert "wifi/mood" in kinds["unknown_columns"].message
    scans = built.fingerprints.filter(pl.col("session").str.starts_with("floor_0.LG")).collect()
    assert set(scans["status"]) == {"fits_other_floor"}
    assert scans["x"].null_count() == scans["floor"].null_count() == len(scans) > 0
    assert kinds["unlabelled_fingerprints"].count >= len(scans)
    assert built.sessions.collect().height == 4


def test_sources_that_cannot_be_used(survey: Path, labels: Path, built: Dataset, tmp_path: Path) -> None:
    other = shutil.copytree(survey, tmp_path / "other")
    (other / "floor_dimensions.csv").write_text("id,width,height\n0,10,10\n1,60,32\n")
    unfinished = shutil.copytree(labels, tmp_path / "unfinished")
    (unfinished / "summary.json").unlink()
    with pytest.raises(DatasetError, match="has not finished"):
        build_dataset(unfinished, tmp_path / "set")
    damaged = shutil.copytree(labels, tmp_path / "damaged")
    next((damaged / "wifi").iterdir()).write_bytes(b"no table")
    with pytest.raises(DatasetError, match="cannot be read"):
        build_dataset(damaged, tmp_path / "set", jobs=2)
    build_dataset(labels, tmp_path / "good")
    with pytest.raises(DatasetError, match="this is already a data set"):
        build_dataset(tmp_path / "good", tmp_path / "set")
    with pytest.raises(OutputError, match="contains the output of `vislam2tag process`"):
        build_dataset(tmp_path / "no survey", unfinished)
    for options, message in (
        (BuildOptions(labels=tmp_path / "kept"), "--labels: all sources are already labelled"),
        (BuildOptions(surveys=(survey, survey)), "--survey: 2 surveys for 1 output"),
        (BuildOptions(surveys=(other,)), "--survey .*floor 0 differs from the floor"),
    ):
        with pytest.raises(UsageError, match=message):
            build_dataset(labels, tmp_path / "set", options=options)
    assert not (tmp_path / "set").exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    assert open_dataset(tmp_path / "good").info == built.info


def test_scans_with_the_beacons_around_them_count_each_reading_once(labels: Path, tmp_path: Path) -> None:
    both = build_dataset(labels, tmp_path / "both", DatasetSettings(ble_with_wifi=True, ble_window_s=1.0))
    apart = build_dataset(labels, tmp_path / "apart", DatasetSettings())
    (grouping,) = both.info.groupings
    assert (grouping.technology, grouping.by, grouping.window_s) == ("wifi+ble", "scan", 1.0)
    points = both.access_points.collect()
    assert points.select("bssid", "technology").equals(apart.access_points.collect().select("bssid", "technology"))
    scans, readings = both.fingerprints.collect(), both.readings.collect()
    wifi = apart.fingerprints.filter(pl.col("technology") == "wifi").collect()
    assert scans["scan_id"].str.replace("wifi+ble", "wifi", literal=True).to_list() == wifi["scan_id"].to_list()
    kind = dict(points.select("bssid", "technology").iter_rows())
    ends = apart.fingerprints.filter(pl.col("technology") == "wifi").select("session", "start_ns", "end_ns").collect()
    left_out = kept = 0
    for session, own in (
        apart.readings.join(
            apart.fingerprints.filter(pl.col("technology") == "ble").select("scan_id", "session"), on="scan_id"
        )
        .collect()
        .group_by("session")
    ):
        of_walk = [(a - 500_000_000, b + 500_000_000) for name, a, b in ends.iter_rows() if name == session[0]]
        for time_ns in own["time_ns"]:
            inside = any(a <= time_ns <= b for a, b in of_walk)
            kept, left_out = kept + inside, left_out + (not inside)
    assert sum(kind[one] == "ble" for one in readings["bssid"]) == kept
    found = {one.kind: one.count for one in both.info.findings}
    assert found["readings_beside_no_scan"] == left_out
    assert scans["readings"].sum() == readings.height


def test_beacons_are_not_asked_for_in_vain(tmp_path: Path) -> None:
    simulate(regular_survey(4, "none", (0,), ("LG",), 1, 30.0), tmp_path / "quiet")
    with pytest.raises(UsageError, match="no session has BLE readings; remove this option"):
        build_dataset(tmp_path / "quiet", tmp_path / "set", DatasetSettings(ble_with_wifi=True))
