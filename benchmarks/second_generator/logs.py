"""What the phone writes: camera track and landmark log in the ACS, y up."""

from __future__ import annotations

import numpy as np

from second_generator.gait import Motion
from second_generator.habits import Habits
from second_generator.odometry import Stretch
from second_generator.random_numbers import normal_plane, wander
from second_generator.tracker import Logged
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog

FIRST_NS = 10**13
DIGITS = 6
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def camera_track(logged: Logged, motion: Motion, habits: Habits, rng: np.random.Generator) -> CameraTrack:
    """Write the camera's track: with noise of each pose, bobbing, and a heading that may be of another frame."""
    time_s, count = motion.time_s, len(motion.time_s)
    plane = logged.camera + habits.drift.pose_noise_m * normal_plane(rng, count)
    up = 0.02 * np.sin(2 * np.pi * 1.8 * time_s) + 0.03 * wander(time_s, 3.0, rng)
    looking = motion.course_rad + 0.3 * wander(time_s, 1.0, rng)
    heading = {
        "bcs": motion.course_rad + 1.0,
        "acs": looking + np.angle(logged.turn),
        "constant": np.zeros(count),
    }[habits.camera_yaw]
    return CameraTrack(
        time_ns=FIRST_NS + np.round(time_s * 1e9).astype(np.int64),
        position_acs=_raised(plane, up),
        orientation_acs=_turned_about_vertical(heading - np.pi / 2),
        status=np.zeros(count, dtype=np.int8),
    )


def landmark_log(
    logged: Logged,
    camera: CameraTrack,
    ids: tuple[str, ...],
    lost: list[Stretch],
    habits: Habits,
    rng: np.random.Generator,
) -> LandmarkLog:
    """Write every landmark at each frame from its first sighting on; while lost, as the phone does."""
    count, known = len(logged.landmarks), np.isfinite(logged.landmarks)
    met = np.flatnonzero(known.any(axis=0))
    first = known.argmax(axis=0)
    met = met[np.argsort(first[met], kind="stable")]
    frame = np.concatenate([np.arange(first[sheet], count) for sheet in met])
    landmark = np.repeat(np.arange(len(met)), count - first[met])
    sheet = met[landmark]
    height = rng.normal(0.05, habits.sheets.height_spread_m, len(ids)).clip(-0.4, 0.6)
    position = _raised(logged.landmarks[frame, sheet], height[sheet])
    orientation = _sheet_orientation(logged.along_wall[frame, sheet], habits)
    gone = np.zeros(count, dtype=bool)
    for start, stop in lost:
        gone[start:stop] = True
    away = gone[frame]
    position[away] = camera.position_acs[frame[away]]
    if habits.losses.rows == "pose":
        orientation[away] = camera.orientation_acs[frame[away]]
    keep = ~away if habits.losses.rows == "none" else np.ones(len(frame), dtype=bool)
    names = tuple(ids[sheet] for sheet in met.tolist())
    return LandmarkLog(names, landmark[keep], frame[keep], position[keep], orientation[keep], away[keep])


def _raised(plane: ComplexArray, up_m: FloatArray) -> FloatArray:
    """ACS positions (k, 3) as they are written."""
    return np.asarray(np.round(np.column_stack((plane.real, up_m, -plane.imag)), DIGITS))


def _turned_about_vertical(angle_rad: FloatArray) -> FloatArray:
    """Quaternions (k, 4)."""
    zero = np.zeros(len(angle_rad))
    return np.column_stack((zero, np.sin(angle_rad / 2), zero, np.cos(angle_rad / 2)))


def _sheet_orientation(along_wall: ComplexArray, habits: Habits) -> FloatArray:
    """Quaternions (k, 4) of sheets with these X axes (k,)."""
    if habits.errors.convention == "constant":
        return np.tile(NO_TURN, (len(along_wall), 1))
    turn = _turned_about_vertical(np.angle(along_wall))
    if habits.errors.convention == "yaw":
        return turn
    # a quarter turn about X first: Z comes down, Y out of the wall
    _, y, _, w = turn.T
    return np.asarray(np.sqrt(0.5) * np.column_stack((w, y, -y, w)))
