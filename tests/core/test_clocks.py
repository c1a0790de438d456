"""Clocks are aligned, or refused with the figures that say why; the lag of poses is found beside a gyroscope."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clocks import (
    STAMPS_SIGMA_S,
    ClockAlignment,
    Heard,
    _line,
    align_by_levels,
    align_by_motion,
    align_by_taps,
    best_shift,
    estimate_pose_lag,
)

UNIX_S = 1.7e9


def motion(seconds: float, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Times (s) every 5 ms, and the norm of turn rates as somebody has who walks: steps, turns, stops."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, seconds, 0.005)
    knots = np.arange(0, seconds + 1, 0.7)
    turns = np.interp(time_s, knots, rng.gamma(0.7, 0.6, len(knots)))
    every_5 = np.arange(0, seconds + 5, 5.0)
    steps = np.cumsum(np.interp(time_s, every_5, rng.uniform(1.6, 2.1, len(every_5)))) * 0.005
    return time_s, np.abs(turns + 0.15 * np.sin(2 * np.pi * steps) + 0.3)


def other_recorder(
    time_s: FloatArray, norm: FloatArray, *, rate_hz: float, drift: float, offset_s: float, noise: float, seed: int
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Stamps of a clock of its own, noisy samples in another unit, and when they were really taken, seconds."""
    rng = np.random.default_rng(seed)
    taken_s = np.sort(np.arange(3.0, time_s[-1] - 3, 1 / rate_hz) + rng.normal(0, 0.1 / rate_hz, 1))
    felt = 57.3 * np.interp(taken_s, time_s, norm) + rng.normal(0, 57.3 * noise * norm.std(), len(taken_s))
    return np.round((taken_s * (1 + drift) + offset_s) * 1e9).astype(np.int64), felt, taken_s


def own_recorder(time_s: FloatArray, norm: FloatArray) -> tuple[IntArray, FloatArray]:
    rng = np.random.default_rng(99)
    return np.round((time_s[::4] + 500.0) * 1e9).astype(np.int64), norm[::4] + rng.normal(0, 0.05, len(norm[::4]))


@pytest.mark.parametrize("rate_hz", [25.0, 60.0, 200.0])
@pytest.mark.parametrize("drift", [0.0, 6e-5, -6e-5])
def test_another_rate_noise_and_drift(rate_hz: float, drift: float) -> None:
    worst, within = [], []
    for seed in range(4):
        time_s, norm = motion(180.0, seed)
        our_ns, ours = own_recorder(time_s, norm)
        their_ns, theirs, taken_s = other_recorder(
            time_s, norm, rate_hz=rate_hz, drift=drift, offset_s=UNIX_S + 7.3 * seed, noise=0.3, seed=seed
        )
        found = align_by_motion(their_ns, theirs, our_ns, ours)
        error_s = np.abs(found.ours(their_ns) * 1e-9 - (taken_s + 500.0)).max()
        worst.append(error_s)
        within.append(error_s <= 3 * found.sigma_s)
    assert max(worst) < 0.02, "a fiftieth of a second anywhere on the walk"
    assert sum(within) >= 3, "and the stated sigma says so"


def test_motion_of_another_walk_is_refused_with_its_figure() -> None:
    time_s, norm = motion(180.0, 1)
    our_ns, ours = own_recorder(time_s, norm)
    their_ns, theirs, _ = other_recorder(*motion(180.0, 2), rate_hz=50, drift=0, offset_s=UNIX_S, noise=0.3, seed=1)
    found = align_by_motion(their_ns, theirs, our_ns, ours)
    assert found.offset_ns is None
    assert found.figures.startswith("correlation 0.")
    with pytest.raises(ValueError, match="correlation"):
        found.ours(their_ns)


def test_steps_as_even_as_a_clock_are_refused_for_they_fit_a_step_later_too() -> None:
    time_s = np.arange(0.0, 120.0, 0.01)
    even = np.sin(2 * np.pi * 2.0 * time_s) + np.linspace(0, 1, len(time_s)) ** 2
    time_ns = np.round(time_s * 1e9).astype(np.int64)
    found = align_by_motion(time_ns + 10**9, even, time_ns, even)
    assert found.offset_ns is None


def test_a_short_series_is_refused() -> None:
    time_s, norm = motion(20.0)
    time_ns, values = own_recorder(time_s, norm)
    found = align_by_motion(time_ns, values, time_ns, values)
    assert (found.offset_ns, found.figures) == (None, "less than 40 s of motion to compare")
    assert align_by_motion(time_ns[:0], values[:0], time_ns, values).offset_ns is None


def test_one_time_of_years_away_is_refused_before_it_fills_the_memory() -> None:
    ns = np.append(np.arange(60, dtype=np.int64) * 10**9, 4 * 10**18)
    walked = np.arange(60, dtype=np.int64) * 10**9
    for theirs, ours in ((ns, walked), (walked, ns)):
        found = align_by_motion(theirs, np.ones(len(theirs)), ours, np.ones(len(ours)))
        assert (found.offset_ns, "24 h" in found.figures) == (None, True)
        levels = align_by_levels({"a": (theirs, np.ones(len(theirs)))}, {"a": (ours, np.ones(len(ours)))})
        assert (levels.offset_ns, "too far apart" in levels.figures) == (None, True)


def test_a_clock_that_runs_faster_is_set_right_everywhere() -> None:
    clock = ClockAlignment(10_000, rate=0.25, at_ns=1000)
    ours = np.array([1000, 2000, 5000])
    theirs = ours + 10_000 + np.round(0.25 * (ours - 1000)).astype(np.int64)
    assert clock.ours(theirs).tolist() == ours.tolist()


def test_sigma_holds_at_both_ends_of_a_walk() -> None:
    """Of walks whose windows scatter evenly, the larger error of both ends is within two sigma in 95 %."""
    rng = np.random.default_rng(17)
    middles = np.linspace(0, 115, 24)
    within = 0
    for _ in range(1000):
        offset, rate, at, sigma = _line(middles, rng.normal(0, 0.003, 24))
        within += abs(np.array((offset, offset)) + rate * (middles[[0, -1]] - at)).max() <= 2 * sigma
    assert 0.94 < within / 1000 < 0.97


def test_what_all_windows_share_is_part_of_sigma() -> None:
    time_s, norm = motion(120.0, seed=3)
    their_ns, theirs, _ = other_recorder(time_s, norm, rate_hz=200.0, drift=0.0, offset_s=5.0, noise=0.0, seed=1)
    found = align_by_motion(their_ns, theirs, np.round(time_s * 1e9).astype(np.int64), norm)
    assert found.offset_ns is not None
    assert found.sigma_s > STAMPS_SIGMA_S


def test_what_is_not_known_of_a_series_is_not_compared() -> None:
    _, norm = motion(300.0, 4)
    whole = norm[::10]
    holed = whole.copy()
    holed[1000:3000] = np.nan
    found = best_shift(whole, holed[400:])
    assert found.shift_s == pytest.approx(400 * 0.05)
    assert found.correlation == pytest.approx(1.0)
    assert found.is_clear(0.7)
    assert not best_shift(whole, np.where(np.isnan(holed), 0.0, np.nan)[:1200]).is_clear(0.0)


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
    assert align_by_levels({"other": own["ap0"]}, own).figures == "no access point was received by both"


OFFSET_NS = 7_300_000_000
OURS_NS = np.array((1.0, 4.2, 11.9, 30.1, 30.9, 52.4)) * 1e9


def test_taps_in_common_tell_the_offset_with_its_sigma() -> None:
    hands_s = np.array((0.03, -0.02, 0.01, -0.04, 0.02, 0.0))
    theirs = np.append(OURS_NS + OFFSET_NS + hands_s * 1e9, (3e12, 0.5e12)).astype(np.int64)
    found = align_by_taps(theirs, OURS_NS.astype(np.int64))
    assert found.offset_ns is not None
    assert abs(found.offset_ns - OFFSET_NS) < 30_000_000
    assert 0.01 <= found.sigma_s < 0.03
    assert found.figures.startswith("6 taps in common")


def test_taps_that_do_not_tell_are_refused_with_their_figures() -> None:
    ours = OURS_NS.astype(np.int64)
    few = align_by_taps(ours[:3], ours)
    assert (few.offset_ns, few.figures) == (None, "3 and 6 taps, but 4 of each are needed")
    even = np.arange(8, dtype=np.int64) * 2_000_000_000
    alike = align_by_taps(even, even)
    assert alike.offset_ns is None, "taps as even as a clock fit one later nearly as well"
    assert alike.figures == "8 taps in common, 7 at the best other offset"
    other = align_by_taps(np.cumsum(np.array((3, 7, 19, 43, 101))) * 1_000_000_000, ours)
    assert other.offset_ns is None


def recorded(lag_s: float, seconds: float = 60.0) -> tuple[IntArray, FloatArray, IntArray, FloatArray]:
    """Heading that swings irregularly, logged by a tracker that stamps late and by a gyroscope."""
    fine = np.arange(0, seconds, 0.005)
    rng = np.random.default_rng(4)
    rate = np.convolve(rng.normal(size=len(fine)), np.hanning(120), mode="same") * 0.1
    heading = np.cumsum(rate) * 0.005
    frames = np.arange(0.6, seconds - 0.6, 1 / 30)
    poses = Rotation.from_euler("y", np.interp(frames, fine, heading)[:, None]).as_quat()
    gyro_s = np.arange(0, seconds, 0.02)
    gyro = np.column_stack((np.zeros(len(gyro_s)), np.interp(gyro_s, fine, rate), np.zeros(len(gyro_s))))
    return ((frames + lag_s) * 1e9).astype(np.int64), poses, (gyro_s * 1e9).astype(np.int64), gyro


@pytest.mark.parametrize("lag_s", [0.0, 0.04, 0.25, -0.1])
def test_lag_is_found_to_a_few_milliseconds(lag_s: float) -> None:
    assert estimate_pose_lag(*recorded(lag_s)) == pytest.approx(lag_s, abs=0.004)


def test_none_where_nothing_overlaps_or_correlates() -> None:
    time_ns, poses, gyro_ns, gyro = recorded(0.0)
    assert estimate_pose_lag(time_ns, poses, gyro_ns + 10**12, gyro) is None
    assert estimate_pose_lag(time_ns, poses, gyro_ns[:10], gyro[:10]) is None
    assert estimate_pose_lag(time_ns[:0], poses[:0], gyro_ns, gyro) is None
    noise = np.random.default_rng(0).normal(size=gyro.shape)
    assert estimate_pose_lag(time_ns, poses, gyro_ns, noise) is None
    still = np.tile(poses[:1], (len(poses), 1))
    assert estimate_pose_lag(time_ns, still, gyro_ns, gyro) is None
