"""A split is added whole or not at all, whatever happens."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.datasets.factory import small_dataset
from tests.surveys import bytes_of
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.common.files.whole_output import exclusive_writer
from vislam2tag.datasets.folder import FolderWriter, dataset_folder, open_dataset, write_dataset
from vislam2tag.datasets.model import Split
from vislam2tag.datasets.settings import SplitKind, SplitSettings
from vislam2tag.datasets.splits import make_split, standard_splits
from vislam2tag.pipeline.datasets import finish as added_split
from vislam2tag.pipeline.datasets.finish import STATISTICS_FILE, add_split, finish_dataset

SMALL = small_dataset()


class KilledError(Exception):
    pass


def made(name: str = "blocks", seed: int = 0) -> Split:
    return make_split(SMALL, SplitKind.BLOCK, SplitSettings(block_m=8, seed=seed), name)


def finished(folder: Path) -> Path:
    """A data set with standard splits, statistics and card."""
    with dataset_folder(folder) as writer:
        assert isinstance(writer, FolderWriter)
        writer.add_tables(SMALL.tables)
        finish_dataset(writer, SMALL.info)
    return folder


def test_the_split_is_saved_and_nothing_else_changes(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    write_dataset(replace(SMALL, splits=standard_splits(SMALL)), folder)
    before, info = bytes_of(folder), open_dataset(folder).info
    found = add_split(folder, made())
    assert found.splits["blocks"].info == made().info
    assert found.splits["blocks"].groups.equals(made().groups)
    assert found.info.model_copy(update={"splits": info.splits}) == info
    assert list(found.info.splits) == sorted([*info.splits, "blocks"])
    after = bytes_of(folder)
    assert set(after) - set(before) == {"splits/blocks.json", "splits/blocks.parquet"}
    assert [name for name in before if before[name] != after[name]] == [OWN_FILES, "dataset.json"]


def test_the_card_lists_it_and_checksums_hold(tmp_path: Path) -> None:
    folder = finished(tmp_path / "set")
    add_split(folder, made())
    assert "blocks" in (folder / "README.md").read_text()
    assert "split_blocks" in (folder / "croissant.json").read_text()
    checked = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=folder, capture_output=True, text=True, check=True)
    assert "splits/blocks.parquet: OK" in checked.stdout


def test_statistics_that_cannot_be_read_are_told_before_anything_is_written(tmp_path: Path) -> None:
    folder = finished(tmp_path / "set")
    (folder / STATISTICS_FILE).write_text('"nan"')
    before = bytes_of(folder)
    with pytest.raises(DatasetError, match=r"statistics\.json: the file cannot be read"):
        add_split(folder, made())
    assert bytes_of(folder) == before


@pytest.mark.parametrize("step", range(5))
def test_killed_at_any_step_the_set_is_whole_and_the_same_again_completes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    folder, whole = finished(tmp_path / "set"), finished(tmp_path / "whole")
    add_split(whole, made())
    names = set(open_dataset(folder).splits)
    dying = _dying_at(step)
    monkeypatch.setattr(os, "replace", dying)
    monkeypatch.setattr(shutil, "rmtree", lambda *_, **__: None)
    monkeypatch.setattr(added_split, "write_card", dying)
    with pytest.raises(KilledError):
        add_split(folder, made())
    monkeypatch.undo()
    assert set(open_dataset(folder).splits) - names in (set(), {"blocks"})
    monkeypatch.setattr("vislam2tag.common.files.folder._swept", set())  # as in a new process
    add_split(folder, made())
    assert bytes_of(folder) == bytes_of(whole)


def _dying_at(step: int) -> Callable[..., None]:
    """Stand in for ``os.replace`` and the card; the call of this number (from 0) never comes to it."""
    calls = iter(range(10))
    replace_file = os.replace

    def call(*arguments: object, **options: object) -> None:
        if next(calls) == step:
            raise KilledError
        replace_file(*arguments, **options)  # type: ignore[arg-type]

    return call


def test_an_added_split_goes_with_the_data_set_and_the_user_s_files_stay(tmp_path: Path) -> None:
    folder = finished(tmp_path / "set")
    (folder / "notes.txt").write_text("mine")
    add_split(folder, made())
    finished(folder)
    assert not (folder / "splits" / "blocks.parquet").exists()
    assert (folder / "notes.txt").read_text() == "mine"


def test_a_split_takes_the_place_of_no_file_of_the_user_s(tmp_path: Path) -> None:
    folder = finished(tmp_path / "set")
    (folder / "splits" / "blocks.json").write_text("mine")
    before = bytes_of(folder)
    with pytest.raises(OutputError, match=r"blocks\.json: this file is not from this program; move it away"):
        add_split(folder, made())
    assert bytes_of(folder) == before


def test_one_command_at_a_time_changes_a_set(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    write_dataset(SMALL, folder)
    with exclusive_writer(folder), pytest.raises(OutputError, match="another command is writing there"):
        add_split(folder, made())
    with exclusive_writer(folder), pytest.raises(OutputError, match="another command is writing there"):
        write_dataset(open_dataset(folder), folder)


def test_another_split_of_the_name_is_not_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    write_dataset(SMALL, folder)
    add_split(folder, made())
    before = bytes_of(folder)
    with pytest.raises(UsageError, match="another split of this name"):
        add_split(folder, made(seed=1))
    for name in ("", "../x", ".hidden", "a b"):
        with pytest.raises(UsageError, match="use letters"):
            add_split(folder, made(name))
    assert bytes_of(folder) == before
    with pytest.raises(DatasetError, match="not a data set"):
        add_split(tmp_path, made())


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "set"
    write_dataset(SMALL, folder)
    before = bytes_of(folder)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="No space left"):
        add_split(folder, made())
    assert bytes_of(folder) == before
