"""giaIndoorLoc's labelled layout: as the published program writes it, and back into a data set."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.datasets.formats.round_trip import imported
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.annotated_tables import wifi_rows
from vislam2tag.datasets.format_registry import ExportContext, export_named, import_format_of
from vislam2tag.datasets.labelled import open_labelled
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy, hashed
from vislam2tag.pipeline.datasets.build import build_dataset
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.model import SessionKey

KEY = b"0123456789abcdef"


def exported(labels: Path, folder: Path, **context: object) -> tuple[Finding, ...]:
    writer = export_named("gia").write_labels
    assert writer is not None
    return writer(labels, Folder.at(folder), ExportContext(**context))  # type: ignore[arg-type]


def tables_of(folder: Path, name: str) -> list[Path]:
    return sorted(folder.rglob(name))


@pytest.fixture(scope="module")
def annotated(labels: Path, survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gia") / "out"
    exported(labels, folder, survey=survey)
    return folder


@pytest.fixture(scope="module")
def built(labels: Path, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return build_dataset(labels, tmp_path_factory.mktemp("built") / "set")


@pytest.mark.parametrize("table", ["wifi", "sensors"])
def test_rows_are_those_of_the_published_program(
    labels_as_published: Path, agreement: Path, tmp_path: Path, table: str
) -> None:
    """The same rows in the same order, blanks aside; repeated rows lose their position: they count once."""
    exported(labels_as_published, tmp_path / "out")
    theirs = tables_of(agreement / "published-output", f"{table}_annotated.csv")
    assert len(theirs) in (2, 6)
    for file in theirs:
        ours = tmp_path / "out" / file.relative_to(agreement / "published-output")
        a, b = (pl.read_csv(each, infer_schema=False).select(pl.all().str.strip_chars()) for each in (ours, file))
        texts = [name for name in a.columns if not name.endswith("_coord") and not name.startswith("v")]
        key = [name for name in ("time", "mac", "type") if name in texts]
        a, b = (each.sort(*key, maintain_order=True) for each in (a, b))
        assert a.columns == b.columns
        assert_frame_equal(a.select(texts), b.select(texts))
        numbers = [name for name in a.columns if name not in texts]
        repeated = a.select(pl.struct(key).is_first_distinct().not_()).to_series()
        ours_known, theirs_known = (each.filter(~repeated).select(numbers).cast(pl.Float64) for each in (a, b))
        assert_frame_equal(ours_known, theirs_known, abs_tol=0.001, rel_tol=0.0)


def test_a_data_set_of_it_is_the_one_built_from_the_labels(annotated: Path, built: Dataset, tmp_path: Path) -> None:
    """Up to what the layout cannot hold: heights, headings, speeds, and rows outside the mapped part."""
    assert import_format_of(annotated).name == "gia"
    back = imported("gia", annotated, tmp_path / "scratch")
    known = pl.col("x").is_not_null()
    ours, theirs = (each.fingerprints.filter(known).collect() for each in (back, built))
    lost = ["z", "heading_deg", "speed_m_s", "readings", "labelled_share"]
    whole = theirs["labelled_share"] == 1.0
    assert whole.sum() > 10
    assert_frame_equal(ours.drop(lost).filter(whole), theirs.drop(lost).filter(whole))
    assert ours["x"].to_list() == pytest.approx(theirs["x"].to_list())
    readings, others = (each.readings.filter(known).collect() for each in (back, built))
    assert_frame_equal(readings, others)
    for name in ("bssid", "floors"):
        assert_frame_equal(*(each.access_points.select(name).collect() for each in (back, built)))
    magnetic, field = (each.tables["magnetic"].filter(known).drop("z").collect() for each in (back, built))
    whole = field["readings"] == magnetic["readings"]  # the last windows are cut by the end of the mapped part
    assert (~whole).sum() <= 2
    assert_frame_equal(magnetic.filter(whole), field.filter(whole))
    assert back.info.floors == tuple(
        floor.model_copy(update={"plan": f"plans/floor_{floor.number}.jpg"}) for floor in built.info.floors
    )


def test_names_of_networks_come_back_however_odd(annotated: Path, labels: Path) -> None:
    for session in open_labelled(labels).sessions:
        floor, device, name = session.slug.split(".")
        key = SessionKey(int(floor.removeprefix("floor_")), device, name)
        file = next(file for file in annotated.rglob("wifi_annotated.csv") if file.parts[-4] == floor)
        back = wifi_rows(file, key)
        heard = session.table("wifi", ("time_ns", "row", "bssid", "ssid", "status")).sort("time_ns", "row")
        inside = heard.filter(~pl.col("status").is_in(["after_last_landmark", "outside_frames"]))
        assert back["ssid"].to_list() == inside["ssid"].to_list()
        assert {" spaced ", '"quoted", name'} <= set(back["ssid"])


def test_raw_files_lie_beside(annotated: Path, survey: Path) -> None:
    for raw in survey.rglob("*.csv"):
        assert (annotated / raw.relative_to(survey)).read_bytes() == raw.read_bytes()


def test_blanks_that_lead_published_fields(tmp_path: Path) -> None:
    folder = tmp_path / "floor_4" / "Galaxy" / "2021-12-20T14:17:21"
    folder.mkdir(parents=True)
    lines = [
        "id,time,type,ssid,mac,rss,x_coord,y_coord",
        '7,19001105428000, WLAN," a, ""b""", f5:81:c1:90:2d:83,-47,1.5,2.0',
        "7,19001105428000, WLAN,  blank, 00:81:c1:90:2d:83,-47.0,1.5,2.0",
        "7,19001105428000, WLAN, eduroam, f5:81:c1:90:2d:83,-47,1.5,2.0",
        "8,1.9005e13, WLAN, , f5:81:c1:90:2d:83,-50,,",
        "9,19009105428000, WLAN, x, f5:81:c1:90:2d:83,-50,nan,nan",
    ]
    (folder / "wifi_annotated.csv").write_text("\n".join(lines) + "\n")
    back = imported("gia", tmp_path, tmp_path / "scratch")
    rows = back.fingerprints.collect()
    assert rows["status"].to_list() == ["ok", "after_last_landmark", "after_last_landmark"]
    assert rows["readings"].to_list() == [2, 1, 1]
    assert rows["start_ns"][1] == 19_005_000_000_000
    assert rows["session"][0] == "floor_4.Galaxy.2021-12-20T141721"
    names = dict(back.access_points.select("bssid", "ssid").collect().rows())
    assert names == {"00:81:c1:90:2d:83": " blank", "f5:81:c1:90:2d:83": 'a, "b"'}
    assert rows["date"][0] is not None


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "floor_4" / "Galaxy" / "walk"
    folder.mkdir(parents=True)
    (folder / "wifi_annotated.csv").write_text("id,time,type,ssid,mac,rss\n")
    with pytest.raises(DatasetError, match=r"wifi_annotated\.csv: line 1: expected id,time,type"):
        imported("gia", tmp_path, tmp_path / "scratch")


def test_a_table_in_no_sessions_folder(tmp_path: Path) -> None:
    (tmp_path / "wifi_annotated.csv").touch()
    with pytest.raises(DatasetError, match="not in a folder floor_K/DEVICE/SESSION"):
        imported("gia", tmp_path, tmp_path / "scratch")


def test_uncertain_rows_and_those_on_other_floors_lose_their_position(labels: Path, tmp_path: Path) -> None:
    shutil.copytree(labels, tmp_path / "labels")
    for file in (tmp_path / "labels" / "wifi").iterdir():
        rows = pl.read_parquet(file)
        known = pl.col("x").is_not_null()
        third = known & (known.cum_sum() % 3 == 0)
        status = pl.when(third).then(pl.lit("uncertain")).otherwise("status").alias("status")
        floor = pl.when(known & (known.cum_sum() == 1)).then(pl.lit(7, pl.Int32)).otherwise("floor").alias("floor")
        rows.with_columns(status, floor).write_parquet(file)
    findings = {finding.kind: finding.count for finding in exported(tmp_path / "labels", tmp_path / "out")}
    tables = [pl.read_csv(file) for file in tables_of(tmp_path / "out", "wifi_annotated.csv")]
    before = sum(session.table("wifi", ("x",))["x"].count() for session in open_labelled(labels).sessions)
    assert findings["other_floor"] == 2
    assert findings["uncertain_left_out"] == pytest.approx(before / 3, abs=2)
    assert sum(table["x_coord"].count() for table in tables) == before - 2 - findings["uncertain_left_out"]


def test_what_privacy_hides_is_hidden_in_the_raw_files_too(labels: Path, survey: Path, tmp_path: Path) -> None:
    exported(labels, tmp_path / "out", survey=survey, privacy=Privacy(hash_key=KEY, keep_ssids=False))
    plain = pl.concat([session.table("wifi", ("bssid", "ssid")) for session in open_labelled(labels).sessions])
    names = [name for name in plain["ssid"].unique() if len(name) > 4]
    texts = "".join(file.read_text() for file in (tmp_path / "out").rglob("wifi*.csv"))
    assert names
    for secret in (*plain["bssid"].unique(), *names):
        assert secret not in texts
    assert hashed(plain["bssid"][0], KEY) in texts
    for annotated, raw in zip(tables_of(tmp_path / "out", "poses.csv"), tables_of(survey, "poses.csv"), strict=True):
        assert annotated.read_bytes() == raw.read_bytes()


def test_raw_files_that_may_tell_addresses_are_left_out(labels: Path, survey: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "survey")
    for name in ("ble.csv", "WiFi.csv", "notes.txt"):
        for poses in (tmp_path / "survey").rglob("poses.csv"):
            poses.with_name(name).write_text("secret\n")
    findings = exported(labels, tmp_path / "hidden", survey=tmp_path / "survey", privacy=Privacy(hash_key=KEY))
    assert {finding.kind: finding.count for finding in findings}["raw_files_left_out"] == 2 * 3
    assert not [file for file in (tmp_path / "hidden").rglob("*.*") if file.read_bytes() == b"secret\n"]
    exported(labels, tmp_path / "plain", survey=tmp_path / "survey")
    assert len(list((tmp_path / "plain").rglob("ble.csv"))) == 2


def test_another_survey_is_refused(labels: Path, survey: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "survey")
    changed = next((tmp_path / "survey").rglob("wifi.csv"))
    changed.write_bytes(changed.read_bytes() + b"0; 1; WLAN; a; b; -1\n")
    with pytest.raises(UsageError, match=r"wifi.csv has changed since the labels were made"):
        exported(labels, tmp_path / "a", survey=tmp_path / "survey")
    changed.parent.rename(changed.parent.with_name("other"))
    with pytest.raises(UsageError, match="no session floor"):
        exported(labels, tmp_path / "b", survey=tmp_path / "survey")


def test_nothing_labelled(labels: Path, tmp_path: Path) -> None:
    shutil.copytree(labels, tmp_path / "labels")
    for file in (tmp_path / "labels").glob("*/*.parquet"):
        table = pl.read_parquet(file)
        table.with_columns(x=pl.lit(None, pl.Float64), y=pl.lit(None, pl.Float64)).write_parquet(file)
    with pytest.raises(DatasetError, match="none of its readings has a position"):
        exported(tmp_path / "labels", tmp_path / "out")


def test_raw_files_of_the_phone_app_tell_nothing_that_is_hidden(tmp_path: Path) -> None:
    scenario = regular_survey(3, "none", (0,), ("LG",), 1, 40.0)
    simulate(scenario, tmp_path / "survey", WritingOptions(layout=SessionLayout.PHONE))
    process(tmp_path / "survey", tmp_path / "labels", Settings())
    exported(tmp_path / "labels", tmp_path / "plain", survey=tmp_path / "survey")
    (raw,) = tables_of(tmp_path / "survey", "WiFi.csv")
    (copied,) = tables_of(tmp_path / "plain", "WiFi.csv")
    assert copied.read_bytes() == raw.read_bytes()
    exported(tmp_path / "labels", tmp_path / "hidden", survey=tmp_path / "survey", privacy=Privacy(hash_key=KEY))
    left = {file.name for file in (tmp_path / "hidden").rglob("LG/*/*")}
    assert left.isdisjoint({"WiFi.csv", "Ble.csv", "Events.csv", "session.json"})
    assert left >= {"CameraPose.csv", "LandmarkPose.csv", "AnchorPose.csv", "Sensors.csv"}
    bssid = pl.read_csv(raw)["bssid"][0].encode()
    assert not [file for file in (tmp_path / "hidden").rglob("*.*") if file.is_file() and bssid in file.read_bytes()]
