import numpy as np
import pytest

from tests.simulation.hand_made import START_NS, make_test_walk
from vislam2tag.simulation.sensors.presses import Hand, simulate_presses


def test_a_perfect_hand_presses_exactly() -> None:
    walk = make_test_walk()
    pressed = simulate_presses(walk, Hand(0.0, 0.0), np.random.default_rng(0))
    assert pressed.tolist() == walk.presses_ns.tolist()


def test_lead_and_scatter() -> None:
    walk = make_test_walk()
    rng = np.random.default_rng(1)
    errors_s = np.concatenate(
        [(simulate_presses(walk, Hand(0.2, 0.35), rng) - walk.presses_ns) / 1e9 for _ in range(300)]
    )
    assert errors_s.mean() == pytest.approx(-0.2, abs=0.04)
    assert errors_s.std() == pytest.approx(0.35, abs=0.03)


def test_presses_stay_in_order_and_inside_the_walk() -> None:
    walk = make_test_walk()
    pressed = simulate_presses(walk, Hand(0.0, 30.0), np.random.default_rng(2))
    assert (np.diff(pressed) >= 0).all()
    assert pressed[0] >= START_NS
    assert pressed[-1] <= walk.time_ns[-1]
