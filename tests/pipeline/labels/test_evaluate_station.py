from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vislam2tag.common.findings import Finding
from vislam2tag.pipeline.labels import evaluate_session as evaluating
from vislam2tag.pipeline.labels.evaluate_session import (
    AT_PRISM,
    EvaluationJob,
    TruthComparisons,
    evaluate_station,
    station_jobs,
)
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.quality.evaluation.station_frame import read_station_track
from vislam2tag.quality.evaluation.truth import PointErrors, walking_velocity
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.simulation.phones import make_device
from vislam2tag.simulation.scenario import PlannedSession, paper_evaluation
from vislam2tag.simulation.settings import Locale
from vislam2tag.simulation.survey import STATION_FILE, simulate
from vislam2tag.site.corrections.file import read_corrections

SEED = 5
LAG_S = 0.055


@pytest.fixture(scope="module")
def planned() -> list[PlannedSession]:
    """Two walks of one phone in a total station's view, with presses at control points."""
    chosen = [one for one in paper_evaluation(SEED, "mild").sessions if one.key.device == "LG_tachy"][:2]
    walk = chosen[0].walk.model_copy(update={"control_points": True})
    return [replace(one, walk=walk, presses=True, duration_s=60.0) for one in chosen]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, planned: list[PlannedSession]) -> Path:
    root = tmp_path_factory.mktemp("station") / "survey"
    simulate(replace(paper_evaluation(SEED, "mild"), sessions=tuple(planned)), root)
    return root


@pytest.fixture
def survey(written: Path, tmp_path: Path) -> Path:
    """A copy to change."""
    return Path(shutil.copytree(written, tmp_path / "survey"))


def shown(root: Path) -> list[TruthComparisons]:
    opened = open_survey(root)
    corrections, out = read_corrections(root), OutputFolder(root.with_name("out"))
    jobs = [
        EvaluationJob(SessionTask(ref, opened.site, corrections), Settings(), ("smoother",), None, out)
        for ref in opened.sessions
    ]
    (device,) = station_jobs(jobs)
    found = evaluate_station(device)
    return [found[ref.slug] for ref in opened.sessions]


def median_m(found: TruthComparisons) -> dict[str, float | None]:
    """Median error by the method of comparing."""
    return {one.method: one.median_m for one in found.measured}


def true_clock_s(planned: PlannedSession) -> float:
    """What the labels' clock lacks to the station's, the lag of the poses taken off."""
    station_ns = planned.boot_unix_ns + make_device(planned.key.device, Locale.MIXED, SEED).station_clock_ns
    return station_ns * 1e-9 - LAG_S


def test_clock_frame_and_lag_of_a_generated_phone(written: Path, planned: list[PlannedSession]) -> None:
    found = shown(written)
    assert len(found) == 2
    for one, plan in zip(found, planned, strict=True):
        sigma_s, error_m = one.estimates["station_clock_sigma_s"], median_m(one)[AT_PRISM]
        assert one.missing == []
        assert sigma_s is not None
        assert sigma_s < 0.1
        assert one.estimates["station_clock_s"] == pytest.approx(true_clock_s(plan), abs=0.08)
        assert one.estimates["pose_lag_s"] == pytest.approx(LAG_S, abs=0.005)
        assert one.estimates["station_frame_worst_m"] == pytest.approx(0, abs=0.03)
        assert error_m is not None
        assert error_m < 0.25


@pytest.mark.slow
def test_without_shots_presses_give_the_frame(survey: Path) -> None:
    by_shots = shown(survey)
    shutil.rmtree((survey / "floor_4" / STATION_FILE).parent)
    for one, shot in zip(shown(survey), by_shots, strict=True):
        pressed_m, shot_m = median_m(one)[AT_PRISM], median_m(shot)[AT_PRISM]
        assert one.missing == []
        assert pressed_m is not None
        assert shot_m is not None
        assert pressed_m == pytest.approx(shot_m, abs=0.5)


def test_a_single_common_point_is_not_enough(survey: Path) -> None:
    (survey / "floor_4" / STATION_FILE).write_text("landmark;X;Y\n9;0;0\n")
    for presses in survey.glob("floor_4/*/*/refMarker.csv"):
        presses.unlink()
    for one in shown(survey):
        assert "needs at least two common points, but only landmark 9 is known" in one.missing[0]
        assert one.measured == []


def test_a_track_that_cannot_be_read_concerns_its_session_alone(survey: Path) -> None:
    first = sorted(survey.glob("floor_4/*/*/tachy.csv"))[0]
    first.write_text("time;X;Y\n")
    found = shown(survey)
    assert [bool(one.measured) for one in found] == [False, True]
    assert "tachy.csv: expected" in found[0].missing[0]


@pytest.mark.slow
def test_a_clock_set_between_the_walks_is_told(survey: Path) -> None:
    last = sorted(survey.glob("floor_4/*/*/tachy.csv"))[1]
    last.write_text(last.read_text().replace("2022-01-14 16:", "2022-01-14 20:"))
    (other,) = [one for one in shown(survey) if not one.measured]
    assert [finding.kind for finding in other.findings] == ["station_no_overlap"]
    assert abs(float(other.findings[0].message.split("would be ")[1].split(" s off")[0])) == pytest.approx(14400, abs=1)


def test_walks_are_compared_with_where_the_camera_was_not_the_prism(
    survey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared: list[PointErrors] = []

    def keep(walks: Sequence[PointErrors]) -> list[Finding]:
        compared.extend(walks)
        return []

    monkeypatch.setattr(evaluating, "frame_against_walks", keep)
    for path in survey.glob("floor_4/*/*/tachy.csv"):
        hang_aside(path, 0.5)
    shown(survey)
    assert len(compared) == 2
    assert all(abs(np.nanmedian(one.across_m)) < 0.2 for one in compared)


def test_a_session_that_is_not_compared_is_not_told_that_walks_contradict_the_frame(
    survey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = Finding(kind="station_frame", file="", count=3, message="around there")
    monkeypatch.setattr(evaluating, "frame_against_walks", lambda walks: [odd] if walks else [])
    last = sorted(survey.glob("floor_4/*/*/tachy.csv"))[1]
    last.write_text(last.read_text().replace("2022-01-14 16:", "2022-01-14 20:"))
    for found in shown(survey):
        assert (odd in found.findings) == bool(found.measured)


def hang_aside(path: Path, left_m: float) -> None:
    """Write a track anew as of a prism to the left of the camera."""
    track = read_station_track(path)
    velocity = walking_velocity(track.time_ns, track.time_ns, track.position)
    left = velocity[:, ::-1] * (-1, 1) / np.linalg.norm(velocity, axis=1, keepdims=True).clip(0.2)
    times = [row.split(";")[0] for row in path.read_text().splitlines()]
    rows = [f"{time};{x:.4f};{y:.4f}" for time, (x, y) in zip(times[1:], track.position + left_m * left, strict=True)]
    path.write_text("\n".join(["time;X;Y", *rows]) + "\n")
