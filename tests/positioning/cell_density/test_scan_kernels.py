"""Scans are like where the same access points are heard in the same steps of level.

Ridge regression with kernels, held against the equations solved at once.

Wrong storeys are found among right ones, and rare storeys are not taken for wrong.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as numpy_arrays
from sklearn.kernel_ridge import KernelRidge

from tests.positioning.radio_fields import surveyed
from vislam2tag.positioning.cell_density import scan_kernels
from vislam2tag.positioning.cell_density.scan_kernels import (
    MOST_OF_STOREY,
    KernelNormalEquations,
    StoreyKernel,
    levels,
    mislabelled,
)
from vislam2tag.positioning.models.cell_density import CellDensity
from vislam2tag.positioning.radio_scans import CheckedArrays

LEVELS = numpy_arrays(np.float64, (5, 6), elements=st.floats(0.0, 1.0)).filter(lambda level: bool((level > 0).any()))


@given(LEVELS)
def test_a_kernel_it_is(level: np.ndarray) -> None:
    kernel = StoreyKernel.around(level)
    among = kernel.among_centres()
    np.testing.assert_allclose(kernel(level), among, atol=1e-12)
    np.testing.assert_allclose(among, among.T, atol=1e-12)
    assert np.linalg.eigvalsh(among).min() > -1e-9
    assert (among <= 2 + 1e-9).all()


def test_who_is_faintly_heard_counts() -> None:
    level = np.array([[0.5, 0.4, 0.02, 0.0], [0.5, 0.4, 0.0, 0.02], [0.5, 0.4, 0.02, 0.0]])
    kernel = StoreyKernel.around(level)
    np.testing.assert_array_equal(kernel.threshold, [0.0, *np.quantile(level[level > 0], [0.25, 0.5, 0.75])])
    among = kernel.among_centres()
    assert among[0, 2] == pytest.approx(2.0)
    assert among[0, 1] < 1.75  # the direction alone, of powed levels, would say 2 - 1e-4


def test_it_comes_back_from_its_arrays() -> None:
    level = np.random.default_rng(0).random((7, 5)) * (np.arange(5) > 0)
    kernel = StoreyKernel.around(level)
    back = StoreyKernel.restored(kernel.centre, CheckedArrays(kernel.arrays(), m=len(kernel.centre)))
    np.testing.assert_array_equal(back(level), kernel(level))


def test_nothing_but_faintest_levels_is_no_error() -> None:
    assert np.isfinite(StoreyKernel.around(np.zeros((3, 2))).among_centres()).all()


RNG = np.random.default_rng(3)
HEARD = RNG.uniform(0, 1, (60, 5)) * (RNG.random((60, 5)) < 0.6)
TARGETS = np.column_stack((HEARD.sum(axis=1), HEARD[:, 0]))


def test_examples_may_come_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = StoreyKernel.around(HEARD[:20])
    mean = TARGETS.mean(axis=0)
    (at_once,) = KernelNormalEquations.empty(kernel, mean, 20).add([(HEARD, TARGETS)]).solved([0.1])
    monkeypatch.setattr(scan_kernels, "_AT_ONCE", 7)
    parts = [(HEARD[:25], TARGETS[:25]), (HEARD[25:], TARGETS[25:])]
    (in_parts,) = KernelNormalEquations.empty(kernel, mean, 20).add(parts).solved([0.1])
    np.testing.assert_allclose(in_parts.weight, at_once.weight, rtol=1e-7)


def test_a_small_ridge_fits_the_examples_and_a_large_one_answers_their_mean() -> None:
    kernel = StoreyKernel.around(HEARD)
    mean = TARGETS.mean(axis=0)
    equations = KernelNormalEquations.empty(kernel, mean, len(HEARD)).add([(HEARD, TARGETS)])
    close, flat = equations.solved([1e-6, 1e9])
    assert np.abs(close(HEARD) - TARGETS).max() < 0.05 * np.ptp(TARGETS)
    np.testing.assert_allclose(flat(HEARD), np.broadcast_to(mean, TARGETS.shape), atol=1e-3)


def test_fewer_centres_give_the_least_squares_of_their_span() -> None:
    kernel = StoreyKernel.around(HEARD[:15])
    mean = TARGETS.mean(axis=0)
    (found,) = KernelNormalEquations.empty(kernel, mean, 15).add([(HEARD, TARGETS)]).solved([0.0])
    design = kernel(HEARD)
    best, *_ = np.linalg.lstsq(design, TARGETS - mean, rcond=None)
    np.testing.assert_allclose(found(HEARD), design @ best + mean, atol=1e-3)


@pytest.mark.parametrize("centres", [120, 60])
def test_wrong_storeys_are_found(centres: int) -> None:
    scans, places = surveyed(120)
    wrong = np.isin(np.arange(120), [10, 57, 91])
    doubted = mislabelled(scans, np.where(wrong, 1 - places.storey, places.storey), np.arange(centres))
    np.testing.assert_array_equal(doubted, wrong)


def test_right_storeys_are_believed() -> None:
    scans, places = surveyed(120)
    assert not mislabelled(scans, places.storey, np.arange(120)).any()


def test_one_in_a_storey_of_its_own_is_not_doubted() -> None:
    scans, _ = surveyed(60)
    storey = np.where(np.arange(60) == 7, 2, 0)
    assert not mislabelled(scans, storey, np.arange(60)).any()


@given(st.integers(1, 40), st.integers(1, 4), st.integers(0, 9))
def test_of_each_storey_few_are_doubted(n: int, storeys: int, seed: int) -> None:
    scans, _ = surveyed(n)
    storey = np.random.default_rng(seed).integers(0, storeys, n)
    doubted = mislabelled(scans, storey, np.arange(n))
    for number in range(storeys):
        assert doubted[storey == number].sum() <= MOST_OF_STOREY * (storey == number).sum()


def test_what_is_predicted_of_a_scan_is_what_a_regression_without_it_says() -> None:
    scans, places = surveyed(30)
    one_hot = np.eye(2)[places.storey]
    believed = np.arange(30) != 4
    predicted = scan_kernels._leave_one_out(scans, one_hot, believed, np.arange(30))
    among, mean = StoreyKernel.around(levels(scans)).among_centres(), one_hot[believed].mean(axis=0)
    for row in (0, 4, 11):
        learn = believed & (np.arange(30) != row)
        ridge = KernelRidge(alpha=0.1, kernel="precomputed").fit(among[np.ix_(learn, learn)], one_hot[learn] - mean)
        expected = np.maximum(ridge.predict(among[np.ix_([row], learn)])[0] + mean, 1e-3)
        np.testing.assert_allclose(predicted[row], expected / expected.sum(), atol=1e-4)


def test_the_model_leaves_them_out_and_says_so() -> None:
    scans, places = surveyed(120)
    swapped = replace(places, storey=np.where(np.arange(120) == 10, 1 - places.storey, places.storey))
    assert list(CellDensity().fit(scans, places).remarks()) == []
    (remark,) = CellDensity().fit(scans, swapped).remarks()
    assert remark.startswith("1 fingerprint ignored in training")
