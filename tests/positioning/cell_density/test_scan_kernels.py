"""Scans are like where the same access points are heard in the same steps of level."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as numpy_arrays

from vislam2tag.positioning.cell_density.scan_kernels import StoreyKernel
from vislam2tag.positioning.checked_arrays import CheckedArrays

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
