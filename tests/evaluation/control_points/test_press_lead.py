from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.evaluation.control_points.press_lead import MIN_PRESSES, estimate_lead


@given(st.floats(-2, 2), st.lists(st.floats(0.4, 2.5), min_size=MIN_PRESSES + 1, max_size=30))
def test_a_constant_lead_is_found_at_any_speed(lead_s: float, speeds: list[float]) -> None:
    speed = np.array(speeds)
    lead = estimate_lead(lead_s * speed, speed)
    assert lead.lead_s == pytest.approx(lead_s, abs=1e-9)
    assert lead.sigma_s == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(lead.without_s, lead_s, atol=1e-9)


def test_a_third_of_wild_labels_does_not_matter() -> None:
    speed = np.full(12, 1.0)
    along = np.where(np.arange(12) < 4, 9.0, 0.3)
    assert estimate_lead(along, speed).lead_s == pytest.approx(0.3)


def test_standing_jumping_and_unlabelled_presses_say_nothing() -> None:
    along = np.array([0.2, 0.2, 0.2, 0.2, 5.0, 5.0, 5.0, np.nan])
    speed = np.array([1.0, 1.0, 1.0, 1.0, 0.1, 30.0, np.nan, 1.0])
    assert estimate_lead(along, speed).lead_s == pytest.approx(0.2)


def test_no_press_corrects_itself() -> None:
    along, speed = np.array([0.1, 0.2, 0.3, 0.4, 3.0]), np.ones(5)
    lead = estimate_lead(along, speed)
    assert lead.without_s[4] == pytest.approx(0.25)
    assert lead.lead_s == pytest.approx(0.3)


def test_too_few_presses_have_no_lead() -> None:
    lead = estimate_lead(np.full(3, 0.2), np.ones(3))
    assert np.isnan(lead.lead_s)
    assert np.isnan(lead.without_s).all()


def test_the_stated_sigma_is_the_scatter_over_sessions() -> None:
    rng = np.random.default_rng(5)
    speed = rng.uniform(0.6, 1.6, (400, 15))
    leads = [estimate_lead(0.3 * one + rng.normal(0, 0.4, 15), one) for one in speed]
    assert np.mean([lead.lead_s for lead in leads]) == pytest.approx(0.3, abs=0.02)
    assert np.mean([lead.sigma_s for lead in leads]) == pytest.approx(np.std([lead.lead_s for lead in leads]), rel=0.2)
