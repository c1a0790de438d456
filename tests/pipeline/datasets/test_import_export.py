"""Importing whole: splits, statistics and card beside; nothing is left behind when it fails.

Exporting every format of every source: what survives, what is said to be lost, and what cannot be.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.datasets.factory import small_dataset
from tests.datasets.formats.round_trip import (
    Signature,
    exported,
    imported,
    odd_dataset,
    signatures,
    signatures_of_csv,
    signatures_of_geojson,
    signatures_of_geopackage,
    signatures_of_geoparquet,
    signatures_of_hdf5,
)
from tests.datasets.formats.test_fingerprint_tables import quartet_in
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.datasets.description import read_description
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.format_registry import export_formats
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy, hashed
from vislam2tag.datasets.schema import FINGERPRINTS
from vislam2tag.pipeline.datasets.build import build_dataset
from vislam2tag.pipeline.datasets.import_export import (
    RECORD_FILE,
    ExportOptions,
    ImportOptions,
    export,
    import_format,
    is_export,
)
from vislam2tag.pipeline.labels.process import process


@pytest.fixture
def quartet(tmp_path: Path) -> Path:
    return quartet_in(quartet_in(tmp_path / "in"), "Test")


def test_the_official_split_stays_beside_the_standard_ones(quartet: Path, tmp_path: Path) -> None:
    parts: list[tuple[str, int]] = []
    dataset = import_format(quartet, tmp_path / "set", progress=lambda part, total: parts.append((part, total)))
    assert {"official", "random", "device"} <= dataset.splits.keys()
    assert dataset.splits["official"].groups["group"].to_list().count("test") == 2
    assert parts == [("test", 2), ("training", 2)]
    assert {"README.md", "statistics.json", "SHA256SUMS"} <= {path.name for path in (tmp_path / "set").iterdir()}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "set"]


def test_the_same_files_make_the_same_bytes(quartet: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        import_format(quartet, tmp_path / name)
    for path in (tmp_path / "a").rglob("*.*"):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()


def test_name_description_and_privacy(quartet: Path, tmp_path: Path) -> None:
    (tmp_path / "dataset.toml").write_text('title = "Ours"\nlicence = "MIT"\n')
    options = ImportOptions(
        name="mine",
        description=read_description(tmp_path / "dataset.toml"),
        privacy=Privacy(hash_key=b"0123456789abcdef0123456789abcdef"),
    )
    info = import_format(quartet, tmp_path / "set", options).info
    assert (info.name, info.title, info.licence) == ("mine", "Ours", "MIT")
    assert info.bssid_key
    assert "WAP001" not in open_dataset(tmp_path / "set").access_points.collect()["bssid"].to_list()


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        (ImportOptions(format_name="ods"), UsageError, "no format 'ods' can be read; formats are: "),
        (ImportOptions(format_name="uts"), DatasetError, "contains no UTS_training"),
        (ImportOptions(origin=(1.0, 2.0)), UsageError, "--origin: positions of tampere are already in metres"),
    ],
)
def test_what_cannot_work_leaves_nothing(
    quartet: Path, tmp_path: Path, options: ImportOptions, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        import_format(quartet, tmp_path / "set", options)
    assert [path.name for path in tmp_path.iterdir()] == ["in"]


def test_what_is_there_is_not_overwritten(quartet: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="is not empty"):
        import_format(quartet, quartet)


def test_a_folder_in_a_files_place_is_the_inputs_fault(quartet: Path, tmp_path: Path) -> None:
    (quartet / "Training_device_21Aug17.csv").unlink()
    (quartet / "Training_device_21Aug17.csv").mkdir()
    with pytest.raises(DatasetError, match=r"device_21Aug17.csv: cannot be read"):
        import_format(quartet, tmp_path / "set")


OF_DATASET = tuple(name for name, each in export_formats().items() if each.source == "dataset")
SIMULATED, TAMPERE, SMALL = "simulated", "tampere", "small"
KEY = b"0123456789abcdef"


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "survey"
    return make_survey(folder, floors=2, devices=("LG",), seconds=90.0, traps=("odd_ssids",))


@pytest.fixture(scope="module")
def labels(survey: Path) -> Path:
    process(survey, survey.parent / "labels")
    return survey.parent / "labels"


@pytest.fixture(scope="module")
def sources(labels: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Data sets on disk: made by hand, built of a simulated survey of two floors, imported from Tampere's files."""
    folder = tmp_path_factory.mktemp("sources")
    write_dataset(odd_dataset(), folder / SMALL)
    build_dataset(labels, folder / SIMULATED)
    return {name: folder / name for name in (SMALL, SIMULATED)}


READERS: Mapping[str, Callable[[Path], Counter[Signature]]] = {
    "csv": signatures_of_csv,
    "geojson": signatures_of_geojson,
    "geopackage": signatures_of_geopackage,
    "geoparquet": signatures_of_geoparquet,
    "hdf5": signatures_of_hdf5,
}
"""Readers of formats that we only write."""
OF_PICTURES = {"colmap", "kapture", "lamar"}
"""Formats that need a survey with pictures: tests/datasets/formats/test_posed_pictures.py."""


def check_round_trip(source: Path, name: str, folder: Path) -> None:
    dataset = open_dataset(source)
    record = export(source, folder / "out", name)
    if name in READERS:
        back = READERS[name](folder / "out")
    else:
        back = signatures(imported(name, folder / "out", folder / "scratch"))
    expected = dataset
    if name in ("uji", "comford"):
        sure = dataset.fingerprints.filter(pl.col("status") != "uncertain")
        expected = replace(dataset, tables={**dataset.tables, FINGERPRINTS: sure})
    assert sum(back.values()) > 20
    assert back == signatures(expected)
    assert set(record.files) == set(bytes_of(folder / "out")) - {RECORD_FILE, OWN_FILES}


@pytest.mark.parametrize("name", OF_DATASET)
@pytest.mark.parametrize("source", [SMALL, SIMULATED])
def test_what_every_format_holds_survives(sources: dict[str, Path], source: str, name: str, tmp_path: Path) -> None:
    check_round_trip(sources[source], name, tmp_path)


@pytest.mark.parametrize("name", sorted(export_formats().keys() - OF_PICTURES))
def test_the_same_source_gives_the_same_bytes(
    sources: dict[str, Path], labels: Path, name: str, tmp_path: Path
) -> None:
    source = sources[SIMULATED] if name in OF_DATASET else labels
    told: list[tuple[str, int]] = []
    record = export(source, tmp_path / "a", name, progress=lambda stage, total: told.append((stage, total)))
    export(source, tmp_path / "b", name)
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")
    assert (record.format, record.source) == (name, source.name)
    assert {stage for stage, _ in told} == {"write"}
    assert is_export(tmp_path / "a")
    export(source, tmp_path / "a", name)  # an earlier export may be replaced


def test_labels_become_a_data_set_on_the_way(sources: dict[str, Path], labels: Path, tmp_path: Path) -> None:
    told: list[str] = []
    export(labels, tmp_path / "a", "comford", progress=lambda stage, _total: told.append(stage))
    export(sources[SIMULATED], tmp_path / "b", "comford")
    assert bytes_of(tmp_path / "a" / "intermediate") == bytes_of(tmp_path / "b" / "intermediate")
    assert list(dict.fromkeys(told)) == ["build", "write"]
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b"}


def test_what_is_left_out_is_recorded(sources: dict[str, Path], tmp_path: Path) -> None:
    export(sources[SIMULATED], tmp_path / "out", "uji")
    record = json.loads((tmp_path / "out" / RECORD_FILE).read_text())
    lost = {finding["file"]: finding["message"] for finding in record["findings"] if finding["kind"] == "left_out"}
    assert "sigma" in lost["fingerprints"]
    assert lost["readings"] == "columns of readings are skipped: time_ns, floor, x, y, sigma"
    assert lost["imu_windows"] == "the table imu_windows is skipped, because the format has no place for it"
    assert lost["splits"] == "all splits but one are skipped"


def opted_out(folder: Path) -> Dataset:
    plain = small_dataset()
    first = pl.col("bssid") == "00:11:22:33:00:00"
    name = pl.when(first).then(pl.lit("home_nomap")).otherwise("ssid").alias("ssid")
    points = plain.access_points.with_columns(name, nomap=first)
    return write_dataset(replace(plain, tables={**plain.tables, "access_points": points}), folder)


def everything(folder: Path) -> bytes:
    return b"".join(file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file())


@pytest.mark.parametrize("name", OF_DATASET)
def test_privacy_is_that_of_every_format(name: str, tmp_path: Path) -> None:
    opted_out(tmp_path / "set")
    record = export(tmp_path / "set", tmp_path / "plain", name)
    assert record.findings[0].kind == "nomap_left_out"
    hidden = ExportOptions(privacy=Privacy(include_nomap=True, hash_key=KEY, keep_ssids=False))
    record = export(tmp_path / "set", tmp_path / "hidden", name, hidden)
    assert record.bssid_key
    assert all(finding.kind != "nomap_left_out" for finding in record.findings)
    plain, secret = (everything(tmp_path / each) for each in ("plain", "hidden"))
    assert b"home_nomap" not in plain
    assert b"eduroam" not in secret
    if "parquet" not in name:  # columns are compressed there
        assert b"00:11:22:33:00:00" not in plain
        assert b"00:11:22:33:00:01" in plain
        assert b"00:11:22:33" not in secret
        assert hashed("00:11:22:33:00:01", KEY).encode() in secret


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("nope", ExportOptions(), "no format 'nope' can be written; formats are: colmap, comford, csv"),
        ("geojson", ExportOptions(split="random"), "--split does not apply to the format geojson"),
        ("uji", ExportOptions(survey=Path("x")), "--survey does not apply to the format uji"),
        ("uji", ExportOptions(fold="x"), "--fold x: name the split of this fold with --split"),
        ("uji", ExportOptions(split="nope"), "--split nope: the data set has no such split; its splits: "),
        ("gia", ExportOptions(), "is a data set. The format gia needs labels"),
    ],
)
def test_what_cannot_be_asked_for(
    sources: dict[str, Path], name: str, options: ExportOptions, said: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=said):
        export(sources[SIMULATED], tmp_path / "out", name, options)
    assert not list(tmp_path.iterdir())


def test_what_is_no_source(survey: Path, sources: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no such folder"):
        export(tmp_path / "nothing", tmp_path / "out", "uji")
    with pytest.raises(DatasetError, match="expected a data set or an output folder"):
        export(survey, tmp_path / "out", "uji")
    with pytest.raises(UsageError, match="is not an output folder"):
        export(survey, tmp_path / "out", "tum")
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        export(sources[SMALL], sources[SIMULATED], "uji")


def test_an_export_in_another_format_is_not_replaced(sources: dict[str, Path], tmp_path: Path) -> None:
    export(sources[SMALL], tmp_path / "out", "csv")
    before = bytes_of(tmp_path / "out")
    with pytest.raises(OutputError, match="contains an export in the format csv; choose another --out, or delete"):
        export(sources[SMALL], tmp_path / "out", "parquet")
    assert bytes_of(tmp_path / "out") == before
    export(sources[SMALL], tmp_path / "out", "csv")
    assert bytes_of(tmp_path / "out") == before


def test_a_failed_export_leaves_what_was_there(sources: dict[str, Path], tmp_path: Path) -> None:
    export(sources[SIMULATED], tmp_path / "out", "uji")
    before = bytes_of(tmp_path / "out")
    nowhere = small_dataset(unlabelled=12)
    write_dataset(nowhere, tmp_path / "nowhere")
    with pytest.raises(DatasetError, match="no wifi fingerprint has a position"):
        export(tmp_path / "nowhere", tmp_path / "out", "uji")
    assert bytes_of(tmp_path / "out") == before
    assert {path.name for path in tmp_path.iterdir()} == {"out", "nowhere"}


def test_the_raw_survey_is_no_place_for_it(labels: Path, survey: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "survey")
    options = ExportOptions(survey=tmp_path / "survey")
    with pytest.raises(OutputError, match="this folder is among the survey's sessions"):
        export(labels, tmp_path / "survey" / "floor_0" / "out", "gia", options)
    export(labels, tmp_path / "out", "gia", options)
    assert (tmp_path / "out" / "floor_dimensions.csv").read_bytes() == (survey / "floor_dimensions.csv").read_bytes()


def test_positions_in_degrees_are_refused_in_every_format(tmp_path: Path) -> None:
    plain = small_dataset()
    degrees = plain.fingerprints.with_columns(pl.col("x", "y") * 1e-5)
    exported(replace(plain, tables={**plain.tables, FINGERPRINTS: degrees}), "parquet", tmp_path / "in")
    with pytest.raises(DatasetError, match="Possible cause: degrees or kilometres"):
        import_format(tmp_path / "in", tmp_path / "set")
    assert not (tmp_path / "set").exists()
