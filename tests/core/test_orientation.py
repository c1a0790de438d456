"""Camera orientation in the building frame, against SciPy's rotations."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vislam2tag.core.orientation import camera_to_bcs, level_view, multiply, wrapped
from vislam2tag.core.tracks import to_plane

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_product_agrees_with_scipy(seed: int) -> None:
    left, right = Rotation.random(7, rng=seed), Rotation.random(7, rng=seed + 1)
    product = Rotation.from_quat(multiply(left.as_quat(), right.as_quat()))
    np.testing.assert_allclose(product.as_matrix(), (left * right).as_matrix(), atol=1e-12)


@given(seeds, st.floats(-np.pi, np.pi))
def test_rotated_directions_agree_with_the_plane_map(seed: int, rotation_rad: float) -> None:
    camera = Rotation.random(5, rng=seed)
    bcs = Rotation.from_quat(camera_to_bcs(camera.as_quat(), rotation_rad))
    direction_acs = camera.apply([0.0, 0.0, -1.0])
    direction_bcs = bcs.apply([0.0, 0.0, -1.0])
    turned = np.exp(1j * rotation_rad) * (to_plane(direction_acs) @ [1, 1j])
    np.testing.assert_allclose(direction_bcs[:, :2] @ [1, 1j], turned, atol=1e-12)
    np.testing.assert_allclose(direction_bcs[:, 2], direction_acs[:, 1], atol=1e-12)


@given(seeds)
def test_result_is_a_unit_quaternion_with_positive_w(seed: int) -> None:
    result = camera_to_bcs(Rotation.random(9, rng=seed).as_quat(), 0.3)
    np.testing.assert_allclose(np.linalg.norm(result, axis=1), 1, atol=1e-12)
    assert (result[:, 3] >= 0).all()


@given(st.floats(-50, 50))
def test_wrapped_angles_are_the_same_directions_and_those_in_range_stay(angle_rad: float) -> None:
    found = float(wrapped(np.array([angle_rad]))[0])
    assert abs(found) <= np.pi + 1e-12
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angle_rad), atol=1e-12)
    assert abs(angle_rad) > np.pi or found == angle_rad


def test_a_camera_looks_level_along_its_yaw_and_as_before_while_it_looks_down() -> None:
    yaw, pitch = np.radians([30.0, 30.0, 120.0, 120.0]), np.radians([-80.0, 20.0, 85.0, 0.0])
    # Upright it looks along x: its own axes point to the right (-y), up, and back.
    upright = Rotation.from_matrix(np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]))
    turned = Rotation.from_euler("z", yaw[:, None]) * Rotation.from_euler("y", -pitch[:, None]) * upright
    view = level_view(turned.as_quat())
    expected = np.radians([30.0, 30.0, 30.0, 120.0])
    np.testing.assert_allclose(view, np.column_stack((np.cos(expected), np.sin(expected))), atol=1e-9)
    assert not level_view(turned.as_quat()[:1]).any()
