"""The card lies in the folder, with checksums that sha256sum agrees with, and the same bytes each time."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.surveys import bytes_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.dataset.card.write import write_card
from vislam2tag.dataset.description import read_description
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.statistics.dataset_statistics import dataset_statistics


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    command = ["sha256sum", "--strict", "-c", "SHA256SUMS"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_checksums_cover_every_file(described_set: Path) -> None:
    done = check(described_set)
    assert done.returncode == 0, done.stderr
    files = {path.relative_to(described_set).as_posix() for path in described_set.rglob("*") if path.is_file()}
    assert OWN_FILES in files
    assert {line.split(": ")[0] for line in done.stdout.splitlines()} == files - {"SHA256SUMS", OWN_FILES}


def test_a_changed_file_is_found(described_set: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(described_set, tmp_path / "copy"))
    with (copy / "readings.parquet").open("ab") as file:
        file.write(b"x")
    assert check(copy).returncode == 1


def test_the_same_set_gives_the_same_bytes(described_set: Path, tmp_path: Path) -> None:
    before = bytes_of(described_set)
    copy = Path(shutil.copytree(described_set, tmp_path / "copy"))
    dataset = open_dataset(copy)
    write_card(dataset, dataset_statistics(dataset), Folder.at(copy))
    assert bytes_of(copy) == before


@pytest.mark.parametrize("name", ["described_set", "bare_set"])
def test_the_folder_holds_its_description(name: str, request: pytest.FixtureRequest) -> None:
    folder: Path = request.getfixturevalue(name)
    said = read_description(folder / "dataset.toml")
    assert said.creators == () if name == "bare_set" else len(said.creators) == 2
