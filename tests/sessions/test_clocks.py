"""Clocks of one session."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.settings import MappingSettings, SmootherSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.sessions.clocks import agreement_by_motion, late_scans, pose_lag_of
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.scenario import POSE_LAGS_S, regular_survey
from vislam2tag.simulation.settings import SessionLayout, WalkStyle, walk_settings
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.corrections.file import Corrections, ShiftClock
from vislam2tag.site.model import Survey


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


def test_scans_after_the_end_of_the_recording_are_on_another_clock(session: Session) -> None:
    time_ns, sensors = session.tables["wifi"]["time_ns"].to_numpy(), session.tables["sensors"]
    assert late_scans(time_ns, "wifi.csv", session.camera, sensors) == []
    (finding,) = late_scans(time_ns + 15 * 10**9, "wifi.csv", session.camera, sensors)
    assert finding.kind == "clock_mismatch"
    assert 0 < finding.count < len(time_ns)


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


def written(out: Path, layout: SessionLayout, *, without_poses: bool = False) -> Path:
    """The folder of a session with every table, below a survey."""
    walk = walk_settings(WalkStyle.CONTROL_POINTS)
    scenario = replace(regular_survey(5, "none", (0,), ("LG",), 1, 60.0, walk=walk), ble=True, rtt=True)
    scenario = replace(scenario, sessions=tuple(replace(each, presses=True) for each in scenario.sessions))
    simulate(scenario, out, WritingOptions(layout=layout, without_poses=without_poses))
    return next(out.glob("floor_0/LG/*"))


def read(folder: Path) -> Session:
    return read_session(open_survey(folder.parents[2]).sessions[0])


def in_unit(path: Path, ns_per_unit: int, separator: str, column: int = 0) -> None:
    """Convert the times of a table, which are in ns; a header stays."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        fields = line.split(separator)
        if fields[column].strip().isdigit():
            fields[column] = str(int(fields[column]) // ns_per_unit)
        lines.append(separator.join(fields))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize("ns_per_unit", [10**3, 10**6])
def test_all_tables_of_the_phone_app_are_brought_to_ns(tmp_path: Path, ns_per_unit: int) -> None:
    folder = written(tmp_path / "survey", SessionLayout.PHONE)
    true = read(folder)
    tables = sorted(folder.glob("*.csv"))
    for path in tables:
        in_unit(path, ns_per_unit, ",")
    found = read(folder)
    named = {finding.file for finding in found.findings if finding.kind == "time_unit"}
    assert named >= {path.name for path in tables if path.stem in ("CameraPose", "Ble", "Rtt", "Events", "AnchorPose")}
    assert "ControlPoint.csv" in named
    assert not {"clock_mismatch"} & {finding.kind for finding in found.findings}
    assert abs(found.presses_ns - true.presses_ns).max() < ns_per_unit
    for name, table in true.tables.items():
        apart_ns = found.tables[name]["time_ns"].to_numpy() - table["time_ns"].to_numpy()
        assert abs(apart_ns).max() < ns_per_unit
    assert (found.camera.anchors is None) == (true.camera.anchors is None)


@pytest.mark.parametrize("layout", list(SessionLayout))
@pytest.mark.parametrize("ns_per_unit", [10**3, 10**6])
def test_fixes_of_a_session_without_poses_are_brought_to_ns(
    tmp_path: Path, layout: SessionLayout, ns_per_unit: int
) -> None:
    folder = written(tmp_path / "survey", layout, without_poses=True)
    true = read(folder).camera.fixes
    in_unit(folder / "fixes.csv", ns_per_unit, "; ")
    (sensors,) = (path for path in folder.glob("*.csv") if path.stem.lower() == "sensors")
    in_unit(sensors, ns_per_unit, "; " if sensors.stem == "sensors" else ",")
    session = read(folder)
    found = session.camera.fixes
    assert true is not None
    assert found is not None
    assert abs(found.time_ns - true.time_ns).max() < ns_per_unit
    assert {finding.file for finding in session.findings if finding.kind == "time_unit"} >= {"fixes.csv", sensors.name}


def test_motion_is_compared_at_its_own_times_if_there_is_enough_of_it() -> None:
    rng = np.random.default_rng(2)
    our_ns = np.arange(0, 60, 0.02) * 1e9
    ours = np.convolve(np.abs(rng.normal(0, 3, len(our_ns))), np.ones(15) / 15, "same")

    def agreement(rows: slice, values: FloatArray = ours, late_ns: int = 0, spread: float = 0.1) -> float | None:
        their_ns = our_ns.astype(np.int64)[rows] + late_ns
        return agreement_by_motion(their_ns, values[rows], our_ns.astype(np.int64), ours, spread)

    assert agreement(slice(None), 57.3 * ours, 150_000_000) == pytest.approx(1.0, abs=0.02)
    assert agreement(slice(1000, 2000, 5)) == pytest.approx(1.0, abs=0.02)
    other = agreement(slice(None), ours[::-1])
    assert other is not None
    assert other < 0.3
    assert agreement(slice(1000, 1500), ours[::-1]) is None, "10 s"
    assert agreement(slice(None, None, 50), ours[::-1]) is None, "a row a second"
    assert agreement(slice(None), 0 * ours) is None, "no gyroscope"
    assert agreement(slice(None), ours[::-1], spread=9.0) is None, "standing still"
    assert agreement(slice(0, 0)) is None
