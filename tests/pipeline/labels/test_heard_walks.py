"""Walks that go far without a landmark are told by others' radio scans where they were."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.surveys import bytes_of
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.labeling.results import Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels import together
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.labels.together import MOST_KEPT, HeardWalk, heard_walk, scans_of, ties_of
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import simulate
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import SessionKey

TOGETHER = ProcessSettings(together=True)
WALKS = 6


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Walks on a floor with no more than four landmarks."""
    root = tmp_path_factory.mktemp("heard") / "survey"
    building = BuildingSettings(landmarks=4)
    simulate(regular_survey(1, "default", (0,), sessions=WALKS // 2, duration_s=120.0, building=building), root)
    return root


@pytest.fixture(scope="module", name="labels")
def _labels(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Summary]:
    out = tmp_path_factory.mktemp("labels") / "out"
    return out, process(survey, out, TOGETHER)


def test_walks_far_from_landmarks_are_known_better_by_others_scans(
    survey: Path, labels: tuple[Path, Summary], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = labels[1]
    assert told.findings["placed_by_others"] > 0
    monkeypatch.setattr(together, "FAR_M", 1e9)
    without = process(survey, tmp_path / "out", TOGETHER)
    assert "placed_by_others" not in without.findings
    assert told.frames["uncertain"] < 0.8 * without.frames["uncertain"]
    assert squared_error(labels[0], survey) < squared_error(tmp_path / "out", survey)


def squared_error(labels: Path, survey: Path) -> float:
    """Mean square of what all walks' frames are off, m^2."""
    truth = {
        f"floor_0.{path.parent.parent.name}.{path.parent.name.replace(':', '')}": pl.read_csv(path)
        for path in survey.glob("floor_0/*/*/truth.csv")
    }
    squares = []
    for path in sorted((labels / "trajectory").glob("*.parquet")):
        frame = pl.read_parquet(path).join(truth[path.stem], on="time_ns", suffix="_true")
        squares.append((frame["x"] - frame["x_true"]) ** 2 + (frame["y"] - frame["y_true"]) ** 2)
    assert len(squares) == WALKS
    return float(np.nanmean(np.concatenate([one.to_numpy() for one in squares])))


def test_what_scans_tell_is_a_part_of_what_a_result_follows_from(
    survey: Path, labels: tuple[Path, Summary], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    shutil.copytree(labels[0], out)
    again: list[Outcome] = []
    process(survey, out, TOGETHER, progress=lambda outcome, _: again.append(outcome))
    assert not any(outcome.repeated for outcome in again)
    monkeypatch.setattr(together, "FAR_M", 1e9)
    changed: list[Outcome] = []
    process(survey, out, TOGETHER, progress=lambda outcome, _: changed.append(outcome))
    told = {path.stem for path in (labels[0] / "sessions").glob("*.json") if "placed_by_others" in path.read_text()}
    assert {outcome.slug for outcome in changed if outcome.repeated} == told != set()


@pytest.mark.slow
def test_the_order_and_number_of_processes_do_not_matter(
    survey: Path, labels: tuple[Path, Summary], tmp_path: Path
) -> None:
    heard: list[tuple[SessionKey, int]] = []
    process(survey, tmp_path / "out", TOGETHER, jobs=2, comparing=lambda key, total: heard.append((key, total)))
    assert bytes_of(labels[0] / "trajectory") == bytes_of(tmp_path / "out/trajectory")
    assert [total for _, total in heard] == [WALKS] * WALKS + [2 * WALKS] * 2 * WALKS  # some need the plan, too


def test_a_session_that_cannot_be_read_tells_why_and_nothing_else(survey: Path, tmp_path: Path) -> None:
    broken = tmp_path / "survey"
    shutil.copytree(survey, broken)
    opened = open_survey(broken)
    task = session_task(opened.sessions[0], opened, Corrections(), TOGETHER)
    shutil.rmtree(task.ref.folder)
    walk = heard_walk(MappingSettings(), task)
    assert walk.error
    assert ties_of([walk, HeardWalk(task.ref.key)]) == {}


@pytest.mark.slow
def test_the_command_ends_with_the_option_that_helps(survey: Path, tmp_path: Path) -> None:
    alone = vislam2tag("process", str(survey), "--out", str(tmp_path / "out"))
    *_, step = alone.stdout.splitlines()
    assert step == f"next: vislam2tag process {survey} --out {tmp_path / 'out'} --together"
    together = vislam2tag(*step.removeprefix("next: vislam2tag ").split())
    assert "placed_by_others" in together.stdout
    assert "--together" not in together.stdout


def test_walks_that_heard_nothing_tell_nothing(survey: Path) -> None:
    opened = open_survey(survey)
    tasks = [session_task(ref, opened, Corrections(), TOGETHER) for ref in opened.sessions]
    walks = [heard_walk(MappingSettings(), task) for task in tasks]
    told = ties_of(walks)
    assert told
    assert ties_of(walks[::-1]).keys() == told.keys()
    assert ties_of([replace(walk, scans=None) for walk in walks]) == {}


def table(scans: int) -> pl.DataFrame:
    """Scans of two access points, 1 s apart, the second reading of each 200 ms later."""
    scan = np.repeat(np.arange(scans), 2)
    return pl.DataFrame(
        {
            "repeated": np.zeros(2 * scans, dtype=np.bool_),
            "scan": scan.astype(np.int32),
            "time_ns": 10**12 + scan * 10**9 + np.tile((0, 200_000_000), scans),
            "bssid": ["a", "b"] * scans,
            "rssi_dbm": [-50.0, None] * scans,
        },
        schema_overrides={"rssi_dbm": pl.Float32},
    )


def test_a_scan_has_the_mean_time_of_its_readings_and_what_was_heard() -> None:
    scans = scans_of("phone", table(3))
    assert (scans.time_ns - 10**12).tolist() == [100_000_000, 1_100_000_000, 2_100_000_000]
    assert scans.access_points == ("a",)
    assert scans.rssi_dbm.tolist() == [-50.0] * 3
    assert set(scans.device) == {"phone"}


def test_no_more_scans_are_kept_than_are_used() -> None:
    assert len(scans_of("phone", table(MOST_KEPT + 100))) == MOST_KEPT
    repeated = table(2).with_columns(repeated=pl.lit(value=True))
    assert len(scans_of("phone", repeated)) == 0
