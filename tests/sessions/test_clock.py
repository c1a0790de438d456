"""How late poses are stamped, by a session's own gyroscope."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from vislam2tag.estimation.settings import MappingSettings, SmootherSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.sessions.clock import pose_lag_of
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.scenario import POSE_LAGS_S, regular_survey
from vislam2tag.simulation.survey import simulate
from vislam2tag.survey.corrections.file import Corrections, ShiftClock
from vislam2tag.survey.model import Survey


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    root = tmp_path_factory.mktemp("lag") / "survey"
    simulate(regular_survey(3, "none", floors=(0,), devices=("LG",), sessions=1, duration_s=60.0), root)
    return open_survey(root)


@pytest.fixture(scope="module")
def session(survey: Survey) -> Session:
    return read_session(survey.sessions[0])


def test_the_gyroscope_tells_how_late_poses_are_stamped(session: Session) -> None:
    assert session.camera.pose_lag_s == pytest.approx(POSE_LAGS_S[session.key.device], abs=0.005)


def test_a_shifted_clock_changes_it(session: Session) -> None:
    shift = ShiftClock(table="camera", offset_s=-0.1)
    corrected, _ = corrected_session(session, Corrections(shift_clock=(shift,)))
    assert session.camera.pose_lag_s is not None
    assert corrected.camera.pose_lag_s == pytest.approx(session.camera.pose_lag_s - 0.1, abs=0.002)


def test_without_a_gyroscope_nothing_tells(session: Session) -> None:
    assert pose_lag_of(session.camera, session.tables["sensors"].filter(pl.col("sensor") != "GYRO")) is None


def test_the_smoother_allows_for_it_if_told_to_and_others_never_do(survey: Survey, session: Session) -> None:
    landmarks = survey.site.landmarks.on_floor(session.key.floor)
    prompt = replace(session.camera, pose_lag_s=None)
    allowing = MappingSettings(smoother=SmootherSettings(allow_for_pose_lag=True))

    def positions(name: str, settings: MappingSettings, *, told: bool) -> object:
        camera = session.camera if told else prompt
        return strategy_named(name, settings).map(camera, session.landmarks, landmarks).position_bcs

    for name, settings in (("local", allowing), ("smoother", MappingSettings())):
        np.testing.assert_array_equal(positions(name, settings, told=True), positions(name, settings, told=False))
    moved = np.asarray(positions("smoother", allowing, told=True)) - positions("smoother", allowing, told=False)
    usual = float(np.nanmedian(np.hypot(moved[:, 0], moved[:, 1])))
    assert usual == pytest.approx(POSE_LAGS_S[session.key.device], rel=0.3)  # somebody who walks a metre a second
