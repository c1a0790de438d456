"""The second generator: its truth is what the smoother finds, and its phones are as noisy as they are said to be."""

from __future__ import annotations

import numpy as np
import pytest
from second_generator import PHONES, survey_walks

from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.settings import Settings


def mean_error_m(phone: str) -> float:
    strategy = strategy_named("smoother", Settings().mapping)
    walks = list(survey_walks(3, phone, walks=2))
    return float(np.mean([walk.errors(strategy.map(walk.camera, walk.log, walk.landmarks)).mean() for walk in walks]))


def test_noisier_phones_are_mapped_worse_and_none_is_lost() -> None:
    errors_m = [mean_error_m(phone) for phone in PHONES]
    assert errors_m == sorted(errors_m)
    assert errors_m[0] < 0.1
    assert errors_m[-1] < 1.0


@pytest.mark.parametrize("phone", PHONES)
def test_the_same_seed_gives_the_same_walks(phone: str) -> None:
    one, other = (next(iter(survey_walks(5, phone, seconds=30.0))) for _ in range(2))
    np.testing.assert_array_equal(one.camera.position_acs, other.camera.position_acs)
    np.testing.assert_array_equal(one.log.position_acs, other.log.position_acs)
