"""What walks of a device tell of its tracker: capped, rounded, and believed where a walk knows no better.

Covariances of drift from running sums, against sums written out and against walks drawn at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.drifting import loops
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.context import TrackerNoise
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_in_own_frame, solve_walk
from vislam2tag.estimation.tracker_errors import (
    FARTHEST,
    PRIOR_WEIGHT,
    STATES,
    STEP,
    STEP_OBSERVATIONS,
    USUAL,
    DriftAlong,
    DriftKind,
    NoiseEvidence,
    VarianceFactors,
    noise_of_other_walks,
    transitions,
)


def walk(times: float, numbers: float = 20.0) -> NoiseEvidence:
    """So many numbers show noise that is so many times the usual."""
    return NoiseEvidence(numbers, numbers * times**2)


def noise_of(walks: Sequence[NoiseEvidence], device: str = "phone") -> list[TrackerNoise | None]:
    return noise_of_other_walks([device] * len(walks), walks)


def times_of(told: Sequence[TrackerNoise | None]) -> list[float]:
    assert all(one is not None for one in told)
    return [one.times_usual for one in told if one is not None]


def test_each_walk_is_told_what_the_others_do() -> None:
    times = times_of(noise_of([walk(0.5), walk(0.5), walk(0.5), walk(2.0)]))
    assert times[0] == times[1] == times[2] > times[3]


@pytest.mark.parametrize("times", [0.25, 0.5, 2.0, 4.0])
def test_a_device_s_noise_is_found_in_few_walks(times: float) -> None:
    found = times_of(noise_of([walk(times, 6.0)] * 6))
    assert abs(np.log2(found[0] / times)) <= 0.5


def test_one_walk_whose_tracker_broke_does_not_decide() -> None:
    assert times_of(noise_of([walk(1.0), walk(1.0), walk(1.0), walk(100.0)]))[0] <= 2


def test_walks_that_tell_nothing_are_told_nothing_and_tell_nothing() -> None:
    assert noise_of([]) == []
    assert noise_of([walk(3.0)]) == [None]
    assert noise_of([walk(3.0), walk(3.0, numbers=0.0)])[1] is not None
    assert noise_of([walk(3.0), walk(3.0, numbers=0.0)])[0] is None
    assert noise_of([walk(1.0), walk(3.0), walk(9.0, 0.0)])[:2] == noise_of([walk(1.0), walk(3.0)])


def test_other_devices_of_a_survey_tell_less_than_a_device_s_own_walks() -> None:
    devices = ["one", *["other"] * 5]
    of_others = noise_of_other_walks(devices, [walk(3.0)] * 6)[0]
    of_own = noise_of_other_walks(["one"] * 6, [walk(3.0)] * 6)[0]
    assert of_others is not None
    assert of_own is not None
    assert 1.0 < of_others.times_usual <= of_own.times_usual
    assert of_others.effective_observations < of_own.effective_observations


@given(order=st.permutations(range(7)))
def test_the_order_of_the_walks_changes_nothing(order: list[int]) -> None:
    devices = ["a", "a", "b", "b", "b", "c", "a"]
    walks = [walk(0.3 * (1 + number), 3.0 + number) for number in range(7)]
    told = noise_of_other_walks(devices, walks)
    other = noise_of_other_walks([devices[i] for i in order], [walks[i] for i in order])
    assert other == [told[i] for i in order]


def test_what_is_told_is_rounded_and_never_counts_as_more_than_walks_are_alike() -> None:
    many = noise_of([walk(1.3, 1000.0)] * 50)[0]
    assert many is not None
    assert many.effective_observations == 10.0
    assert many.effective_observations % STEP_OBSERVATIONS == 0
    steps = np.log(many.times_usual) / np.log(STEP)
    np.testing.assert_allclose(steps, np.rint(steps))
    assert noise_of([walk(1.3, 1000.0)] * 51)[0] == many


def mapped(told: TrackerNoise | None, laps: float, marks: int = 8) -> SolvedWalk:
    observed = loops(3, USUAL.times(0.5), marks=marks, laps=laps, survey_m=0.02)
    smoothed = solve_walk(observed.observations(), LandmarkPriors.of(observed.ids, observed.landmarks()), told)
    assert smoothed is not None
    return smoothed


def test_the_usual_noise_told_is_what_is_assumed_where_nobody_tells() -> None:
    alone, told = mapped(None, 2), mapped(TrackerNoise(1.0, PRIOR_WEIGHT), 2)
    assert told.noise == alone.noise
    np.testing.assert_array_equal(mapped_path(told)[0], mapped_path(alone)[0])


@pytest.mark.parametrize("times", [0.5, 3.0])
def test_a_walk_that_few_numbers_tell_takes_on_the_device_s_noise_and_one_with_many_keeps_its_own(times: float) -> None:
    told, nearer = TrackerNoise(times, 8.0), []
    for laps, marks in ((0.5, 4), (6, 16)):
        own, both = mapped(None, laps, marks).noise.sighting_m, mapped(told, laps, marks).noise.sighting_m
        nearer.append(np.log(both / own) / np.log(USUAL.times(times).sighting_m / own))
    assert nearer[0] > 0.4
    assert nearer[1] < 0.4  # of logarithms: 8 numbers of 36 times the variance beside 190
    assert nearer[1] < 0.6 * nearer[0]


def test_sheets_stay_as_they_are() -> None:
    assert USUAL.times(3.0).sheet_rad == USUAL.sheet_rad


def test_levels_of_a_walk_in_its_own_frame_can_be_told() -> None:
    levels = [solve_in_own_frame(loops(seed, USUAL, marks=6, laps=3).observations()).noise for seed in range(3)]
    assert all(0.5 <= times <= 2 for times in times_of(noise_of([level.evidence for level in levels])))


def test_weights_carry_what_was_told() -> None:
    told = TrackerNoise(2.0, 6.0)
    assert mapped(told, 1).variance_factors.prior_noise is told
    assert VarianceFactors.even(USUAL, 2, 1).prior_noise is None


def test_lengthened_steps_go_on_in_logarithms_until_one_number_has_changed_by_the_most() -> None:
    start = VarianceFactors.even(USUAL, 3, 2)
    end = replace(start, sighting=np.array([1.1, 1.0, 0.9]), noise=USUAL.times(1.2))
    there = start.beyond(end, 1.0)
    np.testing.assert_allclose(there.sighting, end.sighting)
    assert there.noise.sighting_m == pytest.approx(end.noise.sighting_m)
    twice = start.beyond(end, 2.0)
    np.testing.assert_allclose(twice.sighting, end.sighting**2)
    assert twice.noise.heading_rad == pytest.approx(1.44 * USUAL.heading_rad)
    farthest = start.beyond(end, 1000.0)
    assert farthest.noise.position_m == pytest.approx(np.exp(FARTHEST) * USUAL.position_m)
    far = replace(start, landmark=np.array([1.0, 100.0]))
    np.testing.assert_allclose(start.beyond(far, 3.0).landmark, far.landmark)  # farther than that anyhow
    assert start.beyond(start, 8.0) is start


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
    ours = DriftAlong(path).sums(kind, variance).between(np.array([a]), np.array([b]))[0]
    np.testing.assert_allclose(ours, total, atol=1e-9 * (1 + np.abs(total).max()))


@given(seed=st.integers(0, 2**32 - 1), ends=st.tuples(*[st.integers(0, 19)] * 3))
def test_drift_over_two_stretches_is_that_of_the_whole(seed: int, ends: tuple[int, int, int]) -> None:
    path, variance = wiggly(seed, 20)
    a, b, c = (np.array([end]) for end in sorted(ends))
    for kind in DriftKind:
        drift = DriftAlong(path).sums(kind, variance)
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
    np.testing.assert_allclose(DriftAlong(path).slips(by).between(np.array([a]), np.array([b]))[0], total, atol=1e-9)


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
        DriftAlong(path).sums(kind, level**2 * variance).between(first, last)[0] for kind, level in sigma.items()
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
