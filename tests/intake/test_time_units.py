"""Times in another unit are recognised by rate or by the clock of the frames, and only then."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.intake.time_units import (
    ANY,
    FRAMES,
    NS_OF,
    READINGS,
    SCANS,
    clock_change,
    ns_of_seconds,
    other_day,
    recognised_ns,
    rounded_step,
    shared_times,
    unix_span,
)

START_NS = 52_000 * 10**9


def times_ns(step_s: float, count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return START_NS + (np.arange(count) * step_s * 1e9).astype(np.int64)


@pytest.mark.parametrize("unit", ["microseconds", "milliseconds"])
@pytest.mark.parametrize(("step_s", "steps"), [(1 / 30, FRAMES), (1 / 60, FRAMES), (0.5, FRAMES), (0.01, READINGS)])
def test_a_unit_is_recognised_by_the_rate(unit: str, step_s: float, steps: object) -> None:
    true = times_ns(step_s, 500) // NS_OF[unit]
    read, (finding,) = recognised_ns(true, true, steps, "poses.csv", "nanoseconds")  # type: ignore[arg-type]
    assert (read == true * NS_OF[unit]).all()
    assert (finding.kind, finding.file, finding.count) == ("time_unit", "poses.csv", 500)
    assert f"must be in nanoseconds, but these are in {unit}" in finding.message


@pytest.mark.parametrize("step_s", [1 / 240, 1 / 60, 1 / 30, 0.5, 5.0])
def test_times_in_the_stated_unit_stay(step_s: float) -> None:
    stated = times_ns(step_s, 100)
    read, findings = recognised_ns(stated, stated, FRAMES, "poses.csv", "nanoseconds", stated)
    assert (read == stated).all()
    assert findings == []


def test_scans_that_stand_in_ns_are_recognised_by_the_frames() -> None:
    frames, scans = times_ns(1 / 30, 3000), times_ns(3.0, 30)
    read, (finding,) = recognised_ns(scans * 1000, scans * 1000, SCANS, "wifi.csv", "microseconds", frames)
    assert (read == scans).all()
    assert "are in nanoseconds (rows come every 3 s)" in finding.message


def test_slow_scans_of_another_clock_stay_as_they_are() -> None:
    """No other unit makes them meet the frames: that is for the finding about clocks."""
    frames, scans = times_ns(1 / 30, 3000), times_ns(1800.0, 30) + 10**15
    read, findings = recognised_ns(scans, scans, SCANS, "wifi.csv", "microseconds", frames)
    assert (read == scans).all()
    assert findings == []


def test_a_single_press_is_recognised_by_the_frames() -> None:
    frames, press = times_ns(1 / 30, 3000), np.array([START_NS // 10**6 + 5000])
    read, (finding,) = recognised_ns(press, press, ANY, "refMarker.csv", "nanoseconds", frames)
    assert read.tolist() == [START_NS + 5 * 10**9]
    assert "milliseconds" in finding.message


def test_an_empty_table_says_nothing() -> None:
    none = np.empty(0, dtype=np.int64)
    assert recognised_ns(none, none, FRAMES, "poses.csv", "nanoseconds")[1] == []


@pytest.mark.parametrize("start_ns", [START_NS, 1_700_000_000 * 10**9])
@pytest.mark.parametrize(("unit", "step_s"), [("milliseconds", 2.0), ("microseconds", 1.0), ("microseconds", 3.0)])
def test_keyframes_are_recognised_by_duration(unit: str, step_s: float, start_ns: int) -> None:
    true = (times_ns(step_s, 150) - START_NS + start_ns) // NS_OF[unit]
    read, (finding,) = recognised_ns(true, true, FRAMES, "poses.csv", "nanoseconds")
    assert (read == true * NS_OF[unit]).all()
    assert f"are in {unit}" in finding.message


@pytest.mark.parametrize("rows", [2, 3])
def test_several_rows_a_frame_are_no_other_unit(rows: int) -> None:
    each = np.add.outer(times_ns(1 / 30, 3000), np.arange(rows) * 300_000).ravel()
    read, findings = recognised_ns(each, each, FRAMES, "poses.csv", "nanoseconds")
    assert findings == []
    assert (read == each).all()


def test_readings_written_in_blocks_are_no_other_unit() -> None:
    each = np.add.outer(times_ns(0.5, 200), np.arange(50) * 10_000).ravel()
    assert recognised_ns(each, each, READINGS, "sensors.csv", "nanoseconds")[1] == []


def test_a_gap_does_not_hide_the_unit() -> None:
    true = np.concatenate((times_ns(1 / 30, 1000), times_ns(1 / 30, 1000) + 3600 * 10**9)) // 1000
    assert len(recognised_ns(true, true, FRAMES, "poses.csv", "nanoseconds")[1]) == 1


def test_a_short_clip_stays() -> None:
    clip = times_ns(1 / 60, 40)
    assert recognised_ns(clip, clip, FRAMES, "poses.csv", "nanoseconds")[1] == []


@pytest.mark.parametrize(
    ("cells", "step"),
    [
        (["1.70000E+18", "1.70000E+18"], 1e13),
        (["7.25494E+14"], 1e9),
        (["1,70136286270131E+018"], 1e4),
        (["99999.5", "1.0000e+05"], 10.0),
        (["1.234500000000000000e+02"], 1e-16),
        (["1.5e99999"], 1e300),
        (["1700000000000000000", "12.5", "", None], 0.0),
    ],
)
def test_the_step_of_rounded_numbers_is_that_of_their_last_digit(cells: list[str | None], step: float) -> None:
    assert rounded_step(cells)[0] == pytest.approx(step)


@pytest.mark.parametrize(("hours", "step_s"), [(1, 0.02), (-1, 0.02), (1, 60.0), (-1, 60.0)])
def test_a_clock_that_was_changed_by_an_hour_is_found(hours: int, step_s: float) -> None:
    walk = times_ns(step_s, 300)
    assert clock_change(walk) is None
    changed = walk + np.where(np.arange(300) < 100, 0, hours * 3600 * 10**9)
    assert clock_change(changed) == 100
    pause = walk + np.where(np.arange(300) < 100, 0, 3_700 * 10**9)
    assert clock_change(pause) is None


def test_an_inertial_sensor_whose_readings_share_times_has_rounded_times() -> None:
    walk = times_ns(0.01, 500)
    assert not shared_times(walk)
    assert not shared_times(np.repeat(walk, 2))
    assert shared_times(walk // 10**9)


@pytest.mark.parametrize("unit", ["nanoseconds", "microseconds", "milliseconds"])
def test_dates_that_are_not_in_seconds_are_recognised(unit: str) -> None:
    true_s = 1_700_000_000 + np.arange(100) / 30
    read, (finding,) = ns_of_seconds(true_s * (1e9 / NS_OF[unit]), FRAMES, "poses.tum")
    assert np.abs(read - true_s * 1e9).max() < 1000
    assert (finding.kind, finding.count) == ("time_unit", 100)
    assert ns_of_seconds(true_s, FRAMES, "poses.tum")[1] == []


def test_times_beyond_64_bits_and_rounded_ones_do_not_fail() -> None:
    read, _ = ns_of_seconds(np.array((1.0, 1e300, np.nan, -np.inf)), FRAMES, "poses.tum")
    assert read.tolist() == [10**9, 2**62, 0, -(2**62)]
    _, (finding,) = ns_of_seconds(np.full(60, 1.7e9), FRAMES, "poses.tum")
    assert finding.kind == "rounded_times"


@pytest.mark.parametrize(("days", "named"), [(0.9, False), (163, True), (-163, True)])
def test_recordings_of_two_days_are_named_with_their_dates(days: float, named: bool) -> None:
    walk_ns, start_ns = times_ns(1.0, 60), 1_639_991_640 * 10**9  # 2021-12-20 09:14
    ours = unix_span(walk_ns, start_ns - START_NS)
    theirs = unix_span(start_ns + round(days * 86_400) * 10**9 + walk_ns - START_NS, None)
    said = other_day("band.csv", theirs, "the walk", ours)
    assert (said is not None) == named
    if days > 1:
        dates = "band.csv was recorded on 2022-06-01 09:14 to 09:14 (UTC), the walk on 2021-12-20 09:14 to 09:14 (UTC)"
        assert said == f"{dates}: not the same walk; choose the recording of that day"
    assert other_day("band.csv", unix_span(walk_ns, None), "the walk", ours) is None
    assert unix_span(walk_ns[:0], 0) is None
