"""The pose lag is found from the angular speeds of tracker and gyroscope."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.pose_lag import estimate_pose_lag


def recorded(lag_s: float, seconds: float = 60.0) -> tuple[IntArray, FloatArray, IntArray, FloatArray]:
    """Heading that swings irregularly, logged by a tracker that stamps late and by a gyroscope."""
    fine = np.arange(0, seconds, 0.005)
    rng = np.random.default_rng(4)
    rate = np.convolve(rng.normal(size=len(fine)), np.hanning(120), mode="same") * 0.1
    heading = np.cumsum(rate) * 0.005
    frames = np.arange(0.6, seconds - 0.6, 1 / 30)
    poses = Rotation.from_euler("y", np.interp(frames, fine, heading)[:, None]).as_quat()
    gyro_s = np.arange(0, seconds, 0.02)
    gyro = np.column_stack((np.zeros(len(gyro_s)), np.interp(gyro_s, fine, rate), np.zeros(len(gyro_s))))
    return ((frames + lag_s) * 1e9).astype(np.int64), poses, (gyro_s * 1e9).astype(np.int64), gyro


@pytest.mark.parametrize("lag_s", [0.0, 0.04, 0.25, -0.1])
def test_lag_is_found_to_a_few_milliseconds(lag_s: float) -> None:
    assert estimate_pose_lag(*recorded(lag_s)) == pytest.approx(lag_s, abs=0.004)


def test_none_where_nothing_overlaps_or_correlates() -> None:
    time_ns, poses, gyro_ns, gyro = recorded(0.0)
    assert estimate_pose_lag(time_ns, poses, gyro_ns + 10**12, gyro) is None
    assert estimate_pose_lag(time_ns, poses, gyro_ns[:10], gyro[:10]) is None
    assert estimate_pose_lag(time_ns[:0], poses[:0], gyro_ns, gyro) is None
    noise = np.random.default_rng(0).normal(size=gyro.shape)
    assert estimate_pose_lag(time_ns, poses, gyro_ns, noise) is None
    still = np.tile(poses[:1], (len(poses), 1))
    assert estimate_pose_lag(time_ns, still, gyro_ns, gyro) is None
