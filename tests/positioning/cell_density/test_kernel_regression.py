"""Ridge regression with kernels, held against the equations solved at once."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.positioning.cell_density import kernel_regression
from vislam2tag.positioning.cell_density.kernel_regression import KernelNormalEquations
from vislam2tag.positioning.cell_density.scan_kernels import StoreyKernel

RNG = np.random.default_rng(3)
LEVELS = RNG.uniform(0, 1, (60, 5)) * (RNG.random((60, 5)) < 0.6)
TARGETS = np.column_stack((LEVELS.sum(axis=1), LEVELS[:, 0]))


def test_examples_may_come_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = StoreyKernel.around(LEVELS[:20])
    mean = TARGETS.mean(axis=0)
    (at_once,) = KernelNormalEquations.empty(kernel, mean, 20).add([(LEVELS, TARGETS)]).solved([0.1])
    monkeypatch.setattr(kernel_regression, "_AT_ONCE", 7)
    parts = [(LEVELS[:25], TARGETS[:25]), (LEVELS[25:], TARGETS[25:])]
    (in_parts,) = KernelNormalEquations.empty(kernel, mean, 20).add(parts).solved([0.1])
    np.testing.assert_allclose(in_parts.weight, at_once.weight, rtol=1e-7)


def test_a_small_ridge_fits_the_examples_and_a_large_one_answers_their_mean() -> None:
    kernel = StoreyKernel.around(LEVELS)
    mean = TARGETS.mean(axis=0)
    equations = KernelNormalEquations.empty(kernel, mean, len(LEVELS)).add([(LEVELS, TARGETS)])
    close, flat = equations.solved([1e-6, 1e9])
    assert np.abs(close(LEVELS) - TARGETS).max() < 0.05 * np.ptp(TARGETS)
    np.testing.assert_allclose(flat(LEVELS), np.broadcast_to(mean, TARGETS.shape), atol=1e-3)


def test_fewer_centres_give_the_least_squares_of_their_span() -> None:
    kernel = StoreyKernel.around(LEVELS[:15])
    mean = TARGETS.mean(axis=0)
    (found,) = KernelNormalEquations.empty(kernel, mean, 15).add([(LEVELS, TARGETS)]).solved([0.0])
    design = kernel(LEVELS)
    best, *_ = np.linalg.lstsq(design, TARGETS - mean, rcond=None)
    np.testing.assert_allclose(found(LEVELS), design @ best + mean, atol=1e-3)
