"""Importing whole: splits, statistics and card beside; nothing is left behind when it fails."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.datasets.formats.test_fingerprint_tables import quartet_in
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.datasets.description import read_description
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.pipeline.datasets.import_format import ImportOptions, import_format


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
        (ImportOptions(format_name="ods"), UsageError, "no format called 'ods' can be read; there are: "),
        (ImportOptions(format_name="uts"), DatasetError, "holds no UTS_training"),
        (ImportOptions(origin=(1.0, 2.0)), UsageError, "--origin: positions of tampere are metres already"),
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
