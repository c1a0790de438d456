"""Reliability and coverage-accuracy from counts: true uncertainty is the diagonal, errors come back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.arrays import FloatArray
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.quality.evaluation.reliability import (
    Verdict,
    added,
    coverage_curve,
    reduce_errors,
    region_probability,
    reliability_curve,
    verdict,
)

SEEDS = st.integers(0, 2**32 - 1)


def stated(seed: int, n: int = 4000) -> tuple[FloatArray, FloatArray]:
    """Errors drawn from covariances of many sizes and shapes; returns both."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(n, 2, 2)) * np.exp(random.normal(-2, 1, n))[:, None, None]
    root += np.eye(2) * 1e-3
    return np.einsum("nij,nj->ni", root, random.normal(size=(n, 2))), root @ root.transpose(0, 2, 1)


def record_of(error_m: FloatArray, covariance_m2: FloatArray, truth_m2: FloatArray | None = None) -> ErrorRecord:
    exact = np.zeros_like(covariance_m2)
    return reduce_errors("truth.csv", error_m, covariance_m2, exact if truth_m2 is None else truth_m2)


@settings(max_examples=30)
@given(SEEDS)
def test_true_uncertainty_is_the_diagonal(seed: int) -> None:
    curve = reliability_curve(record_of(*stated(seed)))
    assert curve is not None
    np.testing.assert_allclose(curve.observed, curve.stated, atol=0.045)  # Kolmogorov: 2.8 / sqrt(4000)


@settings(max_examples=20)
@given(SEEDS, st.floats(1.5, 4.0))
def test_overconfidence_lies_below_and_caution_above(seed: int, factor: float) -> None:
    error, covariance = stated(seed)
    for scale, sign in ((1 / factor, -1), (factor, 1)):
        curve = reliability_curve(record_of(error, covariance * scale**2))
        assert curve is not None
        expected = 1 - (1 - curve.stated) ** (scale**2)
        np.testing.assert_allclose(curve.observed, expected, atol=0.045)
        assert sign * (curve.observed[49] - curve.stated[49]) > 0.1


@given(SEEDS, st.floats(0, 2 * np.pi))
def test_the_region_of_an_error_does_not_depend_on_the_axes(seed: int, turn: float) -> None:
    error, covariance = stated(seed, 50)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    turned = region_probability(error @ rotation.T, rotation @ covariance @ rotation.T)
    np.testing.assert_allclose(turned, region_probability(error, covariance), atol=1e-6)


def test_known_regions() -> None:
    error = np.array([[0.0, 0.0], [1.5096, 0.0], [0.0, 2.4477], [1.0, 1.0], [np.nan, 0.0]])
    covariance = np.repeat(np.eye(2)[None], 5, axis=0)
    covariance[3] = [[1.0, 1.0], [1.0, 1.0]]
    np.testing.assert_allclose(region_probability(error, covariance), [0, 0.68, 0.95, np.nan, np.nan], atol=1e-4)


@settings(max_examples=30)
@given(SEEDS, st.floats(0.02, 2.0))
def test_coverage_and_accuracy_at_a_limit_are_those_of_the_errors_kept(seed: int, limit: float) -> None:
    error, covariance = stated(seed, 500)
    error[::7] = np.nan
    curve = coverage_curve(record_of(error, covariance))
    assert curve is not None
    place = int(np.argmin(np.abs(np.log(curve.max_sigma_m / limit))))
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    kept = np.linalg.norm(error, axis=1)[(sigma < curve.max_sigma_m[place]) & np.isfinite(error[:, 0])]
    assert curve.labelled[place] == pytest.approx(len(kept) / 500)
    assert curve.mean_m[place] == pytest.approx(kept.mean(), rel=1e-4)
    assert curve.p95_m[place] == pytest.approx(np.quantile(kept, 0.95, method="inverted_cdf"), rel=0.1)
    assert (np.diff(curve.max_sigma_m) > 0).all()
    assert curve.labelled[-1] == pytest.approx(np.isfinite(error[:, 0]).mean())


@settings(max_examples=20)
@given(SEEDS, st.floats(0.0, 0.1))
def test_regions_allow_for_the_truths_own_error(seed: int, sigma_m: float) -> None:
    error, covariance = stated(seed)
    own = np.broadcast_to(sigma_m**2 * np.eye(2), covariance.shape)
    measured = error + sigma_m * np.random.default_rng(seed + 1).normal(size=error.shape)
    record = record_of(measured, covariance, own)
    upto = np.cumsum(record.inside)[:-1] / sum(record.inside)
    np.testing.assert_allclose(upto, np.arange(1, 100) / 100, atol=0.045)  # Kolmogorov: 2.8 / sqrt(4000)


@pytest.mark.parametrize(
    ("scale", "expected"), [(1.0, Verdict.ABOUT_TRUE), (0.5, Verdict.TOO_SURE), (2.0, Verdict.TOO_CAUTIOUS)]
)
def test_a_truth_that_can_tell_gives_a_verdict_of_five_walks(scale: float, expected: Verdict) -> None:
    error, covariance = stated(1)
    record = record_of(error, covariance * scale**2)
    assert verdict(record) is None
    assert verdict(record.model_copy(update={"sources": {"truth.csv": 5}})) is expected
    curve = reliability_curve(record)
    assert curve is not None
    assert curve.times_as_large == pytest.approx(1 / scale, rel=0.1)


def test_a_truth_less_exact_than_the_labels_gives_neither_curve_nor_verdict() -> None:
    error, covariance = stated(1)
    own = np.broadcast_to(9.0 * np.eye(2), covariance.shape)
    record = record_of(error, covariance, own).model_copy(update={"sources": {"presses": 50}})
    assert sum(record.inside) == len(error)
    assert (reliability_curve(record), verdict(record)) == (None, None)


@given(SEEDS, st.integers(0, 100))
def test_records_add_up_to_the_record_of_all(seed: int, cut: int) -> None:
    error, covariance = stated(seed, 100)
    error[::5], covariance[::4] = np.nan, np.nan
    both = added(record_of(error[:cut], covariance[:cut]), record_of(error[cut:], covariance[cut:]))
    whole = record_of(error, covariance)
    assert (both.points, both.inside, both.sources) == (whole.points, whole.inside, {"truth.csv": 2})
    assert [(row.sigma, row.errors) for row in both.rows] == [(row.sigma, row.errors) for row in whole.rows]
    assert [row.sum_m for row in both.rows] == pytest.approx([row.sum_m for row in whole.rows], abs=1e-5)
    assert ErrorRecord.model_validate_json(both.model_dump_json()) == both


def test_without_covariances_there_is_one_point_and_no_reliability() -> None:
    error = np.array([[3.0, 4.0], [0.0, 1.0], [np.nan, np.nan], [0.0, 0.0]])
    record = record_of(error, np.full((4, 2, 2), np.nan))
    assert reliability_curve(record) is None
    curve = coverage_curve(record)
    assert curve is not None
    assert (curve.labelled.tolist(), curve.mean_m.tolist()) == ([0.75], [2.0])
    assert np.isnan(curve.max_sigma_m).all()


def test_without_labels_there_is_no_curve() -> None:
    record = record_of(np.full((3, 2), np.nan), np.full((3, 2, 2), np.nan))
    assert (record.points, coverage_curve(record), reliability_curve(record)) == (3, None, None)
