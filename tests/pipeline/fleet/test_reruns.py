"""Whatever ends a run of ``fleet process``, the next one leaves what one whole run leaves: all files are compared."""

from __future__ import annotations

import math
import shutil
import signal
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.pipeline.fleet.conftest import CONFIG, SmallFleet
from tests.pipeline.fleet.trees import COLUMNS_OF_TIMES, tree_of
from tests.stores import Bucket
from tests.struck import MAIN, Strike, moments, struck
from vislam2tag.common.files.stored_folder import any_store_at
from vislam2tag.pipeline.fleet.catalogue import fleet_list

SUMMARY, REPORT = "labels/ward/summary.json", "labels/ward/report.html"
COUNTING = f"import atexit\natexit.register(lambda: print(watch.seen))\n{MAIN}"
KILLING = """
import os, signal
from vislam2tag.common.files.store import Store
changes = 0

def counted(change):
    def with_count(*arguments, **options):
        global changes
        changes += 1
        if changes == STEP:
            os.kill(os.getpid(), signal.SIGKILL)
        return change(*arguments, **options)
    return with_count

Store._put, Store.delete = counted(Store._put), counted(Store.delete)
"""
"""Kills the process just before it changes a bucket for the STEP-th time."""
MOMENTS = 5
NAME = "small"
"""Of every fleet: its pages contain it."""


def added(fleet: SmallFleet, place: Path) -> Path:
    assert vislam2tag("fleet", "add", place, *fleet.surveys.values()).returncode == 0
    return place


def process(fleet: SmallFleet, place: Path, *options: str | Path) -> None:
    done = vislam2tag(*arguments(fleet, place), *options)
    assert done.returncode == 0, done.stderr


def arguments(fleet: SmallFleet, place: Path, config: Path | None = None) -> list[str | Path]:
    return ["fleet", "process", place, "--jobs", "1", "--config", config or fleet.config]


class Whole(NamedTuple):
    """What one whole run leaves, and how many steps of writing it takes."""

    place: Path
    tree: dict[str, str]
    catalogue: pl.DataFrame
    steps: int


@pytest.fixture(scope="module")
def whole(fleet: SmallFleet, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    place = added(fleet, tmp_path_factory.mktemp("whole") / NAME)
    done = struck(place, Strike(0), *arguments(fleet, place), main=COUNTING)
    tree = tree_of(place, tmp_path_factory.mktemp("tree"))
    assert {SUMMARY, REPORT, "report/ward/index.html"} <= tree.keys()
    return Whole(place, tree, fleet_list(place).drop(COLUMNS_OF_TIMES), int(done.stdout.splitlines()[-1]))


@pytest.fixture(params=["folder", "s3", "azure"])
def place(request: pytest.FixtureRequest, fleet: SmallFleet, tmp_path: Path) -> Path:
    """A fleet that nothing was processed of."""
    if request.param == "folder":
        return added(fleet, tmp_path / NAME)
    bucket: Bucket = request.getfixturevalue(request.param)
    return added(fleet, Path(bucket.store(f"reruns/{tmp_path.name}/{NAME}").address))


@pytest.mark.slow
def test_further_runs_leave_all_files_as_they_are(fleet: SmallFleet, whole: Whole, place: Path, tmp_path: Path) -> None:
    for number in range(3):
        process(fleet, place)
        assert tree_of(place, tmp_path / f"tree-{number}") == whole.tree
        assert fleet_list(place).drop(COLUMNS_OF_TIMES).equals(whole.catalogue)
    made = vislam2tag("dataset", place / "labels" / "ward", "--out", tmp_path / "set", "--jobs", "1")
    assert made.returncode == 0, made.stderr


@pytest.mark.slow
@pytest.mark.parametrize("gone", [[SUMMARY], [REPORT], [SUMMARY, REPORT], ["reduced/ward.json"]])
def test_a_run_repairs_labels_without_summary_or_report(
    fleet: SmallFleet, whole: Whole, place: Path, tmp_path: Path, gone: list[str]
) -> None:
    process(fleet, place)
    any_store_at(place).delete(gone)
    process(fleet, place)
    assert tree_of(place, tmp_path / "tree") == whole.tree


@pytest.mark.slow
def test_a_run_of_one_survey_leaves_the_others_as_they_are(
    fleet: SmallFleet, whole: Whole, place: Path, tmp_path: Path
) -> None:
    for options in (["--survey", "ward"], ["--survey", "hall"], ["--survey", "ward"]):
        process(fleet, place, *options)
    assert tree_of(place, tmp_path / "tree") == whole.tree


@pytest.mark.slow
def test_files_that_people_add_stay(fleet: SmallFleet, whole: Whole, place: Path, tmp_path: Path) -> None:
    own = [
        "notes.txt",
        "report/notes.txt",
        "report/ward/notes.html",
        "tables/wifi/survey=ward/floor=0/mine.parquet",
        "tables/wifi/survey=ward/notes.txt",
    ]
    process(fleet, place)
    for name in own:
        any_store_at(place).put(name, b"mine")
    any_store_at(place).delete([SUMMARY, "reduced/ward.json"])
    process(fleet, place)
    tree = tree_of(place, tmp_path / "tree")
    assert {name for name in tree if name not in whole.tree} == set(own)
    assert whole.tree.items() <= tree.items()


@pytest.mark.slow
@pytest.mark.parametrize("moment", moments(MOMENTS))
def test_killed_at_moments_spread_over_a_run(fleet: SmallFleet, whole: Whole, tmp_path: Path, moment: int) -> None:
    place = added(fleet, tmp_path / NAME)
    step = math.ceil(whole.steps * moment / MOMENTS)
    done = struck(place, Strike(step), *arguments(fleet, place))
    assert done.returncode == -signal.SIGKILL, done.stderr
    process(fleet, place)
    assert tree_of(place, tmp_path / "tree") == whole.tree
    assert fleet_list(place).drop(COLUMNS_OF_TIMES).equals(whole.catalogue)


@pytest.mark.slow
@pytest.mark.parametrize("moment", moments(MOMENTS))
def test_killed_with_other_settings_and_continued_with_those_of_before(
    fleet: SmallFleet, whole: Whole, tmp_path: Path, moment: int
) -> None:
    place = Path(shutil.copytree(whole.place, tmp_path / NAME))
    other = tmp_path / "other.toml"
    other.write_text(f"{CONFIG}[labels]\nmax_sigma_m = 0.05\n")
    step = math.ceil(whole.steps * moment / (MOMENTS + 1))
    done = struck(place, Strike(step), *arguments(fleet, place, other))
    assert done.returncode == -signal.SIGKILL, done.stderr
    process(fleet, place)
    assert tree_of(place, tmp_path / "tree") == whole.tree


@pytest.mark.slow
@pytest.mark.parametrize("moment", moments(MOMENTS))
def test_killed_at_moments_spread_over_a_run_in_a_bucket(
    fleet: SmallFleet, whole: Whole, tmp_path: Path, moment: int
) -> None:
    place = added(fleet, Path(fleet.s3.store(f"killed/{tmp_path.name}/{NAME}").address))
    changes = sum(each.startswith(("PUT", "POST", "DELETE")) for each in fleet.processed)
    main = f"STEP = {math.ceil(changes * moment / (MOMENTS + 1))}\n{KILLING}{MAIN}"
    done = struck(tmp_path, Strike(0), *arguments(fleet, place), main=main)
    assert done.returncode == -signal.SIGKILL, done.stderr
    process(fleet, place)
    assert tree_of(place, tmp_path / "tree") == whole.tree
