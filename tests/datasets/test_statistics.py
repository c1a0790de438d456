from __future__ import annotations

import csv
import io
from dataclasses import replace

import polars as pl
import pytest

from tests.datasets.factory import SCANS, bssid, small_dataset
from vislam2tag.datasets import statistics_record as record
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, empty_table
from vislam2tag.datasets.statistics import dataset_statistics


def with_table(dataset: Dataset, name: str, **columns: pl.Expr) -> Dataset:
    return replace(dataset, tables={**dataset.tables, name: dataset.tables[name].with_columns(**columns)})


@pytest.fixture(scope="module")
def statistics() -> record.DatasetStatistics:
    return dataset_statistics(small_dataset(unlabelled=2))


def test_table_iii_sums_walks_by_device(statistics: record.DatasetStatistics) -> None:
    assert list(statistics.by_device) == ["Galaxy", "Pixel"]
    galaxy = statistics.by_device["Galaxy"]
    assert (galaxy.trajectories, galaxy.duration_s, galaxy.distance_m, galaxy.velocity_m_s) == (2, 72.0, 72.0, 1.0)
    assert statistics.walks.trajectories == 4
    assert statistics.walks.labelled_m == 4 * 30.0


def test_figure_8_counts_fingerprints_by_device_and_floor(statistics: record.DatasetStatistics) -> None:
    wifi = statistics.technologies["wifi"]
    assert (wifi.labels.fingerprints, wifi.labels.labelled) == (4 * SCANS, 4 * (SCANS - 2))
    assert {device: labels.labelled for device, labels in wifi.by_device.items()} == {"Galaxy": 20, "Pixel": 20}
    # What has no label counts on the floor of its walk.
    assert [(floor.floor, floor.labels.fingerprints) for floor in wifi.by_floor] == [(0, 24), (1, 24)]
    assert wifi.by_floor[1].by_device["Pixel"].share == pytest.approx(10 / 12, abs=1e-6)
    assert wifi.statuses == {"after_last_landmark": 8, "ok": 40}


def test_access_points_a_fingerprint_are_distinct_and_empty_scans_count() -> None:
    dataset = small_dataset()
    readings = dataset.readings.collect()
    first = readings["scan_id"][0]
    again = readings.filter(pl.col("scan_id") == first)
    doubled = pl.concat([readings, again])
    before = dataset_statistics(dataset).technologies["wifi"]
    after = dataset_statistics(replace(dataset, tables={**dataset.tables, READINGS: doubled.lazy()})).technologies[
        "wifi"
    ]
    assert after.heard == before.heard
    assert after.readings == before.readings + len(again)
    silent = doubled.filter(pl.col("scan_id") != first).lazy()
    quiet = dataset_statistics(replace(dataset, tables={**dataset.tables, READINGS: silent})).technologies["wifi"]
    assert quiet.heard.counts[0] == 1


def test_a_deaf_phone_shows_in_its_offset() -> None:
    dataset = small_dataset()
    fingerprints, readings = (
        dataset.tables[name].with_columns(y=pl.when(pl.col("x").is_not_null()).then(10.0)).collect()
        for name in (FINGERPRINTS, READINGS)
    )
    pixel = pl.col("scan_id").str.contains("Pixel")
    # Both phones now walk the same line and hear the same, but for 6 dB.
    same = readings.filter(~pixel)
    other = same.with_columns(pl.col("scan_id").str.replace("Galaxy", "Pixel"), pl.col("rssi_dbm") - 6)
    tables = {**dataset.tables, FINGERPRINTS: fingerprints.lazy(), READINGS: pl.concat([same, other]).lazy()}
    rssi = dataset_statistics(replace(dataset, tables=tables)).technologies["wifi"].rssi
    assert rssi["Galaxy"].offset_db == pytest.approx(3.0)
    assert rssi["Pixel"].offset_db == pytest.approx(-3.0)
    assert rssi["Galaxy"].rssi_dbm.mean - rssi["Pixel"].rssi_dbm.mean == pytest.approx(6.0)


def test_person_hours_count_the_walks_unless_the_field_work_is_told() -> None:
    dataset = small_dataset()
    walking = dataset_statistics(dataset)
    told = dataset_statistics(dataset, record.FieldWork(people=2, hours=1.5))
    assert walking.effort is not None
    assert told.effort is not None
    assert (walking.effort.basis, walking.effort.person_hours) == ("walking time", 4 * 36 / 3600)
    assert (told.effort.basis, told.effort.person_hours) == ("total time", 3.0)
    wifi = told.technologies["wifi"]
    assert wifi.labelled_per_person_hour == pytest.approx(44 / 3, abs=1e-4)
    assert wifi.labelled_per_minute == pytest.approx(44 / (4 * 36 / 60), abs=1e-4)
    assert told.effort.labelled_m_per_minute == pytest.approx(4 * 33 / (4 * 36 / 60))


def test_walks_without_duration_do_not_enter_rates() -> None:
    dataset = small_dataset()
    timed = pl.when(pl.col("session") == "floor_0.Galaxy.walk").then(pl.col("duration_s"))
    some = dataset_statistics(with_table(dataset, SESSIONS, duration_s=timed))
    assert some.technologies["wifi"].labelled_per_minute == pytest.approx(11 / 0.6, abs=1e-4)
    points = dataset_statistics(with_table(dataset, SESSIONS, distance_m=pl.lit(None, pl.Float64)))
    assert (points.effort, points.walks.duration_s) == (None, 4 * 36)
    none = dataset_statistics(with_table(dataset, SESSIONS, duration_s=pl.lit(None, pl.Float64)))
    assert none.effort is None
    assert none.walks.velocity_m_s is None
    assert none.technologies["wifi"].labelled_per_person_hour is None


def test_devices_and_floors_that_nobody_names_are_counted_all_the_same() -> None:
    dataset = with_table(small_dataset(), FINGERPRINTS, device=pl.lit(None, pl.String))
    found = dataset_statistics(with_table(dataset, SESSIONS, floor=pl.lit(None, pl.Int32))).technologies["wifi"]
    assert list(found.by_device) == ["unknown"]
    assert [(floor.floor, floor.labels.fingerprints) for floor in found.by_floor] == [(0, 22), (1, 22), (None, 4)]


def test_uncertain_fingerprints_are_not_labelled_but_their_sigma_counts() -> None:
    doubtful = pl.when(pl.col("scan_id").str.ends_with("000000")).then(pl.lit("uncertain")).otherwise(pl.col("status"))
    wifi = dataset_statistics(with_table(small_dataset(), FINGERPRINTS, status=doubtful)).technologies["wifi"]
    assert wifi.labels.labelled == 40
    assert wifi.sigma is not None
    assert wifi.sigma.fingerprints == 44


def test_an_empty_set_has_statistics() -> None:
    names = (FINGERPRINTS, READINGS, ACCESS_POINTS, SESSIONS)
    empty = replace(small_dataset(), tables={name: empty_table(name).lazy() for name in names})
    found = dataset_statistics(empty)
    assert found.technologies == {}
    assert found.main is None


def test_statistics_survive_json_and_name_the_transmitters(statistics: record.DatasetStatistics) -> None:
    assert record.DatasetStatistics.model_validate_json(statistics.model_dump_json()) == statistics
    assert statistics.technologies["wifi"].transmitters == len({bssid(f, i) for f in (0, 1) for i in range(5)})


def test_whole_numbers_have_quantiles_that_occur() -> None:
    found = record.Distribution.of({-90: 1, -60: 18, -30: 1})
    assert (found.mean, found.quantiles["0.05"], found.quantiles["0.5"], found.quantiles["0.95"]) == (
        -60,
        -90,
        -60,
        -60,
    )
    assert found.deviation == pytest.approx((2 * 900 / 20) ** 0.5, abs=1e-4)


def test_bins_hold_all_numbers_and_are_no_more_than_asked_for() -> None:
    numbers = record.Distribution.of({3: 1, 4: 2, 12: 4})
    assert numbers.binned(10) == (1, {n: {3: 1, 4: 2, 12: 4}.get(n, 0) for n in range(3, 13)})
    assert numbers.binned(4) == (3, {3: 3, 6: 0, 9: 0, 12: 4})


LG = record.WalkTotals(trajectories=18, duration_s=4653.6, distance_m=3701.375, velocity_m_s=0.7954)
POINTS = record.WalkTotals(trajectories=2)
ROWS = {"LG": LG, "My_phone": POINTS}


def test_minutes_metres_and_a_dash_for_what_is_not_known() -> None:
    texts = dict(record.Table3.of(ROWS, LG).texts())
    assert texts["LG"] == ("18", "77.56", "3701.38", "0.80")
    assert texts["My_phone"] == ("2", "-", "-", "-")
    assert list(texts) == ["LG", "My_phone", "all"]


def test_the_papers_numbers_stand_beside_for_the_papers_phones() -> None:
    table = record.Table3.of(ROWS, LG, beside_paper=True)
    texts = dict(table.texts())
    assert texts["LG"] == ("18", "18", "77.56", "77.56", "3701.38", "3701.38", "0.80", "0.92")
    assert texts["My_phone"][1::2] == ("-",) * 4
    assert texts["all"][1::2] == ("81", "252.00", "11237.02", "-")
    assert table.heads[:2] == ("trajectories", "paper")


def test_csv_has_numbers_and_empty_cells() -> None:
    lines = list(csv.DictReader(io.StringIO(record.table_3_csv(record.Table3.of(ROWS, LG, beside_paper=True)))))
    assert (lines[0]["duration_min"], lines[0]["paper_velocity_m_s"]) == ("77.56", "0.92")
    assert lines[2]["paper_distance_m"] == "11237.02"
    assert (lines[1]["distance_m"], lines[1]["paper_trajectories"]) == ("", "")
    assert "paper" not in record.table_3_csv(record.Table3.of(ROWS, LG))


def test_latex_escapes_and_rules_off_the_total() -> None:
    text = record.table_3_latex(record.Table3.of(ROWS, LG))
    assert "My\\_phone & 2 & - & - & - \\\\\n\\midrule\nall & 18" in text
    assert text.count("&") == 4 * 4


def test_markdown_has_a_column_for_each_head() -> None:
    head, rule, *rows = record.table_3_markdown(record.Table3.of(ROWS, LG)).splitlines()[2:]
    assert {line.count("|") for line in (head, rule, *rows)} == {6}


def test_the_papers_totals_are_sums_of_its_rows() -> None:
    devices = [numbers for device, numbers in record.PAPER.items() if device != record.ALL]
    sums = [round(sum(number or 0 for number in column), 2) for column in zip(*devices, strict=True)]
    assert sums[:3] == list(record.PAPER[record.ALL])[:3]
