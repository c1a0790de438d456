"""Walks through smoothing: a track makes positions far better, walking speed some; nothing is made worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.sequences import _variance, filtered, smoothed

STOREYS = (Storey("", 0), Storey("", 1))
NOISE_M = 2.0


def walk(n: int = 60, seed: int = 0) -> tuple[RadioScans, np.ndarray, Positions]:
    """A round walk at 0.8 m/s with a scan every two seconds, its truth, and answers with independent errors."""
    rng = np.random.default_rng(seed)
    angle = np.arange(n) * 1.6 / 12
    truth = 12 * np.column_stack([np.cos(angle), np.sin(angle)])
    nothing = np.empty(0, dtype=np.int64)
    session = np.full(n, "walk")
    scans = scans_from_readings(
        nothing, nothing.astype(str), np.empty(0), n, session=session, time_ns=np.arange(n) * 2 * 10**9
    )
    found = Positions(
        storeys=STOREYS,
        storey=np.zeros(n, dtype=np.int64),
        xy=truth + rng.normal(0, NOISE_M, (n, 2)),
        z=np.full(n, 1.0),
        storey_probability=np.tile([0.7, 0.3], (n, 1)),
        radius_68_m=np.full(n, 1.51 * NOISE_M),
        radius_95_m=np.full(n, 2.45 * NOISE_M),
    )
    return scans, truth, found


def mean_error(found: Positions, truth: np.ndarray) -> float:
    return float(np.hypot(*(found.xy - truth).T).mean())


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray(points @ rotation.T + 100.0)


def test_walking_speed_and_tracks_help() -> None:
    scans, truth, found = walk()
    alone = mean_error(found, truth)
    assert mean_error(smoothed(found, scans), truth) < 0.9 * alone
    tracked = smoothed(found, scans, turned(truth, 2.0))
    assert mean_error(tracked, truth) < 0.5 * alone
    assert (tracked.radius_68_m < found.radius_68_m).all()


def test_a_lost_tracker_is_bridged() -> None:
    scans, truth, found = walk()
    track = turned(truth, -1.0)
    track[20:30] = np.nan
    track[30:] += 7.0
    assert mean_error(smoothed(found, scans, track), truth) < 0.8 * mean_error(found, truth)


def test_an_answer_far_off_is_not_believed() -> None:
    scans, truth, found = walk()
    found.xy[30] += 40.0
    assert np.hypot(*(smoothed(found, scans, turned(truth, 0.5)).xy[30] - truth[30])) < 5.0


def test_deaf_scans_get_a_place_and_a_lone_wrong_storey_is_mended() -> None:
    scans, truth, found = walk()
    deaf = np.arange(60) == 10
    found.storey_probability[40] = [0.4, 0.6]
    found.storey[40] = 1
    mended = smoothed(found.without(deaf), scans)
    assert mended.known.all()
    assert np.hypot(*(mended.xy[10] - truth[10])) < 4.0
    assert (mended.storey == 0).all()
    assert mended.z[10] == 1.0


def test_the_filter_helps_without_looking_ahead() -> None:
    scans, truth, found = walk()
    track = turned(truth, 2.0)
    alone = mean_error(found, truth)
    assert mean_error(filtered(found, scans), truth) < 0.95 * alone
    tracked = filtered(found, scans, track)
    assert mean_error(tracked, truth) < 0.8 * alone
    assert mean_error(smoothed(found, scans, track), truth) < mean_error(tracked, truth)
    later = np.arange(60) >= 30
    found.xy[later] -= 9.0
    track[later] = np.nan
    again = filtered(found, scans, track)
    np.testing.assert_array_equal(again.xy[~later], tracked.xy[~later])
    np.testing.assert_array_equal(again.radius_68_m[~later], tracked.radius_68_m[~later])


def test_the_filter_ends_where_the_smoother_does_and_waits_for_the_first_answer() -> None:
    scans, truth, found = walk()
    deaf = found.without(np.arange(60) < 2)
    track = turned(truth, 0.3)
    causal, whole = filtered(deaf, scans, track), smoothed(deaf, scans, track)
    assert not causal.known[:2].any()
    assert causal.known[2:].all()
    np.testing.assert_array_equal(causal.xy[-1], whole.xy[-1])
    np.testing.assert_array_equal(causal.storey_probability[-1], whole.storey_probability[-1])


def test_scans_of_no_session_stay() -> None:
    scans, _, found = walk()
    apart = replace(scans, session=np.full(60, ""))
    np.testing.assert_array_equal(smoothed(found, apart).xy, found.xy)


def test_variances_are_those_of_the_inverse() -> None:
    rng = np.random.default_rng(1)
    weight, between = rng.uniform(0.1, 1, 6), rng.uniform(0.1, 1, 5)
    system = (
        np.diag(weight + np.append(between, 0) + np.append(0, between)) - np.diag(between, 1) - np.diag(between, -1)
    )
    assert _variance(weight, between) == pytest.approx(np.diag(np.linalg.inv(system)))
