"""How far along its course others' magnetic fields say that a walk was.

Steel bends the earth's field, in each place of a building in its own way. Who comes through the same corridor feels the
same field, and where it fits what another walk felt (:mod:`~vislam2tag.walk_ties.field_matching`) says how far along
the way a walk was beside the other; nothing is said across. Several others are averaged, the surer placed the more they
count. How far such fixes are off is estimated from all walks at once (:mod:`~vislam2tag.walk_ties.fix_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.positioning.scans.held_out import calibration_rows
from vislam2tag.walk_ties.felt_ways import FeltWay
from vislam2tag.walk_ties.field_matching import HALF, FeltFloor, Match
from vislam2tag.walk_ties.fix_errors import ALIKE, Fixes, match_errors, promised

EVERY_STEPS = 20
"""Others are asked once in so many steps, 5 m: windows of fixes nearer each other share most of what they hold."""
FEWEST_FIXES, MOST_ASKED, MOST_TIES = 3, 256, 64
"""Fewer fixes of a walk tie nothing; most places of a walk that are asked for, and most that it is told, evenly
spread."""
FEWEST_OF_FLOOR = 30
"""From fewer fixes of all walks nobody knows how far they are off, and nothing is told."""
USUAL_SIZE = 6.0
"""Before anything is seen errors are taken to be of this size, some 0.7 m: as those against real walks' taps are
(docs/results/walk-ties.md)."""
TRIED = (*ALIKE, *((share, np.inf) for share in (0.4, 0.8, 0.95)))
"""Errors of a walk may also all be alike along its course, as those of one whose places lag behind."""
ACROSS_M = 10.0
"""Standard deviation across the course: nothing is known."""
DOUBTED = 4.0
"""By so much the variance is greater: what walks have in common besides landmarks is not told
(docs/results/walk-ties.md)."""
LEAST_PROMISE = 0.05
"""Ties that lower the stated sigma of a walk's path by a smaller share are left out."""


def magnetic_ties(ways: Sequence[FeltWay | None]) -> list[PlaceTies | None]:
    """Return for each walk of a floor how far along its course the others put it; None where they tell nothing that
    helps.
    """
    fixes = walk_fixes(ways)
    told = [one for one in fixes if one is not None]
    if sum(len(one) for one in told) < FEWEST_OF_FLOOR:
        return [None] * len(fixes)
    errors = match_errors(told, USUAL_SIZE, TRIED)
    return [None if one is None else _ties(one, DOUBTED * one.covariance(errors)) for one in fixes]


def walk_fixes(ways: Sequence[FeltWay | None]) -> list[Fixes | None]:
    """Put each walk, once in a few metres, where the others felt the same along their ways; None where these are too
    few.
    """
    if sum(way is not None for way in ways) < 2:
        return [None] * len(ways)
    floor = FeltFloor.of(ways)
    return [None if way is None else _fixes(floor, number, way) for number, way in enumerate(ways)]


def _fixes(floor: FeltFloor, number: int, own: FeltWay) -> Fixes | None:
    """Fixes of one walk; None where there are too few."""
    asked = np.arange(HALF, len(own.time_ns) - HALF, EVERY_STEPS)
    asked = asked[calibration_rows(len(asked), MOST_ASKED)] if len(asked) > MOST_ASKED else asked
    found = floor.matches(number, asked)
    some = [k for k, matches in enumerate(found) if matches]
    if len(some) < FEWEST_FIXES:
        return None
    rows = asked[some]
    means = [_mean(found[k], len(floor.ways)) for k in some]
    shift_m, variance_m2 = np.array([(shift, variance) for shift, variance, _ in means]).T
    course = own.course[rows]
    return Fixes(
        time_ns=own.time_ns[rows],
        position=own.place[rows] + shift_m[:, None] * course,
        path=own.place[rows],
        way_m=own.way_m[rows],
        path_m=own.sigma_m[rows],
        label_m=np.array([label_m for *_, label_m in means]),
        unit_m=np.sqrt(variance_m2),
        course=course,
    )


def _mean(matches: list[Match], walks: int) -> tuple[float, float, FloatArray]:
    """Mean shift of matches of one place, the variance to expect of matching, and what labels of each walk (w,) add.

    Variances are not averaged: the path felt between two places is the same for all.
    """
    walk, shift_m, variance_m2, sigma_m = (np.array(column) for column in zip(*matches, strict=True))
    weight = 1 / (variance_m2 + sigma_m**2)
    weight /= weight.sum()
    label_m = np.zeros(walks)
    label_m[walk] = weight * sigma_m
    return float(weight @ shift_m), float(weight @ variance_m2), label_m


def _ties(fixes: Fixes, covariance: FloatArray) -> PlaceTies | None:
    """Fixes along their courses with a covariance (n, n); None where they promise little."""
    if fixes.course is None or promised(fixes, covariance) < LEAST_PROMISE:
        return None
    rows = calibration_rows(len(fixes), MOST_TIES) if len(fixes) > MOST_TIES else np.arange(len(fixes))
    along, across = _columns(fixes.course[rows]), _columns(fixes.course[rows][:, ::-1] * (-1, 1))
    return PlaceTies(
        time_ns=fixes.time_ns[rows],
        position_bcs=fixes.position[rows],
        covariance_m2=along @ covariance[np.ix_(rows, rows)] @ along.T + ACROSS_M**2 * across @ across.T,
    )


def _columns(direction: FloatArray) -> FloatArray:
    """(2n, n) that turn a number along each direction (n, 2) into x and y."""
    return np.asarray((np.eye(len(direction))[:, None] * direction[..., None]).reshape(-1, len(direction)))
