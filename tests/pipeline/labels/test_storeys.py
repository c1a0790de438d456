"""Sessions over several floors through a whole run: each row has its own floor and height."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.heights import estimate_heights
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import STRATEGIES, strategy_named
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb, SessionLayout, SiteColumn
from vislam2tag.simulation.survey import WritingOptions, simulate

ELEVATED = frozenset({SiteColumn.ELEVATION, SiteColumn.Z})


@dataclass(frozen=True)
class High:
    """The paper's global mapping with the heights and floors that the tracker's vertical axis gives."""

    settings: MappingSettings
    needs: str = "two landmarks"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        mapped = strategy_named("global", self.settings).map(camera, log, landmarks)
        heights = estimate_heights(camera, log, landmarks)
        position = np.column_stack((mapped.position_bcs[:, :2], heights.z_m))
        return replace(mapped, position_bcs=position, floor=heights.floor)


@contextmanager
def high_registered() -> Iterator[None]:
    """Make the strategy known as ``high`` (in this process only: one job)."""
    STRATEGIES.all()  # what is loaded meanwhile would be forgotten
    with mock.patch.dict(STRATEGIES._items, {"high": High}):
        yield


def run(survey: Path, out: Path, strategy: str = "high") -> list[SessionResult]:
    with high_registered():
        process(survey, out, Settings(strategy=strategy))
    return [SessionResult.model_validate_json(path.read_bytes()) for path in sorted(out.glob("sessions/*.json"))]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two walks by stairs and lift over three floors; no session starts on floor 2."""
    out = tmp_path_factory.mktemp("storeys") / "survey"
    scenario = regular_survey(4, "mild", (0, 1, 2), ("LG",), 1, 150.0, climb=Climb.MIXED, pressure=True)
    kept = tuple(planned for planned in scenario.sessions if planned.key.floor < 2)
    simulate(replace(scenario, sessions=kept), out, WritingOptions(columns=ELEVATED))
    return out


@pytest.fixture(scope="module")
def results(survey: Path) -> list[SessionResult]:
    return run(survey, survey.parent / "out")


@pytest.mark.parametrize("table", ["trajectory", "wifi", "sensors"])
def test_rows_have_the_true_floor_and_height(survey: Path, results: list[SessionResult], table: str) -> None:
    for result in results:
        truth = pl.read_csv(survey / f"floor_{result.floor}" / result.device / result.session / "truth.csv")
        rows = pl.read_parquet(survey.parent / "out" / table / f"{result.slug}.parquet").drop_nulls("x")
        nearest = rows.sort("time_ns").join_asof(
            truth.sort("time_ns"), on="time_ns", strategy="nearest", suffix="_true"
        )
        assert len(nearest) > 100
        assert np.mean(nearest["floor"].to_numpy() == nearest["floor_true"].to_numpy()) > 0.95
        assert np.abs(nearest["z"].to_numpy() - nearest["z_true"].to_numpy()).mean() < 0.2
        assert len(set(nearest["floor"])) > 1


def test_landmarks_of_all_floors_are_used(results: list[SessionResult]) -> None:
    for result in results:
        assert len({int(name) // 100 for name in result.landmarks_logged}) > 1
        kinds = {finding.kind for finding in result.findings}
        assert not kinds & {"landmark_without_position", "landmark_of_other_floor"}


def test_every_floor_walked_is_drawn(survey: Path, results: list[SessionResult]) -> None:
    for result in results:
        assert result.elsewhere
        assert result.floor not in result.elsewhere
        for floor, drawing in result.elsewhere.items():
            assert drawing.mapped
            assert not drawing.raw
            assert f'class="part" data-floor="{floor}"' in (survey.parent / "out" / "report.html").read_text()
    walked = {floor for result in results for floor in result.elsewhere} | {result.floor for result in results}
    page = (survey.parent / "out" / "report.html").read_text()
    assert all(f'<section class="floor" id="floor-{floor}">' in page for floor in walked)


def test_a_second_run_repeats_only_what_another_floors_file_changes(survey: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "survey")
    first = run(tmp_path / "survey", tmp_path / "out")
    assert run(tmp_path / "survey", tmp_path / "out") == first
    (tmp_path / "survey" / "floor_dimensions.csv").write_text(
        "id,width,height,elevation\n0,60,32,1\n1,60,32,5\n2,60,32,8\n"
    )
    moved = run(tmp_path / "survey", tmp_path / "out")
    assert all(a.fingerprint != b.fingerprint for a, b in zip(first, moved, strict=True))
    z = pl.read_parquet(tmp_path / "out" / "trajectory" / f"{first[0].slug}.parquet").drop_nulls("z")
    assert z["z"][0] == pytest.approx(2.4, abs=0.3)


def test_the_papers_strategies_leave_height_null_and_keep_the_sessions_floor(survey: Path, tmp_path: Path) -> None:
    for result in run(survey, tmp_path / "out", "local"):
        rows = pl.read_parquet(tmp_path / "out" / "trajectory" / f"{result.slug}.parquet")
        assert set(rows["floor"]) == {result.floor}
        assert rows["z"].null_count() == len(rows)
        assert not result.elsewhere


def test_an_id_in_two_places_fails_the_sessions_that_saw_it(survey: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "survey")
    seen = run(survey, survey.parent / "out")[0].landmarks_logged
    own = next(name for name in seen if int(name) < 100)
    with (tmp_path / "survey/floor_2/marker_dict.csv").open("a") as file:
        file.write(f"{own},1.0,2.0,1.4\n")
    failed = run(tmp_path / "survey", tmp_path / "out")[0]
    assert failed.error is not None
    assert f"landmark {own}, which two floors have at different places" in failed.error
    assert "floor_2/marker_dict.csv:14" in failed.error
    correction = f"[[exclude_landmark]]\nid = {own}\nfloor = 2\nreason = 'typed twice'\n"
    (tmp_path / "survey/corrections.toml").write_text(correction)
    assert run(tmp_path / "survey", tmp_path / "out")[0].error is None


def test_ids_that_repeat_on_every_floor_are_told_apart_by_the_floors_that_the_walker_tells(tmp_path: Path) -> None:
    scenario = regular_survey(4, "mild", (0, 1, 2), ("LG",), 1, 120.0, climb=Climb.STAIRS)
    options = WritingOptions(columns=ELEVATED, layout=SessionLayout.PHONE)
    simulate(replace(scenario, sessions=scenario.sessions[:1]), tmp_path / "survey", options)
    for path in (*tmp_path.glob("survey/floor_*/marker_dict.csv"), *tmp_path.rglob("LandmarkPose.csv")):
        path.write_text(re.sub(r"(?m)^(\d{15},)?[12](\d\d),", r"\1\2,", path.read_text()))
        path.write_text(re.sub(r"(?m)^(\d{15},)?0?(\d),", r"\1\2,", path.read_text()))
    (events,) = tmp_path.rglob("Events.csv")
    truth = pl.read_csv(events.with_name("truth.csv")).sort("time_ns")
    arrivals = truth.filter(pl.col("floor") != pl.col("floor").shift(1))
    with events.open("a") as file:
        for time_ns, floor in arrivals.select("time_ns", "floor").iter_rows():
            file.write(f"{time_ns},floor,{floor}\n")
    (result,) = run(tmp_path / "survey", tmp_path / "out")
    assert result.error is None
    assert result.floors_told == sorted(set(arrivals["floor"].to_list()))
    assert any("(floor 1)" in name for name in result.landmarks_logged)
    rows = pl.read_parquet(tmp_path / "out" / "wifi" / f"{result.slug}.parquet").drop_nulls("x").sort("time_ns")
    rows = rows.join_asof(truth, on="time_ns", strategy="nearest", suffix="_true")
    assert len(set(rows["floor_true"])) > 1
    assert np.mean(rows["floor"].to_numpy() == rows["floor_true"].to_numpy()) > 0.95
    assert run(tmp_path / "survey", tmp_path / "out") == [result]  # kept
