"""Radii that grow with the spread of guesses, but not from nothing."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.positioning.error_radii import UNKNOWN_M, SpreadRadii, fitted_radii


def test_radii_hold_new_errors_and_are_saved() -> None:
    rng = np.random.default_rng(2)
    spread = rng.uniform(0, 6, 4000)
    error = np.hypot(1.0, spread) * rng.rayleigh(1.0, 4000)
    radii = fitted_radii(error[:2000], spread[:2000])
    assert radii.base_m == pytest.approx(np.median(error[:2000]))
    r68, r95 = SpreadRadii.restored({"radii": radii.array()}, "radii").radii_m(spread[2000:])
    assert np.mean(error[2000:] <= r68) == pytest.approx(0.68, abs=0.03)
    assert np.mean(error[2000:] <= r95) == pytest.approx(0.95, abs=0.015)
    assert (np.diff(r95[np.argsort(spread[2000:])]) >= 0).all()


def test_without_any_error_nothing_is_promised() -> None:
    r68, r95 = fitted_radii(np.full(3, np.nan), np.zeros(3)).radii_m(np.zeros(2))
    assert (r68 >= UNKNOWN_M).all()
    assert (r95 > r68).all()
