"""Clocks of two recorders of one walk are aligned by what both heard, or refused with the figures that say why."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.clock_by_levels import Heard, align_by_levels

UNIX_S = 1.7e9


def levels(seed: int, jitter_s: float, offset_s: float, device_db: float) -> Heard:
    """What a device hears of 12 access points along a walk of four minutes, in scans of its own every 3 s."""
    walk = np.random.default_rng(5)
    places, rng = walk.uniform(0, 200, 12), np.random.default_rng(seed)
    scan_s = np.arange(rng.uniform(0, 3), 240.0, 3.0)
    at_m = 200 * np.sin(scan_s / 70) ** 2 + scan_s / 8
    heard = {}
    for number, place in enumerate(places):
        level = np.round(-40 - 25 * np.log10(1 + np.abs(at_m - place)) + rng.normal(0, 3, len(scan_s)) + device_db)
        stamps = np.round((scan_s + offset_s + rng.uniform(0, jitter_s, len(scan_s))) * 1e9).astype(np.int64)
        heard[f"ap{number}"] = (np.sort(stamps), level)
    return heard


def test_levels_of_another_device() -> None:
    found = align_by_levels(levels(1, 0.3, UNIX_S, -6.0), levels(2, 0.3, 800.0, 0.0))
    assert found.offset_ns is not None
    error_s = found.offset_ns * 1e-9 - (UNIX_S - 800.0)
    assert abs(error_s) < 3 * found.sigma_s < 5
    assert found.figures.startswith("12 access points in common, ")


def test_the_same_readings_tell_it_to_ten_milliseconds() -> None:
    own = levels(2, 0.0, 800.0, 0.0)
    theirs = {name: (stamps + 123_450_000_000, level) for name, (stamps, level) in own.items()}
    found = align_by_levels(theirs, own)
    assert (found.offset_ns, found.sigma_s) == (123_450_000_000, 0.01)


def test_levels_that_say_nothing_are_refused_with_their_figure() -> None:
    rng = np.random.default_rng(3)
    own = levels(2, 0.0, 800.0, 0.0)
    flat = {name: (stamps, rng.normal(-60, 1, len(stamps))) for name, (stamps, _) in own.items()}
    assert "dB apart" in align_by_levels(flat, own).figures
    assert align_by_levels(flat, own).offset_ns is None
    assert align_by_levels({"other": own["ap0"]}, own).figures == "no access point was heard by both"
