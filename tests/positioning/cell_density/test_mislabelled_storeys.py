"""Wrong storeys are found among right ones, and rare storeys are not taken for wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.kernel_ridge import KernelRidge

from tests.positioning.radio_fields import surveyed
from vislam2tag.positioning.cell_density import mislabelled_storeys as module
from vislam2tag.positioning.cell_density.mislabelled_storeys import MOST_OF_STOREY, mislabelled
from vislam2tag.positioning.cell_density.scan_kernels import StoreyKernel, levels
from vislam2tag.positioning.models.cell_density import CellDensity


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
    predicted = module._leave_one_out(scans, one_hot, believed, np.arange(30))
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
    assert remark.startswith("1 fingerprint not learned from")
