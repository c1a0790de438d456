"""Radio scans of walks through one hall tell where another walk was, and how well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.walk_ties import Fixes, MatchErrors, match_errors, promised, radio_ties, walk_fixes
from vislam2tag.positioning.walk_traces import WalkTrace

SENDERS = np.array([(-5.0, -5.0), (25.0, -5.0), (10.0, 5.0), (-5.0, 15.0), (25.0, 15.0)])


def route(rng: np.random.Generator) -> FloatArray:
    """Up and down a hall of 20 m by 8 m, three metres apart, a little aside of others' ways: (121, 2)."""
    along = np.concatenate([np.linspace(0, 20, 41), np.linspace(20, 0, 41)[1:], np.linspace(0, 20, 41)[1:]])
    aside = np.repeat([0.0, 4.0, 8.0], [41, 40, 40])
    return np.column_stack((along, aside + rng.normal(0, 0.3)))


def walked(place: FloatArray, sigma_m: float) -> WalkTrace:
    """The trace of a walk a second for each half metre."""
    count = len(place)
    covariance = np.tile(np.eye(2) * sigma_m**2, (count, 1, 1))
    whole = np.ones(count, dtype=np.bool_)
    return WalkTrace(np.arange(count) * 10**9, place, covariance, np.arange(0, count / 2, 0.5), whole)


def heard(place: FloatArray, rng: np.random.Generator, louder_db: float = 0.0) -> RadioScans:
    """Scans every 2 s by path loss; a phone that hears louder is another one."""
    rows = np.arange(0, len(place), 2)
    away = np.linalg.norm(place[rows, None] - SENDERS, axis=2)
    level = -40 - 30 * np.log10(away) + louder_db + rng.normal(0, 1, away.shape)
    scan, sender = np.indices(level.shape).reshape(2, -1)
    names = np.array([f"ap{number}" for number in range(len(SENDERS))])
    phone = np.full(len(rows), f"{louder_db:+.0f} dB")
    return scans_from_readings(scan, names[sender], level.ravel(), len(rows), time_ns=rows * 10**9, device=phone)


def hall(walks: int, louder_db: float = 0.0) -> tuple[list[FloatArray], list[WalkTrace | None], list[RadioScans]]:
    """True ways of some walks, their traces (as they are) and scans; the first phone hears louder."""
    rng = np.random.default_rng(3)
    ways = [route(rng) for _ in range(walks)]
    scans = [heard(way, rng, louder_db * (number == 0)) for number, way in enumerate(ways)]
    return ways, [walked(way, 0.1) for way in ways], scans


def test_others_tell_a_walk_that_lies_askew() -> None:
    ways, traces, scans = hall(6)
    traces[0] = walked(ways[0] + (1.5, -1.0), 1.5)
    ties = radio_ties(traces, scans)
    told = ties[0]
    assert told is not None
    off = told.position_bcs - ways[0][(told.time_ns // 10**9)]
    assert np.linalg.norm(off.mean(axis=0)) < 0.6  # of 1.8 m
    variance = np.diag(told.covariance_m2)[::2]
    assert 0.05 < np.mean((off**2).sum(axis=1) / (2 * variance)) < 1  # doubted: larger than errors are
    assert np.linalg.eigvalsh(told.covariance_m2)[0] > 0
    assert ties[1] is None  # knows its way better than radio can tell


def test_a_phone_that_hears_louder_is_told_as_well() -> None:
    def off_m(louder_db: float) -> float:
        _, traces, scans = hall(6, louder_db)
        fixes = walk_fixes(traces, scans)[0]
        assert fixes is not None
        return float(np.linalg.norm(fixes.position - fixes.path, axis=1).mean())

    assert off_m(8.0) < 1.1 * off_m(0.0)


def test_nobody_is_told_where_nobody_else_was() -> None:
    ways, traces, scans = hall(3)
    assert radio_ties(traces[:1], scans[:1]) == [None]
    assert radio_ties([None, traces[1]], scans[:2]) == [None, None]
    traces[0] = walked(ways[0] + (0.0, 40.0), 1.5)
    assert walk_fixes(traces, scans)[0] is None


def test_many_fixes_are_averaged_with_their_errors() -> None:
    ways, traces, scans = hall(4)
    slow = np.repeat(ways[0], 8, axis=0)
    traces[0], scans[0] = walked(slow, 1.5), heard(slow, np.random.default_rng(5))
    told = radio_ties(traces, scans)[0]
    assert told is not None
    assert len(told.time_ns) == 64
    assert np.all(np.diff(told.time_ns) > 0)


def test_the_size_of_errors_is_found() -> None:
    rng = np.random.default_rng(7)
    way_m = np.arange(0, 120, 3.0)
    nothing, ones = np.zeros(len(way_m)), np.ones(len(way_m))
    path = np.column_stack((way_m, nothing))
    blank = Fixes(way_m.astype(np.int64), path, path, way_m, 0.5 * ones, 0.2 * ones, ones)
    true = MatchErrors(1.39, 0.6, 5.0)
    root = np.linalg.cholesky(blank.covariance(true) + blank.path_covariance())
    fixes = [replace(blank, position=path + root @ rng.normal(size=path.shape)) for _ in range(12)]
    found = match_errors(fixes)
    assert 1.1 < found.size < 1.7
    assert 0.4 <= found.share <= 0.8
    assert found.reach_m in {2.0, 5.0, 10.0}
    assert promised(blank, blank.covariance(found)) > promised(blank, 4 * blank.covariance(found)) > 0
