"""Steps of the tracker that are no motion: taken out, reported, and nothing else touched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.drifting import Drifting, about_vertical, camera_track, loops, nothing_logged
from tests.walks import camera_on, log_of, rows_of_log, to_acs
from vislam2tag.core.arrays import BoolArray, ComplexArray
from vislam2tag.core.status import EventKind
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import as_complex, as_points, multiply
from vislam2tag.estimation.odometry import CAMERA_TURN_SIGMA_RAD, Odometry, continuous_odometry
from vislam2tag.estimation.steps import FOUND_M_S

MILLIMETRE = 1e-3
Session = tuple[CameraTrack, LandmarkLog]


def logged(seed: int, rate_hz: float = 30.0) -> tuple[Drifting, Session]:
    walk = loops(seed, marks=6, laps=1, rate_hz=rate_hz)
    return walk, walk.logged()


def moved(session: Session, late: BoolArray, turn_rad: float, shift: complex, *, with_map: bool = True) -> Session:
    """Turn and shift the camera, and with the map all landmarks, of the frames of a mask."""
    camera, log = session
    rows = late[log.frame] & with_map
    turn = about_vertical(np.array([turn_rad]))

    def carried(plane: ComplexArray) -> ComplexArray:
        return np.asarray(plane * np.exp(1j * turn_rad) + shift)

    camera = replace(camera, position_acs=camera.position_acs.copy(), orientation_acs=camera.orientation_acs.copy())
    log = replace(log, position_acs=log.position_acs.copy(), orientation_acs=log.orientation_acs.copy())
    for part, which in ((camera, late), (log, rows)):
        plane = as_points(carried(as_complex(part.plane_acs[which])))
        part.position_acs[which] = to_acs(plane, part.position_acs[which, 1])
        part.orientation_acs[which] = multiply(turn, part.orientation_acs[which])
    return camera, log


def after(session: Session, frame: int) -> BoolArray:
    return np.asarray(np.arange(len(session[0].time_ns)) >= frame)


def kinds(odometry: Odometry) -> list[str]:
    return [event.kind.value for event in odometry.events]


def own_frame(path: ComplexArray) -> ComplexArray:
    """A path seen from its own start and from the direction to its 60th frame."""
    return np.asarray((path - path[0]) / np.exp(1j * np.angle(path[60] - path[0])))


@pytest.mark.parametrize("rate_hz", [2.0, 10.0, 30.0, 60.0])
def test_a_walk_without_faults_is_left_as_it_is(rate_hz: float) -> None:
    walk, (camera, log) = logged(1, rate_hz)
    odometry = continuous_odometry(camera, log)
    assert odometry.events == ()
    np.testing.assert_allclose(odometry.path, walk.tracked, atol=1e-6)
    np.testing.assert_allclose(odometry.turn, 1, atol=1e-9)


@settings(max_examples=15)
@given(
    rate_hz=st.sampled_from([10.0, 30.0, 60.0]),
    time_s=st.floats(25, 65),
    turn_rad=st.floats(-3.1, 3.1),
    size_m=st.floats(0.3, 300),
    direction=st.floats(-np.pi, np.pi),
)
def test_a_map_update_of_any_size_and_turn_changes_nothing(
    rate_hz: float, time_s: float, turn_rad: float, size_m: float, direction: float
) -> None:
    _, session = logged(2, rate_hz)
    frame = int(time_s * rate_hz)
    before = continuous_odometry(*session)
    shift = size_m * np.exp(1j * direction)
    camera, log = moved(session, after(session, frame), turn_rad, shift)
    odometry = continuous_odometry(camera, log)
    np.testing.assert_allclose(odometry.path, before.path, atol=MILLIMETRE)
    step = abs(as_complex(camera.plane_acs[frame]) - as_complex(camera.plane_acs[frame - 1]))
    if step > 1:
        assert kinds(odometry) == [EventKind.MAP_UPDATE]
        event = odometry.events[0]
        assert event.frame == frame
        assert event.size_m == pytest.approx(step, abs=0.6)  # but for the way walked in a frame
        assert event.turn_rad == pytest.approx(turn_rad, abs=1e-3)


def test_several_map_updates_in_a_row_change_nothing() -> None:
    _, session = logged(3)
    before = continuous_odometry(*session)
    for frame, turn_rad, shift in ((700, 0.3, 5 + 1j), (710, -1.0, 30j), (1400, 1.0, -4 - 4j)):
        session = moved(session, after(session, frame), turn_rad, shift)
    odometry = continuous_odometry(*session)
    np.testing.assert_allclose(odometry.path, before.path, atol=MILLIMETRE)
    assert kinds(odometry) == [EventKind.MAP_UPDATE] * 3


@pytest.mark.parametrize("size_m", [0.5, 5.0, 50.0])
def test_a_break_is_taken_out_and_reported(size_m: float) -> None:
    _, session = logged(4)
    before = continuous_odometry(*session)
    frame = 1000
    camera, log = moved(session, after(session, frame), 0.0, size_m * np.exp(2j), with_map=False)
    odometry = continuous_odometry(camera, log)
    np.testing.assert_allclose(odometry.path, before.path, atol=0.02)
    assert len(odometry.events) == 1
    event = odometry.events[0]
    assert event.kind in (EventKind.BREAK, EventKind.RELOCALISATION)
    assert event.frame == frame
    assert event.size_m == pytest.approx(size_m, abs=0.05)
    assert odometry.jump_m2[frame - 1] > 0
    assert odometry.jump_rad2[frame - 1] > 0
    assert np.count_nonzero(odometry.jump_m2) == 1


@pytest.mark.parametrize("turned_rad", [0.0, 2.0])
def test_a_step_that_may_have_slipped_stays_and_says_which_way(turned_rad: float) -> None:
    _, session = logged(4)
    session = moved(session, after(session, 500), turned_rad, 3.0 + 0j)  # a map update: the ACS is another one
    before = continuous_odometry(*session)
    shift = 0.025 * np.exp(1j)  # more than five, less than ten times the scatter
    in_acs = complex(shift * np.exp(1j * turned_rad))
    slipped = continuous_odometry(*moved(session, after(session, 1000), 0.0, in_acs, with_map=False))
    (step,) = np.flatnonzero(np.abs(slipped.doubt - before.doubt) > MILLIMETRE)
    assert step == 999
    assert np.angle(slipped.doubt[step] / shift) == pytest.approx(0, abs=0.3)
    assert 0.2 * abs(shift) < abs(slipped.doubt[step]) < 0.7 * abs(shift)
    assert not slipped.jump_m2.any()
    np.testing.assert_allclose(np.diff(slipped.path)[step] - np.diff(before.path)[step], shift, atol=MILLIMETRE)


def test_a_camera_that_holds_its_pose_for_long_is_lost() -> None:
    walk, (camera, log) = logged(5)
    frozen = slice(900, 990)
    camera.position_acs[frozen] = camera.position_acs[900]
    odometry = continuous_odometry(camera, log)
    assert kinds(odometry) == [EventKind.LOSS]
    assert abs(odometry.events[0].frame - 900) <= 1
    lost_s = (camera.time_ns[990] - camera.time_ns[899]) * 1e-9
    assert odometry.jump_m2[899:990].sum() == pytest.approx((FOUND_M_S * lost_s) ** 2)
    assert not odometry.jump_m2[:890].any()
    assert not odometry.jump_m2[1000:].any()
    np.testing.assert_allclose(odometry.path[:899], walk.tracked[:899], atol=1e-6)
    np.testing.assert_allclose(np.diff(odometry.path[995:]), np.diff(walk.tracked[995:]), atol=1e-6)


@pytest.mark.parametrize("how", ["at the camera", "no rows"])
def test_frames_in_which_the_landmarks_are_lost_are_a_loss(how: str) -> None:
    _, (camera, log) = logged(6)
    lost = (log.frame >= 900) & (log.frame < 960)
    if how == "no rows":
        log = rows_of_log(log, ~lost)
    else:
        log.lost[lost] = True
        log.position_acs[lost] = camera.position_acs[log.frame[lost]]
    odometry = continuous_odometry(camera, log)
    assert kinds(odometry) == [EventKind.LOSS]
    assert abs(odometry.events[0].frame - 900) <= 1
    assert odometry.jump_m2[905:955].min() > 0
    assert not odometry.jump_m2[:895].any()


def test_standing_still_is_no_loss() -> None:
    rng = np.random.default_rng(7)
    time_s = np.arange(600) / 30
    path = np.minimum(time_s, 10) + 1e-4 * (rng.standard_normal(600) + 1j * rng.standard_normal(600))
    assert continuous_odometry(camera_track(path.astype(np.complex128), time_s), nothing_logged()).events == ()


@settings(max_examples=10)
@given(turn_rad=st.floats(-3.1, 3.1), x=st.floats(-100, 100), y=st.floats(-100, 100))
def test_the_continuous_path_moves_rigidly_with_the_whole_log(turn_rad: float, x: float, y: float) -> None:
    _, session = logged(8)
    session = moved(session, after(session, 1500), 0.7, 12 - 3j)
    session = moved(session, after(session, 1000), 0.0, 4 + 4j, with_map=False)
    before = continuous_odometry(*session)
    odometry = continuous_odometry(*moved(session, after(session, 0), turn_rad, complex(x, y)))
    np.testing.assert_allclose(own_frame(odometry.path), own_frame(before.path), atol=MILLIMETRE)
    assert [(e.kind, e.frame) for e in odometry.events] == [(e.kind, e.frame) for e in before.events]
    np.testing.assert_allclose(odometry.jump_m2, before.jump_m2, atol=1e-9)


def test_unusable_frames_take_no_part() -> None:
    walk, (camera, log) = logged(9)
    camera.status[500:503] = 9
    camera.position_acs[500:503] = np.nan
    odometry = continuous_odometry(camera, rows_of_log(log, camera.usable[log.frame]))
    assert len(odometry.frame) == len(camera.time_ns) - 3
    assert not np.isin([500, 501, 502], odometry.frame).any()
    assert odometry.events == ()
    np.testing.assert_allclose(odometry.path, walk.tracked[odometry.frame], atol=1e-6)


@pytest.mark.parametrize("hole_s", [3, 60, 600])
@pytest.mark.parametrize("shift", [0.0, 20 + 5j])
def test_a_hole_between_frames_is_a_loss_wherever_the_tracker_is_found_again(hole_s: int, shift: complex) -> None:
    _, session = logged(20)
    late = after(session, 500)
    camera, log = moved(session, late, 0.0, shift, with_map=False)
    odometry = continuous_odometry(replace(camera, time_ns=camera.time_ns + hole_s * 10**9 * late), log)
    assert kinds(odometry) == ["loss"]
    assert odometry.jumped[499]
    assert np.sqrt(odometry.jump_m2[499]) == pytest.approx(0.5 * hole_s, rel=0.05)


def test_frames_that_cannot_be_used_are_no_hole() -> None:
    walk, (camera, log) = logged(21)
    camera.status[500:600] = 1
    odometry = continuous_odometry(camera, log.select([]))
    assert odometry.events == ()
    np.testing.assert_allclose(odometry.path[-1], walk.tracked[-1], atol=1e-6)


def straight(jumps: dict[int, complex]) -> ComplexArray:
    """Ten seconds straight ahead at 1 m/s and 30 Hz, as a tracker logs them that jumps at some frames."""
    path = np.asarray(np.arange(300) / 30, dtype=np.complex128)
    for frame, jump in jumps.items():
        path[frame:] += jump
    return path


def without_landmarks(path: ComplexArray) -> Odometry:
    return continuous_odometry(camera_on(as_points(path)), nothing_logged())


@pytest.mark.parametrize(("size_m", "sigma_m"), [(0.5, 0.05), (0.8, 0.08), (5.0, 0.1), (50.0, 0.1)])
def test_a_break_is_known_within_a_tenth_of_its_size_and_of_a_metre_at_most(size_m: float, sigma_m: float) -> None:
    odometry = without_landmarks(straight({150: size_m * 1j}))
    assert np.sqrt(odometry.jump_m2[149]) == pytest.approx(sigma_m, rel=0.1)
    assert np.rad2deg(np.sqrt(odometry.jump_rad2[149])) == pytest.approx(6, abs=1)  # as no landmark shows its turn


def test_two_landmarks_show_the_turn_of_a_jump_within_two_degrees() -> None:
    camera, shift = camera_on(as_points(straight({150: 3j}))), np.where(np.arange(300) < 150, 0.0, 1.0)
    far = {f"far{y}": to_acs(np.column_stack((np.full(300, 5.0), y + shift)), 1.4) for y in (-20.0, 20.0)}
    odometry = continuous_odometry(camera, log_of(camera, far))
    assert kinds(odometry) == [EventKind.CORRECTION]
    assert np.rad2deg(np.sqrt(odometry.jump_rad2[149])) == pytest.approx(1.7, abs=0.3)


@pytest.mark.parametrize(("back_m", "kind"), [(1.6, "relocalisation"), (2.4, "relocalisation"), (1.2, "break")])
def test_a_jump_that_leads_back_but_for_a_third_undoes_another(back_m: float, kind: str) -> None:
    assert kinds(without_landmarks(straight({100: 2j, 200: -back_m * 1j}))) == ["break", kind]


@pytest.mark.parametrize(("size_m", "reported"), [(0.003, False), (0.01, True)])
def test_map_updates_of_less_than_half_a_centimetre_are_not_reported(size_m: float, reported: bool) -> None:
    camera = camera_on(as_points(straight({150: size_m * 1j})))
    shift = np.where(np.arange(300) < 150, 0.0, size_m)
    far = {f"far{y}": to_acs(np.column_stack((np.full(300, 5.0), y + shift)), 1.4) for y in (-20.0, 20.0)}
    odometry = continuous_odometry(camera, log_of(camera, far))
    assert kinds(odometry) == [EventKind.MAP_UPDATE] * reported
    np.testing.assert_allclose(odometry.path, straight({}), atol=1e-9)


@pytest.mark.parametrize(("gap_s", "expected"), [(1.8, []), (2.2, ["loss"])])
def test_two_seconds_without_a_frame_are_a_loss(gap_s: float, expected: list[str]) -> None:
    camera = camera_on(as_points(straight({150: complex(gap_s)})))  # who walks on meanwhile
    late = np.arange(300) >= 150
    camera = replace(camera, time_ns=camera.time_ns + late * int(gap_s * 1e9))
    assert kinds(continuous_odometry(camera, nothing_logged())) == expected


def camera_of(walk: Drifting) -> CameraTrack:
    """The walk's camera, which looks ahead."""
    return camera_track(walk.tracked, walk.time_s, walk.truth, walk.factor)


@settings(max_examples=30)
@given(
    frames=st.lists(st.sampled_from([301, 902, 1503, 2104]), min_size=1, max_size=3, unique=True),
    turn_rad=st.sampled_from([-2.0, -0.7, 0.2, 1.0, 2.4]),  # no two jumps cancel each other
    direction=st.floats(-np.pi, np.pi),
    size_m=st.floats(1, 60),
)
def test_jumps_with_a_turn_are_undone_by_the_turn_of_the_camera(
    frames: list[int], turn_rad: float, direction: float, size_m: float
) -> None:
    walk = loops(2, marks=6, laps=2, rate_hz=30.0)
    session = camera_of(walk), nothing_logged()
    for frame in sorted(frames):
        # About where the camera is then, so that each is a jump of its own size.
        pivot = complex(as_complex(session[0].plane_acs[[frame]])[0])
        shift = pivot * (1 - np.exp(1j * turn_rad)) + size_m * np.exp(1j * direction)
        session = moved(session, after(session, frame), turn_rad, shift)
    odometry = continuous_odometry(*session, turned_as_camera=True)
    np.testing.assert_allclose(odometry.path, walk.tracked, atol=0.005 * len(frames))
    at = [frame - 1 for frame in sorted(frames)]
    assert np.flatnonzero(odometry.jumped).tolist() == at
    assert np.angle(odometry.turn[at[0] + 1]) == pytest.approx(-turn_rad, abs=0.01)
    np.testing.assert_allclose(odometry.jump_rad2[at], CAMERA_TURN_SIGMA_RAD**2)
    assert odometry.jump_rad2.sum() == pytest.approx(len(frames) * CAMERA_TURN_SIGMA_RAD**2)


def test_without_being_asked_to_the_turn_of_a_jump_stays_and_is_uncertain() -> None:
    walk = loops(2, marks=6, laps=2, rate_hz=30.0)
    session = camera_of(walk), nothing_logged()
    turned = moved(session, after(session, 900), 0.8, 5 + 0j)
    plain = continuous_odometry(*turned)
    assert abs(plain.path[-1] - walk.tracked[-1]) > 3
    assert plain.jump_rad2[899] == pytest.approx(0.1**2 + 0.8**2, rel=0.05)


def test_a_walk_without_jumps_is_the_same_with_the_turn_of_the_camera() -> None:
    walk = loops(2, marks=6, laps=1, rate_hz=30.0)
    camera = camera_of(walk)
    plain, asked = (continuous_odometry(camera, nothing_logged(), turned_as_camera=flag) for flag in (False, True))
    np.testing.assert_array_equal(plain.path, asked.path)
    assert not asked.jump_rad2.any()


def test_landmarks_show_the_turn_of_a_jump_better_than_the_camera() -> None:
    _, session = logged(2)
    turned = moved(session, after(session, 700), 0.5, 3 + 1j)
    jumped = moved(turned, after(session, 700), 0.3, 5j, with_map=False)  # the camera turned on its own, too
    assert kinds(continuous_odometry(*jumped)) == [EventKind.CORRECTION]
    plain, asked = (continuous_odometry(*jumped, turned_as_camera=flag) for flag in (False, True))
    np.testing.assert_allclose(plain.path, asked.path, atol=0.02)
