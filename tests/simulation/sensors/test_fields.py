import numpy as np

from vislam2tag.simulation.sensors.fields import make_fields
from vislam2tag.simulation.settings import stream

LENGTH_M = 3.0
PLACES = np.random.default_rng(0).uniform(0, 200, (4000, 3))


def test_has_the_given_spread_and_is_smooth() -> None:
    fields = make_fields([stream(1, i) for i in range(20)], sigma=4.0, length_m=LENGTH_M)
    values = np.stack([fields.at(PLACES, np.full(len(PLACES), i)) for i in range(20)])
    assert abs(values.std() - 4.0) < 0.3
    assert abs(values.mean()) < 0.3
    nearby = fields.at(PLACES + np.array((0.1, 0, 0)), np.zeros(len(PLACES), dtype=np.int64))
    assert np.abs(nearby - values[0]).max() < 1.0


def test_correlation_falls_with_distance_as_a_gaussian() -> None:
    fields = make_fields([stream(2, i) for i in range(200)], sigma=1.0, length_m=LENGTH_M)
    index = np.arange(200).repeat(20)
    here = fields.at(PLACES, index)
    for distance in (1.0, 3.0, 9.0):
        there = fields.at(PLACES + np.array((distance, 0, 0)), index)
        expected = np.exp(-(distance**2) / (2 * LENGTH_M**2))
        assert abs(np.mean(here * there) - expected) < 0.08


def test_fields_are_independent() -> None:
    fields = make_fields([stream(3, i) for i in range(2)], sigma=1.0, length_m=LENGTH_M)
    first, second = (fields.at(PLACES, np.full(len(PLACES), i)) for i in range(2))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.1
