"""Where other walks' radio scans say that a walk was.

A scan was taken where scans like it were taken in other walks: at the mean of the places of the nearest in signal space
(Bahl and Padmanabhan 2000), the more alike the more it counts. Nothing is fitted to one walk: scans of all walks lie in
one index, and those of the walk itself are passed over. How far such fixes are off is estimated from all walks at once
(:mod:`~vislam2tag.walk_ties.fix_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.positioning.nearest_scans import NearestScans
from vislam2tag.positioning.places import calibration_rows
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.walk_ties.fix_errors import Fixes, match_errors, promised
from vislam2tag.walk_ties.heard_floor import LEAST_AWAY, HeardFloor, scan_weights
from vislam2tag.walk_ties.traces import WalkTrace

SCAN_M = 1.0
"""How near scans place one another were their labels true: labels better than that count little more."""
GAP_M = 3.0
"""Where no other walk came nearer than this, none can say that a walk was there."""
SPREAD_SHARE, AWAY_M2, LEAST_M2 = 0.25, 0.4, 0.01
"""What a fix's variance is expected to follow, up to a factor that is estimated: this share of the variance of places
learned from, so much where the nearest scan is as far as usual, the squared distance from other walks, and a little."""
DOUBTED = 4.0
"""By so much the variance is greater: what walks have in common besides landmarks and radio is not told
(docs/results/walk-ties.md)."""
LEAST_PROMISE = 0.05
"""Ties that lower the stated sigma of a walk's path by a smaller share are left out: as often as not they harm."""
FEWEST_FIXES, MOST_ASKED, MOST_TIES = 5, 256, 64
"""Scans of a walk that are fewer tie nothing; most of a walk that are asked, and most that it is told: neighbouring
fixes are averaged."""


def radio_ties(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[PlaceTies | None]:
    """Return for each walk of a floor where the others' scans put it; None where they tell nothing that helps.

    ``scans`` of each walk have times (``time_ns``, boot clock), and the phones that took them where they are known.
    """
    fixes = walk_fixes(traces, scans)
    told = [one for one in fixes if one is not None]
    if not told:
        return [None] * len(fixes)
    radio = match_errors(told)
    return [None if one is None else _ties(one, DOUBTED * one.covariance(radio)) for one in fixes]


def walk_fixes(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[Fixes | None]:
    """Put each walk's scans where the others took scans like them; None where these are too few."""
    if sum(trace is not None for trace in traces) < 2:
        return [None] * len(traces)
    floor = HeardFloor.of(traces, scans)
    asked = [_ask(floor, number) for number in range(len(traces))]
    away = [one.near.away[:, 0] for one in asked if one is not None]
    usual_away = float(np.median(np.concatenate(away))) if away else 1.0
    return [None if one is None else _fixes(floor, one, usual_away) for one in asked]


class _Asked(NamedTuple):
    """Scans ``rows`` (q,) of a walk, those of other walks that are ``near``, and how far the others kept away (q,)."""

    rows: IntArray
    near: NearestScans
    gap_m: FloatArray


def _ask(floor: HeardFloor, number: int) -> _Asked | None:
    """Look for scans like those of a walk where others were; None where there are too few."""
    rows, others = np.flatnonzero(floor.walk == number), floor.learned[floor.walk[floor.learned] != number]
    rows = rows[calibration_rows(len(rows), MOST_ASKED)]
    if not len(rows) or not len(others):
        return None
    which, away = floor.nearest(rows)
    gap_m = np.asarray(KDTree(floor.place[others]).query(floor.place[rows])[0])
    known = np.flatnonzero((away[:, 0] < 1) & (gap_m < GAP_M))
    if len(known) < FEWEST_FIXES:
        return None
    return _Asked(rows[known], NearestScans(which[known], away[known]), gap_m[known])


def _fixes(floor: HeardFloor, asked: _Asked, usual_away: float) -> Fixes:
    """Place scans at the mean of the places of those like them."""
    rows, (which, away), gap_m = asked
    place, sigma_m = floor.place[which], floor.sigma_m[which]
    weight = scan_weights(away) / (SCAN_M**2 + sigma_m**2)
    weight /= weight.sum(axis=1, keepdims=True)
    position = (weight[..., None] * place).sum(axis=1)
    spread_m2 = (weight * ((place - position[:, None]) ** 2).sum(axis=2)).sum(axis=1) / 2
    unlike_m2 = AWAY_M2 * (np.maximum(away[:, 0], LEAST_AWAY) / max(usual_away, LEAST_AWAY)) ** 2
    return Fixes(
        time_ns=floor.scans.time_ns[rows],
        position=position,
        path=floor.place[rows],
        way_m=floor.way_m[rows],
        path_m=floor.sigma_m[rows],
        label_m=(weight * sigma_m).sum(axis=1),
        unit_m=np.sqrt(SPREAD_SHARE * spread_m2 + unlike_m2 + gap_m**2 + LEAST_M2),
    )


def _ties(fixes: Fixes, covariance: FloatArray) -> PlaceTies | None:
    """Fixes with a covariance (n, n) of each axis; None where they promise little.

    What is averaged where there are many is how far the path is off.
    """
    if promised(fixes, covariance) < LEAST_PROMISE:
        return None
    group = np.arange(len(fixes)) * min(MOST_TIES, len(fixes)) // len(fixes)
    mean = (group == np.arange(group[-1] + 1)[:, None]).astype(np.float64)
    mean /= mean.sum(axis=1, keepdims=True)
    middle = np.flatnonzero(np.diff(group, prepend=-1)) + np.bincount(group) // 2
    return PlaceTies(
        time_ns=fixes.time_ns[middle],
        position_bcs=fixes.path[middle] + mean @ (fixes.position - fixes.path),
        covariance_m2=np.kron(mean @ covariance @ mean.T, np.eye(2)),
    )
