from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.hand_made import START_NS, make_test_walk
from vislam2tag.simulation.phones import DecimalMarks, PressTiming, device_names, make_device, simulate_presses
from vislam2tag.simulation.settings import Locale


def test_the_first_phones_are_the_published_ones() -> None:
    assert device_names(2) == ("LG", "OnePlus")
    assert device_names(6) == ("LG", "OnePlus", "Galaxy", "S20", "Phone5", "Phone6")


def test_a_phone_keeps_its_constants_whatever_it_is_used_for() -> None:
    assert make_device("LG_ref", Locale.MIXED, 3) == make_device("LG", Locale.MIXED, 3)
    assert make_device("LG", Locale.MIXED, 3).receiver != make_device("LG", Locale.MIXED, 4).receiver
    assert make_device("LG", Locale.MIXED, 3).receiver != make_device("S20", Locale.MIXED, 3).receiver


@pytest.mark.parametrize(
    ("name", "locale", "marks"),
    [
        ("LG", Locale.MIXED, DecimalMarks(",", ",")),
        ("OnePlus_tachy", Locale.MIXED, DecimalMarks(",", ".")),
        ("Phone5", Locale.MIXED, DecimalMarks(".", ".")),
        ("Galaxy", Locale.DE, DecimalMarks(",", ",")),
        ("LG", Locale.EN, DecimalMarks(".", ".")),
    ],
)
def test_decimal_marks(name: str, locale: Locale, marks: DecimalMarks) -> None:
    assert make_device(name, locale, 0).marks == marks


def test_a_perfect_hand_presses_exactly() -> None:
    walk = make_test_walk()
    pressed = simulate_presses(walk, PressTiming(0.0, 0.0), np.random.default_rng(0))
    assert pressed.tolist() == walk.presses_ns.tolist()


def test_lead_and_scatter() -> None:
    walk = make_test_walk()
    rng = np.random.default_rng(1)
    errors_s = np.concatenate(
        [(simulate_presses(walk, PressTiming(0.2, 0.35), rng) - walk.presses_ns) / 1e9 for _ in range(300)]
    )
    assert errors_s.mean() == pytest.approx(-0.2, abs=0.04)
    assert errors_s.std() == pytest.approx(0.35, abs=0.03)


def test_presses_stay_in_order_and_inside_the_walk() -> None:
    walk = make_test_walk()
    pressed = simulate_presses(walk, PressTiming(0.0, 30.0), np.random.default_rng(2))
    assert (np.diff(pressed) >= 0).all()
    assert pressed[0] >= START_NS
    assert pressed[-1] <= walk.time_ns[-1]
