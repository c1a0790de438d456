from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from vislam2tag.dataset.inertial.sensor_series import RotationSeries

TIME_NS = 10**15 + np.arange(50) * 20_000_000


def test_between_readings_of_a_turning_phone_as_good_as_slerp() -> None:
    rng = np.random.default_rng(1)
    steps = Rotation.from_rotvec(rng.uniform(-0.05, 0.05, (50, 3)))
    turned = [Rotation.identity()]
    for step in steps[1:]:
        turned.append(turned[-1] * step)
    rotation = Rotation.concatenate(turned)
    signs = np.where(rng.random(50) < 0.5, -1.0, 1.0)
    at_ns = rng.integers(TIME_NS[0], TIME_NS[-1], 200)
    found = RotationSeries(TIME_NS, Rotation.from_quat(rotation.as_quat() * signs[:, None])).at(at_ns)
    slerp = Slerp((TIME_NS - TIME_NS[0]) * 1e-9, rotation)((at_ns - TIME_NS[0]) * 1e-9)
    assert (found.inv() * slerp).magnitude().max() < 1e-5


def test_held_outside() -> None:
    rotation = Rotation.from_rotvec(np.linspace(0, 1, 50)[:, None] * [0.0, 0.0, 1.0])
    ends = RotationSeries(TIME_NS, rotation).at(np.array([0, 2 * 10**15]))
    np.testing.assert_allclose(ends.magnitude(), [0, 1], atol=1e-12)
