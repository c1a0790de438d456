"""Formats are found by name and by content, and what is wrong is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.datasets.factory import small_dataset
from vislam2tag.common import plugins
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets import format_registry as registry
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, ImportContext, ImportFormat
from vislam2tag.datasets.model import Dataset


def read(path: Path, context: ImportContext) -> Dataset:
    return small_dataset()


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    return ()


def write_labels(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    return ()


@pytest.fixture
def formats(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry.FORMATS, "_items", {})
    monkeypatch.setitem(vars(plugins.DATASET_FORMATS), "built_in", {})
    registry.register(ImportFormat("b", read, lambda path: "b" in path.stem))
    registry.register(
        ImportFormat("a", read, lambda path: "a" in path.stem),
        ExportFormat("a", {"fingerprints": {"x"}}, takes={"split"}, write=write),
    )
    registry.register(writes=ExportFormat("c", {"wifi": {"x"}}, write_labels=write_labels))


@pytest.mark.usefixtures("formats")
def test_formats_by_name() -> None:
    assert list(registry.import_formats()) == ["a", "b"]
    assert registry.import_named("a").name == "a"
    assert registry.export_named("a").source == "dataset"
    assert registry.export_named("c").source == "labels"
    assert registry.export_named("a").takes == {"split"}
    assert registry.export_named("a").holds == {"fingerprints": {"x"}}
    with pytest.raises(UsageError, match=r"'c' can be read; formats are: a, b"):
        registry.import_named("c")
    with pytest.raises(UsageError, match=r"'b' can be written; formats are: a, c"):
        registry.export_named("b")


@pytest.mark.usefixtures("formats")
def test_formats_by_content(tmp_path: Path) -> None:
    for name in ("a", "ab", "x"):
        (tmp_path / f"{name}.csv").touch()
    assert registry.import_format_of(tmp_path / "a.csv").name == "a"
    for name, said in (("ab", "may be a or b"), ("x", r"not in a known format \(a, b\)"), ("y", "no such file")):
        with pytest.raises(DatasetError, match=said):
            registry.import_format_of(tmp_path / f"{name}.csv")


def test_a_folder_of_several_archives_is_told_what_to_do(tmp_path: Path) -> None:
    for name in ("one", "two", "three", "four"):
        (tmp_path / f"{name}.zip").touch()
    said = r"contains 4 archives \(four.zip, one.zip, three.zip, ...\); pass one of them, or unpack those"
    with pytest.raises(DatasetError, match=said):
        registry.import_format_of(tmp_path)


def test_matlab_files_are_refused_with_the_files_to_write(tmp_path: Path) -> None:
    (tmp_path / "DSI1.mat").touch()
    for path in (tmp_path, tmp_path / "DSI1.mat"):
        with pytest.raises(DatasetError, match=r"MATLAB files are not read\. Expected CSV files.*NAME_trnrss\.csv"):
            registry.import_format_of(path)
