"""README.md tells what is known, says what is not stated, and its code runs.

The card lies in the folder, with checksums that sha256sum agrees with, and the same bytes each time.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pandas as pd
import polars as pl
import pytest
import yaml

from tests.surveys import bytes_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.datasets.card import readme_text, write_card
from vislam2tag.datasets.card_metadata import front_matter
from vislam2tag.datasets.description import read_description
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.schema import SCHEMAS, meaning
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.site.georeference import Georeference

COLUMNS = [(table, column) for table, schema in SCHEMAS.items() for column in schema]


def matter(folder: Path) -> dict[str, object]:
    text = (folder / "README.md").read_text("utf-8")
    found: dict[str, object] = yaml.safe_load(text.split("---\n")[1])
    return found


def test_front_matter_has_a_configuration_for_each_table(described_set: Path) -> None:
    found = matter(described_set)
    assert found["configs"] == [
        {"config_name": "fingerprints", "data_files": "fingerprints.parquet", "default": True},
        {"config_name": "readings", "data_files": "readings.parquet"},
        {"config_name": "access_points", "data_files": "access_points.parquet"},
        {"config_name": "sessions", "data_files": "sessions.parquet"},
    ]
    assert found["license"] == "cc-by-4.0"
    assert found["size_categories"] == ["n<1K"]
    assert (described_set / "README.md").read_text("utf-8").startswith("---\n")


def test_front_matter_of_a_bare_set_states_no_licence(bare_set: Path) -> None:
    assert "license" not in matter(bare_set)


@pytest.mark.parametrize(
    ("licence", "link"),
    [("GPL-3.0-only", "https://spdx.org/licenses/GPL-3.0-only.html"), ("LicenseRef-Ours", "LICENSE")],
)
def test_a_licence_unknown_to_hugging_face_has_name_and_link(licence: str, link: str, bare_set: Path) -> None:
    info = open_dataset(bare_set).info.model_copy(update={"licence": licence})
    found = yaml.safe_load(front_matter(info).strip("-\n"))
    assert found["license"] == "other"
    assert found["license_name"] == licence.lower()
    assert found["license_link"] == link


def test_what_is_stated_is_told(described_set: Path) -> None:
    text = (described_set / "README.md").read_text("utf-8")
    for part in (
        "# Wi-Fi of a simulated building",
        "Carberry, Josiah; The surveyors' club",
        "(2026): *Wi-Fi of a simulated building*, version 1.0.0. Zenodo. https://doi.org/10.5281/zenodo.1234567",
        "| creators | Carberry, Josiah; The surveyors' club |",
        "<https://creativecommons.org/licenses/by/4.0/>",
        "labels of the survey `survey` by vislam2tag 0.1.0",
        "`cached_readings` in `a.csv` (3)",
        "| wifi | 48 | 44 |",
        "4 of 48 fingerprints of wifi have no position",
        "\n\n- `splits/again.parquet`: device; one fold\n- `splits/device.parquet`: device; 2 folds\n\n`splits/NAME",
        "IPIN 2022; please cite it, too.\n\n## ",
    ):
        assert part in text
    assert "ot stated" not in text


def test_what_is_not_stated_is_told(bare_set: Path) -> None:
    text = (bare_set / "README.md").read_text("utf-8")
    for part in (
        "| licence | not stated |",
        "Not stated: description, licence, creators, keywords, version, published, publisher, contact.",
        "Not stated: no creator is named.",
        "There is no `datacite.json`",
    ):
        assert part in text
    assert "None" not in text


@pytest.mark.parametrize("library", ["polars", "pandas"])
def test_the_lines_that_load_it_run(library: str, described_set: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (described_set / "README.md").read_text("utf-8"), re.DOTALL)
    (code,) = [block for block in blocks if f"import {library}" in block]
    monkeypatch.chdir(described_set)
    names: dict[str, pl.DataFrame | pd.DataFrame] = {}
    exec(code, names)
    assert len(names["fingerprints"]) == 44
    assert len(names["rssi"]) == 44


def test_every_column_has_a_meaning() -> None:
    assert [column for column in COLUMNS if not meaning(*column)] == []


def test_hashed_identifiers_and_a_place_on_earth_are_told(bare_set: Path) -> None:
    dataset = open_dataset(bare_set)
    place = Georeference(latitude_deg=50.5, longitude_deg=6.25, bearing_deg=30)
    floors = (dataset.info.floors[0].model_copy(update={"georeference": place}), *dataset.info.floors[1:])
    info = dataset.info.model_copy(update={"bssid_key": "abc", "floors": floors})
    text = readme_text(replace(dataset, info=info), dataset_statistics(dataset))
    assert "hashed with the key that is called abc." in text
    assert (
        "\n\n- floor 0: its origin lies at 50.5, 6.25 (latitude, longitude, degrees), its y axis points 30.0 deg"
        in text
    )
    assert "floor 1: its origin" not in text
    assert "hashed" not in (bare_set / "README.md").read_text("utf-8")


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    command = ["sha256sum", "--strict", "-c", "SHA256SUMS"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_checksums_cover_every_file(described_set: Path) -> None:
    done = check(described_set)
    assert done.returncode == 0, done.stderr
    files = {path.relative_to(described_set).as_posix() for path in described_set.rglob("*") if path.is_file()}
    assert OWN_FILES in files
    assert {line.split(": ")[0] for line in done.stdout.splitlines()} == files - {"SHA256SUMS", OWN_FILES}


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
