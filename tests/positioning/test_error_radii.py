"""Radii hold the shares that they promise on errors never seen, and grow with the spread of guesses."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.error_radii import (
    UNKNOWN_M,
    SpreadRadii,
    fitted_radii,
    radius_scale,
)


@pytest.mark.parametrize("heavy", [False, True])
def test_radii_hold_new_errors(heavy: bool) -> None:
    rng = np.random.default_rng(1)
    scale = rng.uniform(0.5, 5, 4000)
    unit = np.abs(rng.standard_t(3, 4000)) if heavy else rng.rayleigh(2.0, 4000)
    error = scale * unit
    fitted = radius_scale(error[:2000], scale[:2000])
    r68, r95 = fitted.radii_m(scale[2000:])
    assert np.mean(error[2000:] <= r68) == pytest.approx(0.68, abs=0.03)
    assert np.mean(error[2000:] <= r95) == pytest.approx(0.95, abs=0.015)


def test_few_errors_give_the_greatest() -> None:
    fitted = radius_scale(np.array([1.0, 2.0, np.nan]), np.ones(3))
    assert fitted.factor_95 == pytest.approx(2.0)
    with pytest.raises(ValueError, match="no held-out error"):
        radius_scale(np.array([np.nan]), np.ones(1))


def test_radii_hold_new_errors_and_are_saved() -> None:
    rng = np.random.default_rng(2)
    spread = rng.uniform(0, 6, 4000)
    error = np.hypot(1.0, spread) * rng.rayleigh(1.0, 4000)
    radii = fitted_radii(error[:2000], spread[:2000])
    assert radii.base_m == pytest.approx(np.median(error[:2000]))
    r68, r95 = SpreadRadii.restored(CheckedArrays({"radii": radii.array()}), "radii").radii_m(spread[2000:])
    assert np.mean(error[2000:] <= r68) == pytest.approx(0.68, abs=0.03)
    assert np.mean(error[2000:] <= r95) == pytest.approx(0.95, abs=0.015)
    assert (np.diff(r95[np.argsort(spread[2000:])]) >= 0).all()


def test_without_any_error_nothing_is_promised() -> None:
    r68, r95 = fitted_radii(np.full(3, np.nan), np.zeros(3)).radii_m(np.zeros(2))
    assert (r68 >= UNKNOWN_M).all()
    assert (r95 > r68).all()
