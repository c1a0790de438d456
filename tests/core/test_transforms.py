"""Maps between frames: laws of a group, least squares against brute force, quaternions against SciPy's rotations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import to_plane
from vislam2tag.core.transforms import (
    Affine2,
    Similarity2,
    as_complex,
    as_points,
    camera_to_bcs,
    level_view,
    multiply,
    wrapped,
)

coordinates = st.floats(-1e3, 1e3)
scales = st.floats(1e-3, 1e3)
angles = st.floats(-np.pi, np.pi)
similarities = st.builds(
    lambda scale, angle, x, y: Similarity2(scale * np.exp(1j * angle), complex(x, y)),
    scales,
    angles,
    coordinates,
    coordinates,
)
points = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=8).map(np.array)


@given(similarities, points)
def test_inverse_undoes(bcs_T_acs: Similarity2, p: FloatArray) -> None:
    tolerance = 1e-9 * (1 + np.abs(p).max() + abs(bcs_T_acs.b) / bcs_T_acs.scale)
    np.testing.assert_allclose(bcs_T_acs.inverse @ (bcs_T_acs @ p), p, atol=tolerance)


@given(similarities, similarities, points)
def test_composition_is_application_in_turn(c_T_b: Similarity2, b_T_a: Similarity2, p: FloatArray) -> None:
    expected = c_T_b @ (b_T_a @ p)
    np.testing.assert_allclose(c_T_b.compose(b_T_a) @ p, expected, rtol=1e-9, atol=1e-9 * (1 + np.abs(expected).max()))


@given(points)
def test_identity_and_complex_view(p: FloatArray) -> None:
    np.testing.assert_array_equal(Similarity2.identity() @ p, p)
    np.testing.assert_array_equal(as_points(as_complex(p)), p)


@given(similarities)
def test_two_points_define_it(bcs_T_acs: Similarity2) -> None:
    source = np.array([[1.0, 2.0], [-3.0, 5.0]])
    found = Similarity2.from_two_points(source, bcs_T_acs @ source)
    assert found.scale == pytest.approx(bcs_T_acs.scale, rel=1e-6)
    np.testing.assert_allclose(found @ source, bcs_T_acs @ source, atol=1e-6)


@given(similarities, st.integers(0, 2**32 - 1))
def test_fit_recovers_exact_data(bcs_T_acs: Similarity2, seed: int) -> None:
    source = np.random.default_rng(seed).normal(size=(5, 2)) * 10
    found = Similarity2.fit(source, bcs_T_acs @ source)
    np.testing.assert_allclose(found @ source, bcs_T_acs @ source, atol=1e-7 * (1 + bcs_T_acs.scale))


@pytest.mark.parametrize("seed", range(5))
def test_fit_is_the_least_squares_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(6, 2)), rng.normal(size=(6, 2))

    def residuals(v: FloatArray) -> FloatArray:
        return np.ravel(Similarity2(complex(v[0], v[1]), complex(v[2], v[3])) @ source - target)

    best = least_squares(residuals, np.array([1.0, 0, 0, 0]), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    found = Similarity2.fit(source, target)
    np.testing.assert_allclose([found.a.real, found.a.imag, found.b.real, found.b.imag], best.x, atol=1e-6)


def test_fit_never_reflects() -> None:
    source = np.array([[0.0, 0], [4, 0], [0, 1]])
    mirrored = source * [1, -1]
    found = Similarity2.fit(source, mirrored)
    probe = found @ np.array([[0.0, 0], [1, 0], [0, 1]])
    x_axis, y_axis = probe[1] - probe[0], probe[2] - probe[0]
    assert x_axis[0] * y_axis[1] - x_axis[1] * y_axis[0] > 0


@pytest.mark.parametrize("make", [Similarity2.fit, Similarity2.from_two_points])
def test_coinciding_points_are_refused(make: Callable[[FloatArray, FloatArray], Similarity2]) -> None:
    same = np.ones((2, 2))
    with pytest.raises(ValueError, match="coinciding"):
        make(same, np.array([[0.0, 0], [1, 1]]))


def test_affine_recovers_shear_and_refuses_a_line() -> None:
    matrix, shift = np.array([[1.0, 0.4], [-0.2, 1.3]]), np.array([5.0, -2.0])
    source = np.array([[0.0, 0], [3, 1], [-1, 4], [2, -2]])
    found = Affine2.fit(source, source @ matrix.T + shift)
    np.testing.assert_allclose(found.matrix, matrix, atol=1e-12)
    np.testing.assert_allclose(found @ source, source @ matrix.T + shift, atol=1e-12)
    with pytest.raises(ValueError, match="one line"):
        Affine2.fit(np.array([[0.0, 0], [1, 1], [2, 2]]), source[:3])


@given(similarities)
def test_affine_rotation_agrees_with_similarity(bcs_T_acs: Similarity2) -> None:
    a = bcs_T_acs.a
    affine = Affine2(np.array([[a.real, -a.imag], [a.imag, a.real]]), np.zeros(2))
    difference = np.exp(1j * affine.rotation_rad) / np.exp(1j * bcs_T_acs.rotation_rad)
    assert abs(difference - 1) < 1e-9


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
