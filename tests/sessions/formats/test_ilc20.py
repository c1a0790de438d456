"""Traces of the Indoor Location Competition 2.0."""

from __future__ import annotations

import json
import re
import shutil
from datetime import date, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from shapely.geometry import MultiPoint, Point, Polygon

from tests.cli.command import vislam2tag
from tests.conftest import shared_folder
from tests.estimation.dead_reckoning.ilc20 import make_site, trace
from tests.estimation.dead_reckoning.walks import corners
from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import FaultKind
from vislam2tag.labeling.tables import trajectory_of
from vislam2tag.pipeline.datasets.build import build_dataset
from vislam2tag.pipeline.labels import survey_evidence
from vislam2tag.pipeline.labels.check import check
from vislam2tag.pipeline.labels.diagnose import diagnose
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.formats.ilc20 import Ilc20Trace, parse_trace
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.site.plans.drawing import placed, read_drawing
from vislam2tag.site.plans.source import Use

T = 1574149352000
MS = 1_000_000


def parsed(*records: str, end: str = "\n") -> Ilc20Trace:
    site = "#\tSiteID:5d\tSiteName:杭州\tFloorId:5e\tFloorName:F4\n"
    head = f"#\tstartTime:{T}\n{site}#\tBrand:OPPO\tModel:PBCM10\n"
    return parse_trace((head + "\n".join(records) + end).encode(), "a.txt")


def wifi(at_ms: int, seen_ms: int | str, bssid: str = "04:40:a9:a1:6b:73", rssi: str = "-43", ssid: str = "JOY") -> str:
    seen = seen_ms if isinstance(seen_ms, str) else T + seen_ms
    return f"{T + at_ms}\tTYPE_WIFI\t{ssid}\t{bssid}\t{rssi}\t2437\t{seen}"


def waypoint(at_ms: int, x: float, y: float) -> str:
    return f"{T + at_ms}\tTYPE_WAYPOINT\t{x}\t{y}"


def kinds(found: Ilc20Trace) -> dict[str, tuple[int, ...]]:
    return {finding.kind: finding.lines for finding in found.findings}


def test_records_of_each_type() -> None:
    found = parsed(
        waypoint(0, 1.5, 2.5), wifi(900, 300), f"{T + 950}\tTYPE_ACCELEROMETER\t1\t2\t3\t3", waypoint(1000, 3, 4)
    )
    assert found.header == {"SiteName": "杭州", "FloorName": "F4", "Brand": "OPPO", "Model": "PBCM10"}
    assert found.taps.time_ns.tolist() == [T * MS, (T + 1000) * MS]
    assert found.taps.position_bcs.tolist() == [[1.5, 2.5], [3, 4]]
    row = found.wifi.row(0, named=True)
    assert (row["bssid"], row["ssid"], row["rssi_dbm"], row["frequency_mhz"]) == ("04:40:a9:a1:6b:73", "JOY", -43, 2437)
    assert found.sensors.select("time_ns", "sensor", "v1", "v2", "v3", "v4", "repeated").rows() == [
        ((T + 950) * MS, "ACC", 1.0, 2.0, 3.0, 0.0, False)
    ]
    assert (found.first_ns, found.last_ns) == (T * MS, (T + 1000) * MS)
    assert not found.findings


def test_a_result_has_the_time_when_it_was_received_not_logged() -> None:
    found = parsed(wifi(9000, 2500), wifi(9000, 8999, bssid="04:40:a9:a1:6b:74"))
    assert found.wifi["time_ns"].to_list() == [(T + 2500) * MS, (T + 8999) * MS]
    assert found.wifi["scan"].to_list() == [1, 1]


@pytest.mark.parametrize("seen", ["0", str(T + 9500), str(T - 700_000), ""])
def test_a_lastseen_on_another_clock_is_a_finding(seen: str) -> None:
    found = parsed(waypoint(0, 1, 2), wifi(9000, seen))
    assert found.wifi["time_ns"].to_list() == [(T + 9000) * MS]
    assert kinds(found) == {"unusable_lastseen": (5,)}


def test_a_reading_that_several_scans_report_counts_once_though_its_time_jitters() -> None:
    found = parsed(wifi(2000, 1500), wifi(4000, 1501), wifi(6000, 1499), wifi(8000, 7000))
    assert found.wifi.sort("time_ns")["repeated"].to_list() == [False, True, True, False]
    assert found.wifi["scan"].to_list() == [1, 2, 3, 4]


@pytest.mark.parametrize("before", ["", "x\ty\n"])
def test_records_that_a_missing_newline_joined_are_taken_apart(before: str) -> None:
    records = (f"{T + 5}\tTYPE_GYROSCOPE\t1\t2\t3\t3", wifi(900, 300), waypoint(1000, 3, 4), wifi(2000, 1900))
    apart = parsed(*records)
    joined = parsed(before + records[0] + records[1], records[2] + records[3])
    assert joined.wifi.drop("row").equals(apart.wifi.drop("row"))
    assert joined.taps.position_bcs.tolist() == apart.taps.position_bcs.tolist()
    first = 5 if before else 4
    assert kinds(joined)["joined_records"] == (first, first + 1)
    assert kinds(joined).get("malformed_lines") == ((4,) if before else None)


def test_names_may_hold_anything_but_a_tab() -> None:
    names = ['"quoted', "思达数学", "", "#hash", "a;b,c", "\ufffd"]
    found = parsed(*(wifi(900 + n, 300, bssid=f"04:40:a9:a1:6b:0{n}", ssid=name) for n, name in enumerate(names)))
    assert found.wifi["ssid"].to_list() == names
    assert not found.findings


def test_lines_that_are_no_records_are_counted() -> None:
    found = parsed(
        "",
        wifi(900, 300, rssi="loud"),
        f"{T}\tTYPE_WAYPOINT\t1\n",
        "one two",
        "x\tTYPE_WIFI",
        f"{T}\tTYPE_UNHEARD_OF\t1",
        wifi(901, 300),
    )
    assert kinds(found) == {"malformed_lines": (5, 6, 8, 9)}
    assert found.wifi.height == 1


def test_a_cut_last_line_and_windows_lines() -> None:
    text = "\r\n".join((waypoint(0, 1, 2), wifi(900, 300), f"{T + 1000}\tTYPE_WAYPO"))
    found = parse_trace(text.encode(), "a.txt")
    assert found.wifi["time_ns"].to_list() == [(T + 300) * MS]
    assert not kinds(found)  # a type that is not known, not a broken record
    assert kinds(parsed(waypoint(0, 1, 2), f"{T + 1000}\tTYPE_WAYPOINT\t1.2", end="")) == {"partial_last_line": (5,)}


def test_an_advertisement_that_is_logged_twice_counts_once_with_its_beacons_name() -> None:
    mac, uuid = "DC:0D:30:4E:B8:72", "FDA50693-A4E2-4FB1-AFCF-C6EB07647825"
    found = parsed(
        f"{T + 5}\tTYPE_BLUE\t\t{mac}\t-81",
        f"{T + 6}\tTYPE_BEACON\t{uuid}\t10065\t26049\t-58\t-81\t11.9\t{mac}\t{T + 6}",
        f"{T + 7}\tTYPE_BLUE\tTV\t00:00:00:00:00:01\t-60",
        f"{T + 500}\tTYPE_BLUE\t\t{mac}\t-82",
    )
    assert found.ble.select("address", "name", "uuid", "major", "minor", "rssi_dbm", "repeated").rows() == [
        (mac.lower(), "", uuid.lower(), 10065, 26049, -81.0, False),
        ("00:00:00:00:00:01", "TV", None, None, None, -60.0, False),
        (mac.lower(), "", uuid.lower(), 10065, 26049, -82.0, False),
    ]


def test_a_level_that_no_radio_measures_is_null() -> None:
    assert parsed(wifi(900, 300, rssi="127")).wifi["rssi_dbm"].to_list() == [None]


@pytest.mark.parametrize("data", [b"", b"\n", b"\xff\xfe\x00", b"\tTYPE_WIFI", b"1\tTYPE_"])
def test_nothing_breaks_it(data: bytes) -> None:
    found = parse_trace(data, "a.txt")
    assert len(found.taps.time_ns) == found.wifi.height == found.ble.height == 0
    assert re.match(r"\(.*\)", str(found.findings))


def test_a_site_is_a_survey_of_its_traces(tmp_path: Path) -> None:
    survey = open_survey(make_site(tmp_path / "site1"))
    (floor,) = survey.site.floors
    assert (floor.number, floor.name, floor.width_m, floor.height_m) == (0, "F1", 60.0, 40.0)
    assert [str(ref.key) for ref in survey.sessions] == ["floor 0 / OPPO PBCM10 / a", "floor 0 / OPPO PBCM10 / b"]
    session = read_session(survey.sessions[0])
    assert session.camera.fixes is not None
    assert session.camera.fixes.position_bcs.tolist()[:2] == [[5.0, 5.0], [25.0, 5.0]]
    assert session.camera.time_ns[0] == 1_574_149_352_000_000_000
    assert session.tables["wifi"]["time_ns"].to_list() == [session.camera.time_ns[0] + 2_000_000_000]
    assert not session.findings


def test_a_floor_without_a_number_is_left_out_and_said(tmp_path: Path) -> None:
    site = make_site(tmp_path / "site1")
    shutil.copytree(site / "F1", site / "Mezzanine")
    survey = open_survey(site)
    assert [(finding.kind, finding.file) for finding in survey.findings] == [("unknown_floor", "Mezzanine")]
    assert len(survey.sessions) == 2


def with_wrong_tap(site: Path) -> Path:
    """The site with a further walk, of five taps, of which the third lies 9 m beside the way."""
    way = np.add(corners((10, 0), (0, 10), (10, 0), (0, 10), (10, 0), (0, 10)), (2.0, 2.0))
    text = trace(way)
    x, y = way[3]
    wrong = text.replace(f"TYPE_WAYPOINT\t{x}\t{y}", f"TYPE_WAYPOINT\t{x + 9}\t{y}")
    assert wrong != text
    (site / "F1" / "path_data_files" / "c.txt").write_text(wrong, encoding="utf-8")
    return site


def test_check_and_diagnosis_leave_out_each_tap_and_name_the_wrong_one(tmp_path: Path) -> None:
    site = with_wrong_tap(make_site(tmp_path / "site1"))
    checked = check(site)
    assert checked.failed == 0
    assert not checked.bad_landmarks
    good, wrong = checked.sessions[0], checked.sessions[2]
    assert (good.fixes, good.doubtful_fixes) == (4, [])
    assert good.estimated_m is not None
    assert good.low_m is not None
    assert 0 < good.low_m < good.estimated_m < 3
    assert [fix.size_m for fix in wrong.doubtful_fixes] == [pytest.approx(9, rel=0.25)]
    (fault,) = diagnose(site).faults
    assert fault.kind == FaultKind.DOUBTFUL_FIX
    assert fault.sessions == ["floor 0 / OPPO PBCM10 / c"]
    assert wrong.doubtful_fixes[0].name in fault.summary


def test_diagnosis_says_how_many_walks_it_left_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(survey_evidence, "MOST_WALKS", 1)
    done = vislam2tag("diagnose", make_site(tmp_path / "site1"))
    assert "(sessions: 1 of 2)" in done.stdout


def test_a_walk_without_two_taps_is_told_by_check(tmp_path: Path) -> None:
    site = make_site(tmp_path / "site1")
    file = site / "F1" / "path_data_files" / "a.txt"
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(line for line in lines if "WAYPOINT" not in line), encoding="utf-8")
    assert [session.error is None for session in check(site).sessions] == [False, True]


def test_what_a_trace_lacks_is_said(tmp_path: Path) -> None:
    site = make_site(tmp_path / "site1")
    trace = site / "F1" / "path_data_files" / "a.txt"
    lines = trace.read_text(encoding="utf-8").splitlines(keepends=True)
    trace.write_text("".join(line for line in lines if "WAYPOINT" not in line), encoding="utf-8")
    (site / "F1" / "floor_info.json").write_text("{}", encoding="utf-8")
    survey = open_survey(site)
    assert [finding.kind for finding in survey.findings] == ["floor_without_size"]
    assert [finding.kind for finding in read_session(survey.sessions[0]).findings] == ["too_few_fixes"]
    trace.write_text("".join(line for line in lines if "GYRO" not in line), encoding="utf-8")
    with pytest.raises(SessionError, match=r"a\.txt: accelerometer or gyroscope readings are missing"):
        read_session(survey.sessions[0])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A made site, processed by the strategy that chooses itself."""
    scratch = tmp_path_factory.mktemp("ilc20")
    process(make_site(scratch / "site1"), scratch / "out")
    return scratch / "out"


def test_a_site_is_processed_end_to_end(run: Path) -> None:
    summary = json.loads((run / "summary.json").read_bytes())
    assert (summary["sessions"], summary["failed"]) == (2, 0)
    assert summary["frames"].keys() == {"ok"}
    table = pl.read_parquet(run / "trajectory" / "floor_0.OPPO-PBCM10.a.parquet")
    trajectory = trajectory_of(table)
    corner_ns = 1_574_149_352_000_000_000 + round(20 / 1.2 * 1e9)
    at = int(np.argmin(np.abs(trajectory.time_ns - corner_ns)))
    assert np.linalg.norm(trajectory.position_bcs[at, :2] - (25, 5)) < 0.6
    wifi = pl.read_parquet(run / "wifi" / "floor_0.OPPO-PBCM10.a.parquet")
    assert wifi["status"].to_list() == ["ok"]
    assert wifi.select("x", "y").row(0) == pytest.approx((5 + 2 * 1.2, 5), abs=0.8)
    assert (run / "report.html").is_file()


def test_its_labels_make_a_data_set_with_the_day_of_each_walk_and_say_what_it_lacks(run: Path, tmp_path: Path) -> None:
    dataset = build_dataset([run], tmp_path / "dataset")
    sessions, fingerprints = (
        pl.read_parquet(tmp_path / f"dataset/{name}.parquet") for name in ("sessions", "fingerprints")
    )
    assert sessions["started"].to_list() == [datetime(2019, 11, 19, 7, 42, 32)] * 2
    assert fingerprints["date"].to_list() == [date(2019, 11, 19)] * 2
    dropped = [each.message for each in dataset.info.findings if each.kind == "imu_windows_dropped"]
    assert dropped == ["windows of inertial readings were skipped: no_tracker"]


def test_inspection_finds_walks_with_taps_usable_and_those_without_not(tmp_path: Path) -> None:
    site = make_site(tmp_path / "site1")
    shown = vislam2tag("inspect", site)
    assert shown.returncode == 0
    assert shown.stdout.count("4 fixes") == 2
    file = site / "F1" / "path_data_files" / "a.txt"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("TYPE_WAYPOINT", "TYPE_TAP"), encoding="utf-8")
    assert vislam2tag("inspect", site).returncode == 1


@pytest.fixture(scope="module")
def real_site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three real walks of one floor."""
    scratch = tmp_path_factory.mktemp("real")
    site = folder_of(shared_folder("ilc20") / "site2-F4.tar.xz", Folder.at(scratch)) / "site2"
    for file in sorted((site / "F4" / "path_data_files").iterdir())[3:]:
        file.unlink()
    return site


def test_the_outlines_of_a_real_floor_are_its_plan_and_taps_lie_between_them(real_site: Path) -> None:
    survey = open_survey(real_site)
    (floor,) = survey.site.floors
    assert floor.plan is not None
    assert floor.source is not None
    drawing, bcs_T_plan = placed(read_drawing(floor.plan, floor.source), floor.source, None)
    camera = read_session(survey.sessions[0]).camera
    assert camera.fixes is not None
    taps = [Point(*place) for place in camera.fixes.position_bcs.tolist()]
    outlines = [(each.use, Polygon(bcs_T_plan @ each.outline)) for each in drawing.polygons]
    shops = [shape for use, shape in outlines if use is Use.OBSTACLE]
    assert len(shops) > 50
    assert not any(shop.contains(tap) for shop in shops for tap in taps)
    assert any(shape.contains(MultiPoint(taps)) for use, shape in outlines if use is not Use.OBSTACLE)


def test_real_walks_pass_their_taps_and_make_a_data_set(real_site: Path, tmp_path: Path) -> None:
    labels, dataset = tmp_path / "labels", tmp_path / "dataset"
    assert process(real_site, labels).failed == 0
    errors = []
    for ref, file in zip(open_survey(real_site).sessions, sorted(labels.glob("trajectory/*")), strict=True):
        taps = read_session(ref).camera.fixes
        assert taps is not None
        trajectory = trajectory_of(pl.read_parquet(file))
        since = trajectory.time_ns - taps.time_ns[0]
        path = [np.interp(taps.time_ns - taps.time_ns[0], since, trajectory.position_bcs[:, axis]) for axis in (0, 1)]
        errors.append(np.linalg.norm(np.column_stack(path) - taps.position_bcs, axis=1))
    assert 0.1 < np.mean(np.concatenate(errors)) < 1.0
    build_dataset(labels, dataset)
    scans = pl.read_parquet(dataset / "fingerprints.parquet")
    assert set(scans["technology"]) == {"ble", "wifi"}
    assert set(scans["status"]) <= {"ok", "uncertain", "outside_frames"}
    assert np.isfinite(scans["x"].to_numpy()).mean() > 0.9
