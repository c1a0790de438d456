"""The catalogue: whole snapshots, no change lost, and a status that costs the same however large the fleet is.

Two processes work on one fleet at once, each on another survey, as one Kubernetes Job for each survey does.
"""

from __future__ import annotations

import subprocess
import sys
from datetime import date
from pathlib import Path
from threading import Thread

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.fleet.conftest import SmallFleet
from tests.pipeline.fleet.trees import COLUMNS_OF_TIMES, tree_of
from tests.stores import Bucket, Fault
from vislam2tag.pipeline.fleet.catalogue import CATALOGUE, FLEET_FILE, SNAPSHOTS, Fleet

LARGE, SESSIONS_EACH = 20_000, 50


def row(number: int, state: str = "done") -> dict[str, object]:
    blank = dict.fromkeys(CATALOGUE, None) | {
        "survey": f"s{number:06d}",
        "site": f"Site {number // 20}",
        "state": state,
    }
    counts = {"sessions": SESSIONS_EACH, "failed": 0, "frames": 10, "frames_labelled": 9}
    return blank | counts | {"floors": [1, 2], "devices": ["LG"], "duration_s": 1.0, "distance_m": 2.0, "labels": "key"}


def test_status_reads_one_small_file_however_large_the_fleet_is(s3: Bucket) -> None:
    store = s3.store("large-fleet")
    Fleet(Path(store.address)).change([row(number) for number in range(LARGE)])
    s3.seen()
    done = vislam2tag("fleet", "status", store.address)
    assert done.stdout.splitlines()[0] == f"{LARGE} surveys, {LARGE * SESSIONS_EACH} sessions (0 failed)"
    assert s3.seen() == [f"GET /bucket/large-fleet/{FLEET_FILE}"]
    found = store.get(FLEET_FILE)
    assert found is not None
    assert len(found.data) < 2000


def test_the_catalogue_says_site_floors_devices_dates_sessions_and_state(
    fleet: SmallFleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    rows = {each["survey"]: each for each in Fleet(Path(fleet.address)).catalogue().to_dicts()}
    ward = rows["ward"]
    assert (ward["floors"], ward["devices"], ward["sessions"]) == ([0, 1], ["LG"], 2)
    assert (ward["first_date"], ward["last_date"]) == (date(2021, 12, 20), date(2021, 12, 21))
    assert (ward["state"], ward["failed"]) == ("done", 0)
    assert rows["hall"]["devices"] == ["LG", "OnePlus"]
    shown = vislam2tag("fleet", "list", fleet.address).stdout
    assert "2021-12-20 to 2021-12-21" in shown


@pytest.mark.parametrize("place", ["folder", "bucket"])
def test_changes_at_the_same_time_are_all_there_and_old_snapshots_go(place: str, s3: Bucket, tmp_path: Path) -> None:
    fleet = Fleet(tmp_path if place == "folder" else Path(s3.store("busy-fleet").address))
    threads = [Thread(target=fleet.change, args=([row(number)],)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert fleet.catalogue()["survey"].to_list() == [f"s{number:06d}" for number in range(8)]
    record = fleet.record()
    assert record.number == 8
    there = {file.name for file in fleet.store.list(SNAPSHOTS)}
    assert there == {record.snapshot, *record.before}
    assert len(there) == 5


def test_a_change_that_cannot_be_finished_changes_nothing(s3: Bucket) -> None:
    fleet = Fleet(Path(s3.store("cut-short-fleet").address))
    fleet.change([row(1)])
    s3.fail(Fault("PUT /bucket/cut-short-fleet/fleet.json", "403 AccessDenied"))
    with pytest.raises(Exception, match="permission is denied"):
        fleet.change([row(1, "failed"), row(2)])
    assert fleet.catalogue().select("survey", "state").rows() == [("s000001", "done")]


def test_snapshots_are_plain_parquet_files(fleet: SmallFleet) -> None:
    record = Fleet(Path(fleet.address)).record()
    found = fleet.s3.store(fleet.name).get(record.snapshot)
    assert found is not None
    assert pl.read_parquet(found.data).schema == pl.Schema(CATALOGUE)


@pytest.mark.parametrize("damage", ["cut", "null", "columns"])
def test_a_damaged_catalogue_is_one_message(damage: str, tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet")
    fleet.change([row(1)])
    (snapshot,) = (tmp_path / "fleet" / SNAPSHOTS).iterdir()
    whole = pl.read_parquet(snapshot)
    if damage == "cut":
        snapshot.write_bytes(snapshot.read_bytes()[:-20])
    else:
        changed = whole.drop("site") if damage == "columns" else whole.with_columns(frames_labelled=None)
        changed.cast(pl.Schema({name: CATALOGUE[name] for name in changed.columns})).write_parquet(snapshot)
    for verb in ("list", "report"):
        told = vislam2tag("fleet", verb, fleet.root)
        assert f"{snapshot.name}: the catalogue is damaged; remove fleet.json there" in the_error(told)


@pytest.mark.parametrize("place", ["folder", "bucket"])
def test_two_surveys_at_once_are_as_one_after_the_other(place: str, fleet: SmallFleet, tmp_path: Path) -> None:
    store = str(tmp_path / "small-fleet") if place == "folder" else fleet.s3.store("at-once/small-fleet").address
    assert vislam2tag("fleet", "add", store, *fleet.surveys.values()).returncode == 0
    command = [sys.executable, "-m", "vislam2tag", "fleet", "process", store, "--jobs", "1", "--config"]
    running = [
        subprocess.Popen([*command, str(fleet.config), "--survey", name], stderr=subprocess.PIPE, text=True)
        for name in fleet.surveys
    ]
    errors = [process.communicate(timeout=300)[1] for process in running]
    assert [process.returncode for process in running] == [0, 0], errors
    here, alone = (Fleet(Path(each)).catalogue().drop(COLUMNS_OF_TIMES) for each in (store, fleet.address))
    assert here.equals(alone)
    assert here["state"].to_list() == ["done", "done"]
    assert vislam2tag("fleet", "report", store).returncode == 0
    there = tree_of(Path(fleet.address), tmp_path / "alone")
    assert tree_of(Path(store), tmp_path / "at-once") == there
