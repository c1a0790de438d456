"""Places that other walks tell: believed as far as they are known, and no farther."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from tests.estimation.test_smoothing import TYPICAL, errors, lengths, solved
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.place_ties import smooth_with_ties
from vislam2tag.estimation.smoothing import Smoothed, mapped_path, smooth

DRIFTING = replace(TYPICAL, heading_rad=0.02, position_m=0.05)
EVERY = 40


def walk_past_few(seed: int) -> tuple[Drifting, Smoothed, IntArray]:
    """A walk past two surveyed landmarks near each other, as smoothed, and the times of its frames."""
    walk = loops(seed, DRIFTING, marks=8, laps=2)
    smoothed = solved(walk, [0, 1])
    return walk, smoothed, np.rint(smoothed.model.observations.odometry.time_s * 1e9).astype(np.int64)


def ties_of(walk: Drifting, time_ns: IntArray, off: FloatArray, sigma_m: float) -> PlaceTies:
    at = np.arange(EVERY, len(time_ns), EVERY)
    return PlaceTies(time_ns[at], as_points(walk.truth[at]) + off, np.eye(2 * len(at)) * sigma_m**2)


def test_places_known_well_lead_the_walk_there_and_sigma_says_so() -> None:
    for seed in range(3):
        walk, smoothed, time_ns = walk_past_few(seed)
        tied = smooth_with_ties(smoothed, time_ns, ties_of(walk, time_ns, np.zeros(2), 0.05))
        assert lengths(errors(walk, tied)).mean() < 0.5 * lengths(errors(walk, smoothed)).mean()
        assert np.trace(mapped_path(tied)[1].mean(axis=0)) < 0.5 * np.trace(mapped_path(smoothed)[1].mean(axis=0))


def test_an_error_that_all_places_share_leads_the_walk_nowhere() -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    alone = ties_of(walk, time_ns, np.array([1.0, 0.0]), 1.0)
    count = len(alone.time_ns)
    alike = np.full((count, count), 0.99) + 0.01 * np.eye(count)
    shared = replace(alone, covariance_m2=np.asarray(np.kron(alike, np.eye(2)), dtype=np.float64))
    bent, kept = (errors(walk, smooth_with_ties(smoothed, time_ns, ties)) for ties in (alone, shared))
    assert abs(kept[:, 0].mean()) < 0.5 * abs(bent[:, 0].mean())


def test_a_place_far_off_is_not_believed() -> None:
    walk, smoothed, time_ns = walk_past_few(1)
    ties = ties_of(walk, time_ns, np.zeros(2), 0.3)
    wild = replace(ties, position_bcs=ties.position_bcs + np.eye(len(ties.time_ns), 2, -5) * 30)
    right, bent = (errors(walk, smooth_with_ties(smoothed, time_ns, one)) for one in (ties, wild))
    assert lengths(bent - right).max() < 0.3


def test_nothing_told_changes_nothing() -> None:
    walk, smoothed, time_ns = walk_past_few(2)
    late = ties_of(walk, time_ns + 10**12, np.zeros(2), 0.1)
    assert smooth_with_ties(smoothed, time_ns, late) is smoothed
    unknown = smooth_with_ties(smoothed, time_ns, ties_of(walk, time_ns, np.ones(2), 1e3))
    moved = lengths(mapped_path(unknown)[0] - mapped_path(smoothed)[0])
    assert moved.max() < 0.5 * np.sqrt(np.trace(mapped_path(smoothed)[1], axis1=1, axis2=2).max())


@pytest.mark.parametrize("off_m", [3.0, 100.0])
def test_a_refused_place_makes_no_label_less_certain(off_m: float) -> None:
    walk, smoothed, time_ns = walk_past_few(1)
    ties = ties_of(walk, time_ns, np.zeros(2), 0.3)
    wild = replace(ties, position_bcs=ties.position_bcs + np.eye(len(ties.time_ns), 2, -5) * off_m)
    spread = np.sqrt(np.trace(mapped_path(smooth_with_ties(smoothed, time_ns, wild))[1], axis1=1, axis2=2) / 2)
    assert spread.max() < 1.0


def test_who_hangs_on_the_same_landmarks_makes_them_no_surer() -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    off = np.kron(np.full((8, 8), 0.25), np.eye(2)) + 1e-4 * np.eye(16)
    joint = np.full((24, 24), np.nan)
    joint[:16, :16] = off
    unknown = np.full(8, np.nan)
    landmarks = LandmarkPriors(walk.place, np.tile(0.25 * np.eye(2), (8, 1, 1)), unknown, unknown, joint)
    alone = smooth(smoothed.model.observations, landmarks)
    assert alone is not None
    tied = smooth_with_ties(alone, time_ns, ties_of(walk, time_ns, np.zeros(2), 0.05))
    assert mapped_path(tied)[1][:, 0, 0].min() > 0.8 * 0.25


@pytest.mark.parametrize(("away_s", "tied"), [(0.4, True), (0.6, False)])
def test_a_moment_more_than_half_a_second_from_every_frame_ties_nothing(away_s: float, tied: bool) -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    end = as_points(walk.truth[-1:] + 3.0)
    tie = PlaceTies(time_ns[-1:] + int(away_s * 1e9), end, np.eye(2) * 0.05**2)
    assert (smooth_with_ties(smoothed, time_ns, tie) is not smoothed) == tied
