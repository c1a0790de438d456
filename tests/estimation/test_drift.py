"""Covariances of drift from running sums, against sums written out and against walks drawn at random."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.estimation.drift import STATES, DriftKind, PathDriftSums, transitions


def wiggly(seed: int, n: int) -> tuple[ComplexArray, FloatArray]:
    """A path (n,) far from the origin and variances (n - 1,) of its steps."""
    rng = np.random.default_rng(seed)
    step = rng.normal(size=n - 1) + 1j * rng.normal(size=n - 1)
    return 500 + 300j + np.concatenate(([0.0], np.cumsum(step))), rng.uniform(0, 1, n - 1)


def response(kind: DriftKind, way: complex) -> FloatArray:
    """(4, r) what a unit drift does over the way that remains: a turned or scaled way, and itself."""
    if kind is DriftKind.POSITION:
        return np.eye(STATES)[:, :2]
    turned = way * 1j if kind is DriftKind.HEADING else way
    own = (0.0, 1.0) if kind is DriftKind.HEADING else (1.0, 0.0)
    return np.array([[turned.real], [turned.imag], [own[0]], [own[1]]])


@pytest.mark.parametrize("kind", list(DriftKind))
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 30), data=st.data())
def test_running_sums_are_the_sums_of_every_steps_share(
    kind: DriftKind, seed: int, n: int, data: st.DataObject
) -> None:
    path, variance = wiggly(seed, n)
    a = data.draw(st.integers(0, n - 1))
    b = data.draw(st.integers(a, n - 1))
    shares = [response(kind, path[b] - path[i + 1]) for i in range(a, b)]
    total = sum((variance[a + k] * share @ share.T for k, share in enumerate(shares)), np.zeros((STATES, STATES)))
    ours = PathDriftSums.along(kind, path, variance).between(np.array([a]), np.array([b]))[0]
    np.testing.assert_allclose(ours, total, atol=1e-9 * (1 + np.abs(total).max()))


@given(seed=st.integers(0, 2**32 - 1), ends=st.tuples(*[st.integers(0, 19)] * 3))
def test_drift_over_two_stretches_is_that_of_the_whole(seed: int, ends: tuple[int, int, int]) -> None:
    path, variance = wiggly(seed, 20)
    a, b, c = (np.array([end]) for end in sorted(ends))
    for kind in DriftKind:
        drift = PathDriftSums.along(kind, path, variance)
        transition = transitions(path, b, c)
        joined = transition @ drift.between(a, b) @ transition.transpose(0, 2, 1) + drift.between(b, c)
        np.testing.assert_allclose(drift.between(a, c), joined, atol=1e-8)


@given(seed=st.integers(0, 2**32 - 1), ends=st.tuples(*[st.integers(0, 19)] * 2))
def test_directed_drift_is_the_sum_of_every_steps_square(seed: int, ends: tuple[int, int]) -> None:
    path, _ = wiggly(seed, 20)
    by, (a, b) = np.diff(path), sorted(ends)
    axes = np.stack((by.real, by.imag), axis=1)[a:b]
    total = np.zeros((STATES, STATES))
    total[:2, :2] = axes.T @ axes
    np.testing.assert_allclose(
        PathDriftSums.directed(path, by).between(np.array([a]), np.array([b]))[0], total, atol=1e-9
    )


def test_random_walks_of_heading_scale_and_position_spread_as_stated() -> None:
    rng = np.random.default_rng(3)
    draws, n = 40_000, 25
    path = np.cumsum(np.exp(1j * np.linspace(0, 4, n)))
    sigma = {DriftKind.POSITION: 0.02, DriftKind.HEADING: 0.01, DriftKind.SCALE: 0.005}
    variance = rng.uniform(0.2, 1.0, n - 1)
    noise = {kind: level * np.sqrt(variance) * rng.standard_normal((2, draws, n - 1)) for kind, level in sigma.items()}
    heading, scale = (np.cumsum(noise[kind][0], axis=1) for kind in (DriftKind.HEADING, DriftKind.SCALE))
    error = scale[:, :-1] + 1j * heading[:, :-1]  # a step is walked with the drift up to it
    end = (np.diff(path)[1:] * error).sum(axis=1) + (
        noise[DriftKind.POSITION][0] + 1j * noise[DriftKind.POSITION][1]
    ).sum(axis=1)
    observed = np.cov(np.stack((end.real, end.imag, scale[:, -1], heading[:, -1])))
    first, last = np.array([0]), np.array([n - 1])
    stated = sum(
        PathDriftSums.along(kind, path, level**2 * variance).between(first, last)[0] for kind, level in sigma.items()
    )
    spread = np.sqrt(np.diag(stated))
    np.testing.assert_allclose(observed / np.outer(spread, spread), stated / np.outer(spread, spread), atol=0.03)


@given(seed=st.integers(0, 2**32 - 1), errors=st.tuples(*[st.floats(-1, 1)] * 4))
def test_a_state_is_carried_along_the_way(seed: int, errors: tuple[float, ...]) -> None:
    path, _ = wiggly(seed, 10)
    x, y, scale, heading = errors
    start = complex(x, y)
    end = start + np.sum(np.diff(path[2:8]) * (scale + 1j * heading))
    carried = transitions(path, np.array([2]), np.array([7]))[0] @ np.array(errors)
    np.testing.assert_allclose(carried, (end.real, end.imag, scale, heading), atol=1e-9)
