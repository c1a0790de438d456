from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vislam2tag.evaluation.truth import read_truth
from vislam2tag.pipeline.station_truths import SessionStation, station_truths
from vislam2tag.sessions import open_survey
from vislam2tag.settings import Settings
from vislam2tag.simulation.devices import Locale, make_device
from vislam2tag.simulation.scenario import PlannedSession, paper_evaluation
from vislam2tag.simulation.survey import STATION_FILE, simulate
from vislam2tag.survey.corrections import read_corrections

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


def truths(root: Path) -> list[SessionStation]:
    opened = open_survey(root)
    return list(station_truths(root, opened.sessions, opened.site, read_corrections(root), Settings()).values())


def true_clock_s(planned: PlannedSession) -> float:
    """What the labels' clock lacks to the station's, the lag of the poses taken off."""
    station_ns = planned.boot_unix_ns + make_device(planned.key.device, Locale.MIXED, SEED).station_clock_ns
    return station_ns * 1e-9 - LAG_S


def farthest_m(root: Path, found: SessionStation, planned: PlannedSession) -> float:
    """How far the station's truth lies from the simulator's, by then and there."""
    assert found.truth is not None
    key = planned.key
    truth = read_truth(root / f"floor_{key.floor}" / key.device / key.session / "truth.csv")
    since_s = (found.truth.time_ns - truth.time_ns[0]) * 1e-9 - LAG_S
    frames_s = (truth.time_ns - truth.time_ns[0]) * 1e-9
    xy = [np.interp(since_s, frames_s, truth.position_bcs[:, axis]) for axis in (0, 1)]
    return float(np.quantile(np.linalg.norm(np.column_stack(xy) - found.truth.position_bcs, axis=1), 0.95))


def test_clock_frame_and_lag_of_a_generated_phone(written: Path, planned: list[PlannedSession]) -> None:
    found = truths(written)
    assert len(found) == 2
    for one, plan in zip(found, planned, strict=True):
        sigma_s = one.estimates["station_clock_sigma_s"]
        assert one.missing == ""
        assert sigma_s is not None
        assert sigma_s < 0.1
        assert one.estimates["station_clock_s"] == pytest.approx(true_clock_s(plan), abs=0.08)
        assert one.estimates["pose_lag_s"] == pytest.approx(LAG_S, abs=0.005)
        assert one.estimates["station_frame_residual_m"] == pytest.approx(0, abs=0.03)
        assert farthest_m(written, one, plan) < 0.15


def test_without_shots_presses_give_the_frame(survey: Path, planned: list[PlannedSession]) -> None:
    shutil.rmtree((survey / "floor_4" / STATION_FILE).parent)
    for one, plan in zip(truths(survey), planned, strict=True):
        assert one.missing == ""
        assert farthest_m(survey, one, plan) < 0.6


def test_a_single_common_point_is_not_enough(survey: Path) -> None:
    (survey / "floor_4" / STATION_FILE).write_text("landmark;X;Y\n9;0;0\n")
    for presses in survey.glob("floor_4/*/*/refMarker.csv"):
        presses.unlink()
    assert ["needs two common points at least, only landmark 9 is known" in one.missing for one in truths(survey)] == [
        True,
        True,
    ]


def test_a_track_that_cannot_be_read_concerns_its_session_alone(survey: Path) -> None:
    first = sorted(survey.glob("floor_4/*/*/tachy.csv"))[0]
    first.write_text("time;X;Y\n")
    found = truths(survey)
    assert sorted(one.truth is None for one in found) == [False, True]
    assert any("tachy.csv: expected" in one.missing for one in found)


def test_a_clock_set_between_the_walks_is_told(survey: Path) -> None:
    last = sorted(survey.glob("floor_4/*/*/tachy.csv"))[1]
    last.write_text(last.read_text().replace("2022-01-14 16:", "2022-01-14 20:"))
    (other,) = [one for one in truths(survey) if one.truth is None]
    assert [finding.kind for finding in other.findings] == ["station_no_overlap"]
    assert abs(float(other.findings[0].message.split("would be ")[1].split(" s off")[0])) == pytest.approx(14400, abs=1)
