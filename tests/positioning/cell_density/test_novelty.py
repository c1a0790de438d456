"""Scans unlike all that was learned are found, and radii that grow with it hold familiar and strange errors alike."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.positioning.cell_density.novelty import (
    HeldOutErrors,
    NoveltyRadii,
    ReferenceScans,
    fitted_novelty_radii,
)
from vislam2tag.positioning.error_radii import UNKNOWN_M
from vislam2tag.positioning.radio_scans import CheckedArrays


def circle(angle: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def held_out(n: int, novelty: float, error_m: float, seed: int) -> HeldOutErrors:
    """Errors that grow with what is new; familiar scans are a little new, too."""
    rng = np.random.default_rng(seed)
    spread = rng.uniform(0.5, 2.0, n)
    new = rng.exponential(novelty, n) * (rng.random(n) < 0.9)
    return HeldOutErrors((spread * 0.7 + error_m * new) * rng.rayleigh(1.0, n), spread, new)


def test_what_lies_between_learned_scans_is_familiar_and_what_lies_beyond_is_not() -> None:
    angle = np.linspace(0.0, 0.5, 21)
    references = ReferenceScans.of(circle(angle), np.column_stack([10 * angle, np.zeros(21)]))
    asked = np.array([0.2625, 0.7, 1.2])
    away_m, novelty = references.compared(circle(asked), np.column_stack([10 * np.minimum(asked, 0.5), np.zeros(3)]))
    assert novelty[0] < 1e-3
    assert novelty[0] < novelty[1] < novelty[2]
    assert (away_m < 1.0).all()
    far_m, _ = references.compared(circle(asked[:1]), np.array([[2.625, 30.0]]))
    assert far_m[0] == pytest.approx(30.0, abs=0.1)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_few_scans_can_be_compared_with(count: int) -> None:
    references = ReferenceScans.of(circle(np.arange(count) * 0.1), np.zeros((count, 2)))
    for values in references.compared(circle(np.array([0.05, 1.0])), np.ones((2, 2))):
        assert np.isfinite(values).all()


def test_circles_hold_familiar_and_strange_errors() -> None:
    radii = fitted_novelty_radii(held_out(2000, 0.02, 8.0, 0), held_out(2000, 0.3, 8.0, 1))
    radii = NoveltyRadii.restored(CheckedArrays({"radii": radii.array()}), "radii")
    for part in (held_out(4000, 0.02, 8.0, 2), held_out(4000, 0.3, 8.0, 3)):
        r68, r95 = radii.radii_m(part.scale_m, part.novelty)
        assert np.mean(part.error_m <= r68) == pytest.approx(0.68, abs=0.04)
        assert np.mean(part.error_m <= r95) == pytest.approx(0.95, abs=0.02)


@given(st.integers(1, 60), st.integers(0, 60), st.integers(0, 5))
def test_familiar_errors_are_held_whatever_is_strange(familiar: int, strange: int, seed: int) -> None:
    part = held_out(familiar, 0.02, 5.0, seed)
    radii = fitted_novelty_radii(part, held_out(strange, 0.02, 900.0, seed + 1))
    r68, r95 = radii.radii_m(part.scale_m, part.novelty)
    assert np.isfinite(r95).all()
    assert np.mean(part.error_m <= r68 * (1 + 1e-9)) >= 0.68
    assert np.mean(part.error_m <= r95 * (1 + 1e-9)) >= min(0.95, 1 - 1 / familiar)


def test_radii_stop_growing_where_nothing_was_tried() -> None:
    radii = fitted_novelty_radii(held_out(500, 0.02, 8.0, 0), held_out(500, 0.3, 8.0, 1))
    new = np.array([0.1, 10.0, 1000.0])
    for grown in radii.radii_m(np.ones(3), new):
        assert grown[0] < grown[1] == grown[2]


def test_without_any_error_nothing_is_promised() -> None:
    nothing = HeldOutErrors(*np.empty((3, 0)))
    r68, r95 = fitted_novelty_radii(nothing, held_out(9, 0.1, 1.0, 0)).radii_m(np.zeros(2), np.zeros(2))
    assert (r68 >= UNKNOWN_M).all()
    assert (r95 > r68).all()
