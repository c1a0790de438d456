"""The clock of a walk's scans is told by what other walks heard where it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk, offsets_on_floor

POINTS = np.random.default_rng(0).uniform((0, 0), (50, 30), (12, 2)) @ (1, 1j)


def walked(seed: int, device_db: float) -> HeardOnWalk:
    """Two minutes along a way of its own through a hall of 50 m x 30 m with twelve access points."""
    rng = np.random.default_rng(seed)
    way_s = 100.0 * seed + np.arange(0.0, 140.0, 0.5)
    corners = rng.uniform((2, 2), (48, 28), (9, 2)) @ (1, 1j)
    ways = np.linspace(0, 8, len(way_s))
    way = np.interp(ways, np.arange(9), corners)
    scan_s = np.repeat(np.arange(way_s[0] + 2, way_s[-1] - 2, 3.0), len(POINTS))
    number = np.tile(np.arange(len(POINTS)), len(scan_s) // len(POINTS))
    apart_m = np.abs(np.interp(scan_s, way_s, way) - POINTS[number])
    dbm = np.round(-35 - 28 * np.log10(1 + apart_m) + device_db + rng.normal(0, 2.5, len(scan_s)))
    return HeardOnWalk(scan_s, (scan_s * 10).astype(np.int64), np.array([f"ap{n:02}" for n in number]), dbm, way_s, way)


WALKS = [walked(seed, device_db) for seed, device_db in enumerate((0.0, -7.0, 0.0, -7.0, 0.0))]


def test_nothing_is_off_in_a_sound_survey() -> None:
    found = offsets_on_floor(WALKS)
    assert [at is not None and at.sure for at in found] == [False] * 5
    assert all(at is not None and abs(at.offset_s) < 3 * at.sigma_s < 2.0 for at in found)


@pytest.mark.parametrize("offset_s", [2.0, -8.0, 25.0])
def test_one_walk_is_off_and_no_other(offset_s: float) -> None:
    late = replace(WALKS[1], time_s=WALKS[1].time_s - offset_s)
    found = offsets_on_floor([WALKS[0], late, *WALKS[2:]])
    assert [at is not None and at.sure for at in found] == [False, True, False, False, False]
    assert found[1] is not None
    assert found[1].offset_s == pytest.approx(offset_s, abs=1.0)


def test_a_walk_that_is_off_spoils_no_other() -> None:
    """Two of five: each was a third of what the other was compared with."""
    off_s = (0.0, 12.0, 0.0, -3.0, 0.0)
    late = [replace(walk, time_s=walk.time_s - at) for walk, at in zip(WALKS, off_s, strict=True)]
    found = offsets_on_floor(late)
    assert [at is not None and at.sure for at in found] == [False, True, False, True, False]
    assert [at.offset_s for at in found if at is not None] == pytest.approx(off_s, abs=1.0)


def test_a_walk_where_nobody_else_was_tells_nothing() -> None:
    aside = replace(WALKS[1], way=WALKS[1].way + 200)
    assert offsets_on_floor([WALKS[0], aside, *WALKS[2:]])[1] is None
