"""Walks cut into rigid stretches: how long these are, where they end, and how one leads to the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import RATE_HZ, along, odometry_of, with_gap
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.estimation.floor_plan.stretches import SPACING_M, stretches_of
from vislam2tag.estimation.odometry import Odometry


def straight(length_m: float) -> Odometry:
    """Along the x axis at 1 m/s."""
    return odometry_of(along((0, length_m)))


@pytest.mark.parametrize(("length_m", "count"), [(2.5, 1), (12, 1), (17, 1), (19, 2), (60, 5), (65, 5), (100, 8)])
def test_stretches_are_about_equally_long_and_leave_nothing_out(length_m: float, count: int) -> None:
    walk = stretches_of(straight(length_m))
    assert len(walk.stretches) == count
    ways = [one.way_m for one in walk.stretches]
    assert ways == pytest.approx([length_m / count] * count, abs=SPACING_M)
    assert walk.way_m == pytest.approx(length_m, abs=count * SPACING_M)
    ends = [(one.first, one.last) for one in walk.stretches]
    assert [first for first, _ in ends[1:]] == [last for _, last in ends[:-1]]
    assert (ends[0][0], ends[-1][1]) == (0, round(length_m * RATE_HZ))


def test_short_stretches_are_as_long_as_asked_for() -> None:
    walk = stretches_of(straight(60), 5.0)
    assert [one.way_m for one in walk.stretches] == pytest.approx([5.0] * 12)


def test_points_lie_on_the_way_around_their_middle() -> None:
    corner = odometry_of(along((0, 6, 6 + 6j)))
    (one,) = stretches_of(corner).stretches
    assert np.abs(np.diff(one.points)) == pytest.approx(SPACING_M, abs=0.07)  # across the corner it is shorter
    away = np.minimum(np.abs(one.points.imag), np.abs(one.points.real - 6))
    assert away.max() < 0.11
    assert one.middle == pytest.approx(4.5 + 1.5j, abs=0.02)
    assert one.shape.mean() == pytest.approx(0)


def test_links_lead_from_middle_to_middle() -> None:
    walk = stretches_of(odometry_of(along((0, 24, 24 + 24j))))
    first, second, third = walk.links
    assert first.step == pytest.approx(12)
    assert second.step == pytest.approx(6 + 6j, abs=0.02)
    assert third.step == pytest.approx(12j)
    for link in walk.links:
        assert link.way_m == pytest.approx(12)
        assert (link.sigma_m, link.sigma_rad, link.jumps) == (0, 0, 0)


@pytest.mark.parametrize(("sigma_m", "sigma_rad"), [(0.5, 0.0), (0.0, 0.2)])
def test_a_gap_ends_a_stretch(sigma_m: float, sigma_rad: float) -> None:
    walk = stretches_of(with_gap(straight(48), 205, sigma_m, sigma_rad))
    assert all(one.last <= 205 or one.first >= 206 for one in walk.stretches)
    assert [round(one.way_m) for one in walk.stretches] == [10, 10, 14, 14]
    (over,) = [link for link in walk.links if link.jumps]
    assert over is walk.links[1]
    assert (over.sigma_m, over.sigma_rad) == pytest.approx((sigma_m, sigma_rad))
    assert over.jumps == 1
    assert over.step == pytest.approx(12.3, abs=0.2)
    assert all(link.sigma_m == link.sigma_rad == 0 for link in walk.links if link is not over)


def test_a_small_doubt_cuts_nothing_and_counts_where_it_is() -> None:
    walk = stretches_of(with_gap(straight(48), 100, 0.2, 0.1))
    assert [one.way_m for one in walk.stretches] == pytest.approx([12.0] * 4)
    assert [link.sigma_m for link in walk.links] == pytest.approx([0.2, 0, 0])
    assert [link.sigma_rad for link in walk.links] == pytest.approx([0.1, 0, 0])
    assert [link.jumps for link in walk.links] == [1, 0, 0]


def test_a_short_piece_between_gaps_is_left_out_and_its_doubts_add_up() -> None:
    walk = stretches_of(with_gap(with_gap(straight(40), 203, 0.4, 0.2), 218, 0.31, 0.1))
    assert [round(one.way_m) for one in walk.stretches] == [10, 10, 9, 9]
    assert all(one.last <= 203 or one.first >= 219 for one in walk.stretches)
    (over,) = [link for link in walk.links if link.jumps]
    assert over.jumps == 2
    assert over.sigma_m == pytest.approx(np.hypot(0.4, 0.31))
    assert over.sigma_rad == pytest.approx(np.hypot(0.2, 0.1))


def test_standing_still_adds_no_way() -> None:
    path = along((0, 24))
    stood = np.concatenate((path[:120], np.repeat(path[120], 300), path[120:]))
    moving, standing = stretches_of(odometry_of(path)), stretches_of(odometry_of(stood))
    for one, other in zip(moving.stretches, standing.stretches, strict=True):
        assert one.points == pytest.approx(other.points, abs=0.01)


def test_a_hand_that_sways_within_a_step_adds_little_way() -> None:
    path = along((0, 24))
    fast = np.interp(np.arange(0, len(path) - 1, 0.1), np.arange(len(path)), path.real)  # 100 frames a second
    sway = 0.02j * np.sin(2 * np.pi * np.arange(len(fast)) / 10)
    swaying = replace(odometry_of(fast + sway), time_s=np.arange(len(fast)) / 100)
    own_way = float(np.abs(np.diff(fast + sway)).sum())
    assert own_way > 30
    assert stretches_of(swaying).way_m == pytest.approx(24, abs=0.5)


@pytest.mark.parametrize("path", [np.zeros(300, dtype=np.complex128), along((0, 1.8))])
def test_a_walk_without_way_has_no_stretch(path: ComplexArray) -> None:
    walk = stretches_of(odometry_of(path))
    assert (walk.stretches, walk.links, walk.way_m) == ((), (), 0)
