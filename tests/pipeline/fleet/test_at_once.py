"""Two processes work on one fleet at once, each on another survey, as one Kubernetes Job for each survey does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.pipeline.fleet.conftest import SmallFleet
from tests.pipeline.fleet.trees import COLUMNS_OF_TIMES, tree_of
from vislam2tag.pipeline.fleet.catalogue import Fleet


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
