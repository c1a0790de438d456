"""Slips of a tracker, told by inertial sensors that do not slip along.

Losses bridged by inertial sensors: where the walker was meanwhile, and how far the tracker's map has turned.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations, tracker_slips
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.quality.evaluation.truth import errors_at_frames, read_truth
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.simulation import tracker
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.survey import simulate
from vislam2tag.simulation.tracker_camera import CameraFrames, DeadReckoning, dead_reckon
from vislam2tag.site.corrections.file import Corrections

TIME_S = np.arange(0.0, 60.0, 0.1)
SOUND = np.ones(len(TIME_S) - 1, dtype=bool)


def ways(slip: complex, at_s: float = 30.0) -> tuple[ComplexArray, ComplexArray]:
    """A tracker's path with a slip of half a second round a bend, and the inertial one, turned, scaled and noisy."""
    rng = np.random.default_rng(0)
    step = 0.12 * np.exp(1j * np.clip((TIME_S - 20) / 2, 0, 1)) + rng.normal(0, 0.003, (len(TIME_S), 2)) @ (1, 1j)
    felt = np.cumsum(0.9 * np.exp(0.7j) * (step + rng.normal(0, 0.004, (len(TIME_S), 2)) @ (1, 1j)))
    return np.cumsum(step) + slip * np.clip((TIME_S - at_s) / 0.5, 0, 1), felt


@pytest.mark.parametrize("slip", [0.7 + 0j, -0.5j, -0.6 + 0.3j])
def test_a_slip_is_found_with_its_size_and_way(slip: complex) -> None:
    ((steps, off),) = tracker_slips(TIME_S, *ways(slip), SOUND)
    assert off == pytest.approx(slip, abs=0.12)
    assert TIME_S[steps.start] <= 30.1
    assert TIME_S[steps.stop] >= 30.4


def told(slip: complex, sound: BoolArray) -> int:
    return len(tracker_slips(TIME_S, *ways(slip), sound))


def test_nothing_is_found_where_ways_agree_or_one_of_them_is_not_known() -> None:
    assert told(0j, SOUND) == 0
    assert told(0.7, SOUND & (np.abs(TIME_S[1:] - 30.2) > 0.5)) == 0
    assert told(0.7, np.zeros_like(SOUND)) == 0
    seen, walked = ways(0.7)
    assert tracker_slips(TIME_S[:5], seen[:5], walked[:5], SOUND[:4]) == []


WAY = corners((30, 0), (0, 30), (-25, 0))
SPEED_M_S = 1.2
LOST_S = (22.5, 27.5)
"""Around the first corner, at 25 s."""


@pytest.fixture(scope="module")
def log() -> InertialLog:
    return walked(WAY, speed_m_s=SPEED_M_S, noise=0.05)[0]


def truth(log: InertialLog) -> tuple[FloatArray, ComplexArray]:
    """Times of ten frames a second, and where the walker was."""
    time_s = np.arange(0.5, 69.5, 0.1)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(WAY, axis=0), axis=1))))
    place = [np.interp(SPEED_M_S * time_s, along, axis) for axis in WAY.T]
    return time_s, np.asarray(place[0] + 1j * place[1])


def track(
    log: InertialLog, shift: complex = 0j, turn_rad: float = 0.0, lost_s: tuple[float, float] = LOST_S
) -> CameraTrack:
    """A tracker that sees all but the loss, over which it stays where it was; found again, it is off."""
    time_s, place = truth(log)
    lost = (time_s >= lost_s[0]) & (time_s < lost_s[1])
    after = time_s >= lost_s[1]
    found = place[after][0] if after.any() else 0j
    place = np.where(after, found + (place - found) * np.exp(1j * turn_rad) + shift, place)
    if lost.any():
        place[lost] = place[np.flatnonzero(lost)[0] - 1]
    position = np.column_stack((place.real, np.zeros_like(time_s), -place.imag))
    count = len(time_s)
    return CameraTrack(
        log.force_ns[0] + np.round(time_s * 1e9).astype(np.int64),
        position,
        np.tile((0.0, 0.0, 0.0, 1.0), (count, 1)),
        np.full(count, Status.OK, dtype=np.int8),
        inertial=log,
    )


def observed(camera: CameraTrack) -> tuple[Odometry, Odometry]:
    """Without and with a bridge."""
    without = WalkObservations.of(camera, no_landmarks(), 6.0).odometry
    return without, bridged_observations(camera, no_landmarks(), 6.0).odometry


def test_a_corner_walked_in_a_loss_is_found_and_the_way_behind_it_stays_tied(log: InertialLog) -> None:
    time_s, place = truth(log)
    inside = (time_s > LOST_S[0]) & (time_s < LOST_S[1])
    without, bridge = observed(track(log, shift=0.3 - 0.2j))
    errors = [np.abs(odometry.path - as_complex(WAY[0]) - place) for odometry in (without, bridge)]
    assert errors[0][inside].max() > 1.0
    assert errors[1][inside].max() < 0.6
    assert errors[1][-1] < 0.6
    assert np.sqrt(bridge.jump_m2.sum()) < 0.5 * np.sqrt(without.jump_m2.sum())
    assert (bridge.blind == without.blind).all()


def test_a_walk_that_is_never_found_again_is_carried_on(log: InertialLog) -> None:
    time_s, place = truth(log)
    without, bridge = observed(track(log, lost_s=(45.0, 100.0)))
    last = time_s < 60
    assert np.abs(without.path - place)[last].max() > 10
    assert np.abs(bridge.path - place)[last].max() < 3


def test_a_map_that_is_another_one_after_a_loss_is_turned_back(log: InertialLog) -> None:
    _, place = truth(log)
    without, bridge = observed(track(log, shift=60 + 40j, turn_rad=0.9))
    ahead = np.angle((place[-1] - place[-100]) / (without.path[-1] - without.path[-100]))
    assert abs(ahead) == pytest.approx(0.9, abs=0.05)
    assert np.angle((place[-1] - place[-100]) / (bridge.path[-1] - bridge.path[-100])) == pytest.approx(0, abs=0.15)
    assert bridge.turn[-1] == pytest.approx(without.turn[-1] * np.exp(1j * ahead), abs=0.15)
    assert np.abs(bridge.path - place).max() < 2.0
    assert bridge.jump_rad2.sum() < 0.1 * without.jump_rad2.sum()


def test_a_walk_without_losses_or_readings_stays_as_it_is(log: InertialLog) -> None:
    whole, lost = track(log, lost_s=(0.0, 0.0)), track(log, shift=0.3)
    unheard = replace(lost, inertial=replace(log, force_ns=log.force_ns + 10**12, rate_ns=log.rate_ns + 10**12))
    for camera in (whole, replace(lost, inertial=None), unheard):
        without, bridge = observed(camera)
        assert np.abs(bridge.path - without.path).max() < 1e-9
        assert (bridge.jump_m2 == without.jump_m2).all()


def test_inertial_readings_that_do_not_belong_to_the_walk_are_not_believed(log: InertialLog) -> None:
    rng = np.random.default_rng(0)
    other = replace(log, rate=log.rate + np.cumsum(rng.normal(0, 0.4, log.rate.shape), axis=0))
    trusted, odd = (observed(replace(track(log), inertial=each))[1] for each in (log, other))
    assert odd.jump_m2.sum() > 4 * trusted.jump_m2.sum()


def test_stretches_that_would_end_after_the_last_frame_are_not_tried(log: InertialLog) -> None:
    camera = track(log, shift=0.3, lost_s=(22.5, 27.2))
    late_ns = np.full(len(camera.time_ns), 50_000_000)
    late_ns[[0, -1]] = 0, 20_000_000
    assert np.isfinite(observed(replace(camera, time_ns=camera.time_ns + late_ns))[1].path).all()


def test_a_slip_that_the_sensors_tell_of_is_doubted_where_it_was_and_no_other_step_is(log: InertialLog) -> None:
    time_s, _ = truth(log)
    sound = track(log, lost_s=(0.0, 0.0))
    off = np.clip((time_s - 40.0) / 0.5, 0, 1)[:, None] * (0.0, 0.0, 0.8)
    doubts = [
        bridged_observations(camera, no_landmarks(), 6.0, slips=True).odometry.doubt
        for camera in (sound, replace(sound, position_acs=sound.position_acs + off))
    ]
    assert np.abs(doubts[0]).max() < 0.3
    at = int(np.abs(doubts[1]).argmax())
    assert abs(time_s[at] - 40.25) < 0.5
    assert doubts[1][at] == pytest.approx(-0.8j, abs=0.2)
    assert (np.abs(np.delete(doubts[1], at)) < 0.3).all()


def test_a_tracker_that_slips_between_landmarks_is_asked_after(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reckon = dead_reckon

    def slipping(frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator) -> DeadReckoning:
        way, at_s = reckon(frames, settings, rng), (frames.exposure_ns - frames.exposure_ns[0]) * 1e-9
        return replace(way, plane=way.plane + (0.8 + 0.4j) * np.clip((at_s - 35) / 0.5, 0, 1))

    monkeypatch.setattr(tracker, "dead_reckon", slipping)
    simulate(regular_survey(5, "none", (0,), ("LG",), 1, 70.0), tmp_path / "survey")
    survey = open_survey(tmp_path / "survey")
    prepared = prepared_session(SessionTask(survey.sessions[0], survey.site, Corrections()))
    camera, seen = prepared.session.camera, prepared.session.landmarks
    strategy = strategy_named("smoother", MappingSettings())
    truth = read_truth(survey.sessions[0].folder / "truth.csv")
    means = []
    for each in (camera, replace(camera, inertial=None)):
        errors = errors_at_frames(strategy.map(each, seen, prepared.landmarks), truth)
        means.append(float(np.nanmean(errors)))
    assert means[0] < 0.8 * means[1]
