from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.preparation.registration.network import KNOWN_HEIGHT, MeasuredHeight, adjust_heights
from vislam2tag.preparation.registration.record import RegistrationSettings

SETTINGS = RegistrationSettings()


def heights(seed: int = 0, noise_m: float = 0.005) -> tuple[list[MeasuredHeight], dict[str, float]]:
    """Three known points, six others, two stations."""
    rng = np.random.default_rng(seed)
    truth = {name: float(rng.uniform(0, 2)) for name in ("A", "B", "C", *"123456")}
    found = [MeasuredHeight(name, KNOWN_HEIGHT, truth[name], 0.005) for name in "ABC"]
    for station, shift in (("S1", 100.0), ("S2", -7.0)):
        found += [MeasuredHeight(name, station, z + shift + rng.normal(0, noise_m), 0.005) for name, z in truth.items()]
    return found, truth


def test_heights_come_back_exactly_without_noise() -> None:
    found, truth = heights(noise_m=0.0)
    fit = adjust_heights(found, SETTINGS)
    assert {name: z for name, (z, _) in fit.heights.items()} == pytest.approx(truth)
    assert (fit.errors, fit.untied) == ((), ())


def test_stated_sigmas_hold() -> None:
    off = []
    for seed in range(80):
        (found, truth), rng = heights(seed), np.random.default_rng(seed + 999)
        known = [
            MeasuredHeight(one.point, one.station, one.height_m + rng.normal(0, 0.005), 0.005)
            if one.station == KNOWN_HEIGHT
            else one
            for one in found
        ]
        fit = adjust_heights(known, SETTINGS).heights
        off += [(fit[name][0] - truth[name]) / fit[name][1] for name in "123456"]
    assert 0.60 < np.mean(np.abs(off) < 1) < 0.78


def test_a_known_height_that_is_off_is_named() -> None:
    found, truth = heights(noise_m=0.001)
    found[1] = MeasuredHeight("B", KNOWN_HEIGHT, truth["B"] + 1.0, 0.005, "known.csv:3")
    fit = adjust_heights(found, SETTINGS)
    assert fit.errors == ("known height of B (known.csv:3) is off",)
    assert fit.heights["4"][0] == pytest.approx(truth["4"], abs=0.01)


def test_stations_without_a_known_height_are_told() -> None:
    found, _ = heights()
    fit = adjust_heights([*found, MeasuredHeight("9", "S3", 5.0, 0.005)], SETTINGS)
    assert fit.untied == ("S3",)
    assert "9" not in fit.heights
    assert adjust_heights([MeasuredHeight("9", "S3", 5.0, 0.005)], SETTINGS).heights == {}
    assert adjust_heights([], SETTINGS).heights == {}
