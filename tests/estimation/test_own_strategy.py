"""Strategies of a user's file or notebook, by the public interface alone."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error
from tests.cli.command import vislam2tag_process as vislam2tag
from tests.surveys import make_survey
from vislam2tag.api import (
    CameraTrack,
    LandmarkLog,
    Landmarks,
    MappingSettings,
    Trajectory,
    UsageError,
    process,
    strategy_named,
)

MODULE = """\
from vislam2tag.api import MappingSettings, strategy_named


class Mine:
    needs = "two landmarks"

    def map(self, camera, log, landmarks):
        return strategy_named("local", MappingSettings()).map(camera, log, landmarks)


class Failing:
    def map(self, camera, log, landmarks):
        return None + 1


class FailingOnce:
    def map(self, camera, log, landmarks):
        if len(camera.time_ns) == {frames}:
            raise ValueError("no")
        return Mine().map(camera, log, landmarks)


class Listing:
    def map(self, camera, log, landmarks):
        return []
"""
LINE = MODULE.splitlines().index("        return None + 1") + 1


class InNotebook:
    """Maps as ``local`` does."""

    needs = "a landmark"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        return strategy_named("local", MappingSettings()).map(camera, log, landmarks)


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("own") / "survey", seconds=20.0)


@pytest.fixture(scope="module")
def labels(survey: Path) -> Path:
    process(survey, survey / "local", strategy="local")
    return survey / "local"


@pytest.fixture(scope="module")
def mine(survey: Path, labels: Path) -> Path:
    path = survey / "my.py"
    frames = pl.read_parquet(labels / "trajectory").group_by("session").len()["len"][0]
    path.write_text(MODULE.replace("{frames}", str(frames)))
    return path


def _frames(labels: Path) -> pl.DataFrame:
    return pl.read_parquet(labels / "trajectory").sort("session", "time_ns")


def test_a_strategy_of_a_file_maps_in_every_process(survey: Path, labels: Path, mine: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = vislam2tag("process", survey, "--out", out, "--strategy", f"{mine}:Mine", "--jobs", "2")
    assert (done.returncode, done.stderr) == (0, "")
    assert _frames(out).equals(_frames(labels))
    again = vislam2tag("process", survey, "--out", out, "--strategy", f"{mine}:Mine", "--dry-run")
    assert "0 of 2 sessions would be processed" in again.stdout


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_error_of_the_file_is_its_own(survey: Path, mine: Path, tmp_path: Path, jobs: str) -> None:
    out = tmp_path / "out"
    done = vislam2tag("process", survey, "--out", out, "--strategy", f"{mine}:Failing", "--jobs", jobs)
    assert done.returncode == 3  # no frame has a position
    failures = json.loads((out / "summary.json").read_text())["failures"]
    kind = "TypeError: unsupported operand type(s) for +: 'NoneType' and 'int'"
    assert set(failures.values()) == {
        f"the strategy Failing of my.py failed at line {LINE}: {kind} (this is your code)"
    }


def test_other_sessions_go_on(survey: Path, mine: Path, tmp_path: Path) -> None:
    summary = process(survey, tmp_path / "out", strategy=f"{mine}:FailingOnce")
    assert summary.failed in (1, 2)  # both walks may have as many frames
    assert all("ValueError: no (this is your code)" in text for text in summary.failures.values())


def test_what_it_returns_is_checked(survey: Path, mine: Path, tmp_path: Path) -> None:
    summary = process(survey, tmp_path / "out", strategy=f"{mine}:Listing")
    text = next(iter(summary.failures.values()))
    assert text.startswith("the strategy Listing of my.py returned list; expected a Trajectory of ")


def test_mistakes_in_the_name(survey: Path, mine: Path, tmp_path: Path) -> None:
    def error(name: str) -> str:
        return the_error(vislam2tag("process", survey, "--out", tmp_path / "out", "--strategy", name))

    assert "it does not define the class 'Other'; it defines: Mine, Failing, FailingOnce, Listing" in error(
        f"{mine}:Other"
    )
    assert "no.py cannot be read" in error("no.py:Mine")
    broken = tmp_path / "broken.py"
    broken.write_text("import nothing_of_this_name\n")
    assert "broken.py failed at line 1: ModuleNotFoundError" in error(f"{broken}:Mine")
    broken.write_text("x = 1\nclass :\n")
    assert "broken.py failed at line 2: SyntaxError" in error(f"{broken}:Mine")


@pytest.mark.parametrize("given", [InNotebook, InNotebook()])
def test_a_class_or_an_object_is_a_strategy(survey: Path, labels: Path, tmp_path: Path, given: InNotebook) -> None:
    summary = process(survey, tmp_path / "out", strategy=given)
    assert "InNotebook" in summary.strategy
    assert _frames(tmp_path / "out").equals(_frames(labels))


def test_settings_by_keyword_are_checked(survey: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"stratgy: .*; settings by keyword are: strategy, together, survey"):
        process(survey, tmp_path / "out", stratgy="local")  # type: ignore[call-arg]
    with pytest.raises(UsageError, match="together: Input should be a valid boolean"):
        process(survey, tmp_path / "out", together="perhaps")  # type: ignore[arg-type]


IN_A_CELL = """\
class OfCell:
    def map(self, camera, log, landmarks):
        return None + 1
"""


def test_a_class_of_a_cell_has_its_line_and_stays_in_its_process(survey: Path, tmp_path: Path) -> None:
    cell: dict[str, type] = {"__name__": "cell"}  # type: ignore[dict-item]
    exec(compile(IN_A_CELL, "<cell 3>", "exec"), cell)
    summary = process(survey, tmp_path / "out", strategy=cell["OfCell"])
    assert all(text.startswith("the strategy OfCell failed at line 3: TypeError") for text in summary.failures.values())
    with pytest.raises(UsageError, match=r"OfCell exists only in this notebook or prompt, .*; use jobs=1, or save it"):
        process(survey, tmp_path / "two", strategy="OfCell", jobs=2)
    assert not (tmp_path / "two").exists()


@pytest.mark.parametrize("given", [3, object()])
def test_something_else_is_no_strategy(survey: Path, tmp_path: Path, given: object) -> None:
    with pytest.raises(UsageError, match=r"expected a name, NAME.py:CLASS, or a class with the method map"):
        process(survey, tmp_path / "out", strategy=given)  # type: ignore[arg-type]
