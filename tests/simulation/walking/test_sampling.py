import numpy as np
from scipy.spatial.transform import Rotation

from tests.simulation.hand_made import START_NS, make_test_walk
from vislam2tag.simulation.walking.sampling import continuous_signs, orientation_at, position_at


def test_position_between_samples_and_beyond_the_ends() -> None:
    walk = make_test_walk()
    time_ns = START_NS + np.array([-1_000_000_000, 2_500_000, 7_501_234_567, 10**12])
    position = position_at(walk, time_ns)
    assert np.allclose(position[0], walk.position[0])
    assert np.allclose(position[1], walk.position[:2].mean(axis=0))
    assert abs(position[2, 0] - (1.0 + 7.501234567)) < 1e-9
    assert np.allclose(position[3], walk.position[-1])


def test_orientation_ignores_the_sign_of_quaternions() -> None:
    walk = make_test_walk()
    walk.orientation[::2] *= -1
    time_ns = START_NS + np.arange(0, 10_000_000_000, 3_333_333)
    found = Rotation.from_quat(orientation_at(walk, time_ns))
    seconds = (time_ns - START_NS) / 1e9
    yaw = 0.4 + 0.8 * np.sin(0.7 * seconds) + 0.3 * seconds
    pitch = 1.0 + 0.1 * np.sin(2 * np.pi * seconds)
    expected = Rotation.from_euler("zx", np.column_stack((yaw, pitch)))
    assert (found.inv() * expected).magnitude().max() < 2e-5


def test_signs_make_a_sequence_continuous() -> None:
    quaternion = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1)) * np.array([1, -1, -1, 1, -1])[:, None]
    assert (continuous_signs(quaternion)[:, None] * quaternion == quaternion[0]).all()
