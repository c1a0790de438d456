"""Commands between our data sets and the formats of others: ``import`` and ``export``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from tests.datasets.formats.round_trip import with_split
from tests.datasets.formats.test_fingerprint_tables import quartet_in
from tests.datasets.formats.test_getsensordata import walk
from tests.datasets.formats.test_ilc20 import trace
from vislam2tag.cli.app import app
from vislam2tag.cli.commands_formats import degrees_of, floor_words
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.format_registry import import_formats
from vislam2tag.datasets.model import FloorInfo


def test_a_summary(tmp_path: Path) -> None:
    source = quartet_in(tmp_path / "in", coordinates="1,2,5\n3,4,0\n")
    done = vislam2tag("import", source, "--out", tmp_path / "set")
    assert done.returncode == 0, done.stderr
    for line in (
        "fingerprints (wifi): 2, with a position 2",
        "readings: 2",
        "access points: 2",
        "floors: 2 (0, 1)",
        "extent: x from 1.0 to 3.0 m, y from 2.0 to 4.0 m",
        "devices: 2 (HTC One, LG)",
        "height_off_floor 1: Training_coordinates_21Aug17.csv:1: heights are not multiples of 3.7 m",
    ):
        assert line in done.stdout
    assert open_dataset(tmp_path / "set").info.name == "tampere"


@pytest.mark.parametrize(
    ("floor", "words"),
    [
        (FloorInfo(number=0), "0"),
        (FloorInfo(number=0, name="Floor 0"), "Floor 0"),
        (FloorInfo(number=3, name="F4", building="site2"), "site2 F4 (3)"),
        (FloorInfo(number=-1, building="main"), "main -1"),
    ],
)
def test_a_floor_is_told_by_name_and_number_once(floor: FloorInfo, words: str) -> None:
    assert floor_words(floor) == words


def test_json_is_the_manifest(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(walk())
    done = vislam2tag("import", tmp_path / "log.txt", "--out", tmp_path / "set", "--origin", "40.3,-3.5", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == json.loads((tmp_path / "set" / "dataset.json").read_bytes())
    assert json.loads(done.stdout)["floors"][0]["georeference"]["latitude_deg"] == 40.3


def test_files_left_out_are_exit_code_one(tmp_path: Path) -> None:
    for floor in ("F1", "BM"):
        trace(tmp_path / "in" / "mall" / floor / "path_data_files", (0, 0, 0), (4000, 8, 4))
    done = vislam2tag("import", tmp_path / "in", "--out", tmp_path / "set")
    assert done.returncode == 1
    assert "unknown_floor 1: mall/BM/path_data_files/a.txt" in done.stdout


def test_an_archive_unpacks_to_as_much_as_is_said(tmp_path: Path) -> None:
    archive = shutil.make_archive(str(tmp_path / "t"), "zip", quartet_in(tmp_path / "in"))
    done = vislam2tag("import", archive, "--out", tmp_path / "set", "--max-unpacked-gb", "1e-8")
    assert done.returncode == 2
    assert "unpacks to more than 1e-08 GB" in the_error(done)
    assert not (tmp_path / "set").exists()


def test_help_names_every_format() -> None:
    done = vislam2tag("import", "--help")
    assert done.returncode == 0
    for name in import_formats():
        assert name in done.stdout


@pytest.mark.parametrize("text", ["", "1", "a,b", "91,0", "0,181", "1,2,3", "nan,0"])
def test_origins_that_are_none(text: str) -> None:
    with pytest.raises(UsageError, match="--origin"):
        degrees_of(text, "--origin")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "set"
    write_dataset(with_split(small_dataset()), folder)
    return folder


def in_process(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["export", *map(str, arguments)])


def test_a_split_and_what_is_left_out(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("export", dataset, "--format", "uji", "--split", "by_walk", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == f"{tmp_path / 'out'}: uji, 6 files"
    assert "unlabelled_left_out 4: fingerprints without a position" in done.stdout
    assert "columns of readings are skipped: frequency_mhz, time_ns, floor, x, y, sigma (" in done.stdout
    assert " readings have them)" in done.stdout
    assert (tmp_path / "out" / "validationData.csv").is_file()
    assert (tmp_path / "out" / "export.json").is_file()


def test_a_key_hides_addresses(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "key").write_text("0123456789abcdef0123456789abcdef\n")
    hide = ("--hash-bssid", tmp_path / "key", "--no-ssid")
    done = in_process(dataset, "--format", "comford", "--out", tmp_path / "out", *hide)
    assert done.exit_code == 0, done.output
    assert "00:11:22" not in (tmp_path / "out" / "intermediate" / "RSSI.csv").read_text()


def test_an_interrupt_is_exit_code_130(dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_arguments: object, **_options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vislam2tag.api.export", interrupted)
    done = in_process(dataset, "--format", "comford", "--out", tmp_path / "out")
    assert done.exit_code == 130
    assert done.stderr == f"interrupted: nothing was written to {tmp_path / 'out'}\n"
