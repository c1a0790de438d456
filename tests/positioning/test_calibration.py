"""Stretched radii hold the shares that they promise, on errors never seen."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.positioning.error_radii import radius_scale


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
