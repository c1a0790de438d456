"""``vislam2tag export`` as its users run it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from tests.datasets.formats.round_trip import with_split
from vislam2tag.cli.app import app
from vislam2tag.datasets.folder import write_dataset


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
    assert "columns left out of readings: frequency_mhz, time_ns, floor, x, y, sigma (" in done.stdout
    assert " readings have them)" in done.stdout
    assert (tmp_path / "out" / "validationData.csv").is_file()
    assert (tmp_path / "out" / "export.json").is_file()


def test_an_unknown_format_is_exit_code_2(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("export", dataset, "--format", "xls", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "no format called 'xls' can be written; there are: comford, " in the_error(done)
    assert not (tmp_path / "out").exists()


def test_a_key_hides_addresses(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "key").write_text("0123456789abcdef0123456789abcdef\n")
    hide = ("--hash-bssid", tmp_path / "key", "--no-ssid")
    done = in_process(dataset, "--format", "comford", "--out", tmp_path / "out", *hide)
    assert done.exit_code == 0, done.output
    assert "00:11:22" not in (tmp_path / "out" / "intermediate" / "RSSI.csv").read_text()


def test_help_lists_formats_and_examples() -> None:
    done = in_process("--help")
    assert done.exit_code == 0
    for text in ("UJIIndoorLoc's", "fingerprints.h5", "vislam2tag export labels --format gia", "Exit code"):
        assert text in " ".join(done.stdout.split())


def test_an_interrupt_is_exit_code_130(dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_arguments: object, **_options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vislam2tag.pipeline.datasets.export.export", interrupted)
    done = in_process(dataset, "--format", "comford", "--out", tmp_path / "out")
    assert done.exit_code == 130
    assert done.stderr == f"interrupted: nothing was written to {tmp_path / 'out'}\n"
