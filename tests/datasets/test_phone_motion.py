"""Heading and speed of a phone within time spans, and the labelled length of a walk."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.datasets.labelled_rows import START_NS, S, trajectory
from vislam2tag.datasets.phone_motion import PhoneMotion

LEVEL = Rotation.from_euler("x", 90, degrees=True)
"""A camera held upright: it looks along +y of the plan."""


def within(motion: PhoneMotion, start_s: float, end_s: float) -> tuple[float, float]:
    times = [np.array([START_NS + round(second * S)]) for second in (start_s, end_s)]
    heading, speed = motion.heading_and_speed(*times)
    return float(heading[0]), float(speed[0])


def walk(seconds: float = 10.0, speed: float = 1.2, turn: Rotation = LEVEL) -> list[tuple[float, float] | None]:
    return [(speed * second, 5.0) for second in np.arange(0, seconds, 0.1)]


def test_a_straight_walk() -> None:
    motion = PhoneMotion.of(trajectory(walk(), turn=LEVEL.as_quat()))
    heading, speed = within(motion, 2.0, 4.5)
    assert heading == pytest.approx(90.0)
    assert speed == pytest.approx(1.2, rel=1e-6)
    assert motion.labelled_m == pytest.approx(9.5 * 1.2)  # whole half seconds


@pytest.mark.parametrize("degrees", [0.0, 45.0, 179.0, 270.0, 359.0])
def test_heading_is_where_the_camera_looks_whatever_its_tilt(degrees: float) -> None:
    looks = Rotation.from_euler("z", degrees - 90, degrees=True) * Rotation.from_euler("x", 70, degrees=True)
    motion = PhoneMotion.of(trajectory(walk(), turn=looks.as_quat()))
    assert within(motion, 1, 3)[0] == pytest.approx(degrees, abs=1e-6)


def test_no_heading_where_the_camera_looks_down_or_all_around() -> None:
    down = PhoneMotion.of(trajectory(walk(), turn=(0, 0, 0, 1)))
    assert np.isnan(within(down, 1, 3)[0])
    assert within(down, 1, 3)[1] == pytest.approx(1.2)
    table = trajectory(walk())
    spun = Rotation.from_rotvec(np.radians(np.arange(len(table)) * 36.0)[:, None] * [0.0, 0.0, 1.0]) * LEVEL
    names = ("qx", "qy", "qz", "qw")
    turning = table.with_columns(**dict(zip(names, spun.as_quat().T, strict=True)))
    assert np.isnan(within(PhoneMotion.of(turning), 1.0, 2.9)[0])


def test_nothing_is_known_across_a_frame_without_position() -> None:
    points = walk()
    points[50] = None
    motion = PhoneMotion.of(trajectory(points, turn=LEVEL.as_quat()))
    assert np.isnan(within(motion, 4.0, 6.0)).all()
    assert not np.isnan(within(motion, 1.0, 4.0)).any()
    assert motion.labelled_m < 9.5 * 1.2


def test_no_walking_where_the_trajectory_jumps_and_none_outside() -> None:
    points = walk()
    jumped = [(x + (20.0 if number >= 50 else 0.0), y) for number, (x, y) in enumerate(p for p in points if p)]
    motion = PhoneMotion.of(trajectory(list(jumped), turn=LEVEL.as_quat()))
    assert motion.labelled_m < 9.5 * 1.2 + 0.1
    assert np.isnan(within(motion, 30.0, 33.0)).all()


def test_a_moment_is_widened_and_no_frames_are_no_motion() -> None:
    motion = PhoneMotion.of(trajectory(walk(), turn=LEVEL.as_quat()))
    assert within(motion, 5.0, 5.0)[1] == pytest.approx(1.2, rel=1e-6)
    empty = PhoneMotion.of(trajectory([]))
    assert np.isnan(within(empty, 0.0, 1.0)).all()
    assert empty.labelled_m == 0.0
