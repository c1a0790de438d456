"""Magnetic fields that walks felt in one corridor tell how far along it another walk was, and how well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.walk_ties.felt_ways import STEP_M, FeltField, FeltWay
from vislam2tag.walk_ties.field_matching import FeltFloor
from vislam2tag.walk_ties.fix_errors import Fixes, MatchErrors, match_errors, promised
from vislam2tag.walk_ties.magnetic import ACROSS_M, DOUBTED, TRIED, magnetic_ties, walk_fixes
from vislam2tag.walk_ties.traces import WalkTrace

LENGTH_M = 80.0
SPEED_M_S = 1.25
RATE_HZ = 20


def field_ut(x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """(n, 2) the vertical and horizontal part of a field that varies over some metres."""
    waves = np.random.default_rng(7).normal(0, 0.6, (2, 12, 2))
    phase = np.random.default_rng(8).uniform(0, 2 * np.pi, (2, 12))
    angle = np.einsum("fkd,dn->fkn", waves, np.array([x_m, y_m])) + phase[..., None]
    return np.asarray(3 * np.sqrt(2 / 12) * np.cos(angle).sum(axis=1).T + (-44.0, 20.0))


def walk(
    number: int, off_m: float = 0.0, sigma_m: float = 0.2, *, back: bool = False, iron_ut: float = 0.0
) -> tuple[WalkTrace, FeltField]:
    """A walk up a corridor (or back), a little aside, whose trace is off along it by so much; and what it felt."""
    rng = np.random.default_rng(number)
    count = int(LENGTH_M / SPEED_M_S * RATE_HZ)
    x_m = np.linspace(0, LENGTH_M, count)[:: -1 if back else 1]
    aside_m = rng.normal(0, 0.1)
    felt = field_ut(x_m, np.full(count, aside_m)) + iron_ut + rng.normal(0, 0.4, (count, 2))
    time_ns = (np.arange(count) * 1e9 / RATE_HZ).astype(np.int64)
    rows = np.arange(0, count, int(RATE_HZ / SPEED_M_S))
    place = np.column_stack((x_m[rows] + off_m, np.full(len(rows), aside_m)))
    covariance = np.tile(np.eye(2) * sigma_m**2, (len(rows), 1, 1))
    way_m = np.abs(x_m[rows] - x_m[0])
    return WalkTrace(time_ns[rows], place, covariance, way_m, np.ones(len(rows), np.bool_)), FeltField(time_ns, felt)


def corridor(off_m: float = 1.2, sigma_m: float = 1.0) -> list[FeltWay | None]:
    """Five walks, two of them back, of which the first is off."""
    walks = [walk(0, off_m, sigma_m), *(walk(n, back=n > 2, iron_ut=3.0 * n) for n in range(1, 5))]
    return [FeltWay.of(*one) for one in walks]


def short(way: FeltWay | None) -> FeltWay:
    """The first half of a way."""
    assert way is not None
    half = np.arange(len(way.place) // 2)
    others = (column[half] for column in (way.place, way.course, way.sigma_m, way.way_m, way.field_ut))
    return FeltWay(way.time_ns[half], *others)


def test_others_tell_a_walk_how_far_along_the_corridor_it_was() -> None:
    ways = corridor()
    told = magnetic_ties(ways)
    first = told[0]
    assert ways[0] is not None
    assert first is not None
    true_m = first.time_ns * 1e-9 * SPEED_M_S
    assert np.abs(first.position_bcs[:, 0] - true_m).max() < 0.3  # of 1.2 m
    variance = np.diag(first.covariance_m2).reshape(-1, 2)
    assert np.allclose(variance[:, 1], ACROSS_M**2)
    assert (variance[:, 0] < DOUBTED).all()
    assert np.linalg.eigvalsh(first.covariance_m2)[0] > 0
    assert first.least_sigma_m() == pytest.approx(np.sqrt(variance[:, 0]))
    assert all(one is None for one in told[1:])  # know their way better than the others can tell


def test_head_on_windows_are_turned_round() -> None:
    ways = [FeltWay.of(*walk(0, 0.9, 1.0)), FeltWay.of(*walk(1, back=True))]
    fixes = walk_fixes(ways)[0]
    assert fixes is not None
    assert fixes.off_m[:, 0] == pytest.approx(-0.9, abs=0.3)
    assert fixes.label_m[:, 0] == pytest.approx(0.0)
    assert fixes.label_m[:, 1] == pytest.approx(0.2, abs=1e-6)


def test_nothing_is_told_of_few_fixes_or_by_one_walk_alone() -> None:
    ways = corridor()
    assert magnetic_ties(ways[:1]) == [None]
    assert magnetic_ties([None, None]) == [None, None]
    assert magnetic_ties([ways[0], None]) == [None, None]
    assert magnetic_ties([]) == []
    assert magnetic_ties([ways[0], short(ways[1])]) == [None, None]


def test_a_field_that_hardly_changes_or_that_others_did_not_feel_says_nothing() -> None:
    first, second = corridor()[:2]
    assert first is not None
    assert second is not None
    rows = np.arange(20, 200, 20)
    assert any(FeltFloor.of([first, second]).matches(0, rows))
    flat = replace(first, field_ut=np.full_like(first.field_ut, 40.0))
    assert not any(FeltFloor.of([flat, second]).matches(0, rows))
    other = replace(second, field_ut=np.random.default_rng(0).permutation(second.field_ut))
    assert not any(FeltFloor.of([first, other]).matches(0, rows))
    elsewhere = replace(second, place=second.place + np.array((0.0, 20.0)))
    assert not any(FeltFloor.of([first, elsewhere]).matches(0, rows))


def test_the_field_is_averaged_in_steps_of_the_way_and_not_known_in_holes() -> None:
    trace, felt = walk(1)
    holed = replace(trace, whole=np.arange(len(trace.whole)) != 10)
    way = FeltWay.of(holed, felt)
    assert len(way.place) == pytest.approx(LENGTH_M / STEP_M, abs=5)
    assert way.course == pytest.approx(np.tile((1.0, 0.0), (len(way.course), 1)), abs=1e-6)
    hole = np.flatnonzero(np.isnan(way.field_ut[:, 0])) * STEP_M
    assert len(hole)
    assert ((hole > trace.way_m[9] - STEP_M) & (hole < trace.way_m[10] + STEP_M)).all()
    known = np.isfinite(way.field_ut).all(axis=1)
    expected = field_ut(way.place[known, 0], way.place[known, 1])
    assert np.abs(way.field_ut[known] - expected).mean() < 0.3


def test_who_stands_feels_one_step() -> None:
    trace, felt = walk(1)
    later = np.where(np.arange(len(trace.time_ns)) > 20, 60 * 10**9, 0)
    stood = replace(trace, time_ns=trace.time_ns + later, whole=np.ones(len(later), np.bool_))
    moved = np.where(felt.time_ns > trace.time_ns[20], 60 * 10**9, 0)
    way = FeltWay.of(stood, FeltField(felt.time_ns + moved, felt.field_ut))
    assert len(way.place) == len(FeltWay.of(trace, felt).place)


def test_size_and_delay_of_errors_along_the_course_are_found() -> None:
    rng = np.random.default_rng(5)
    way_m = np.arange(0.0, 120.0, 5.0)
    count = len(way_m)
    angle = np.where(np.arange(count) < 12, 0.3, 0.3 + np.pi)  # out and back
    course = np.column_stack((np.cos(angle), np.sin(angle)))
    path = np.cumsum(5.0 * course, axis=0)
    ones = np.ones(count)
    blank = Fixes(way_m.astype(np.int64), path, path, way_m, 0.3 * ones, 0.1 * ones[:, None], 0.2 * ones, course)
    true = MatchErrors(4.0, 0.95, np.inf)
    root = np.linalg.cholesky(blank.covariance(true) + blank.path_covariance())
    fixes = [replace(blank, position=path + (root @ rng.normal(size=count))[:, None] * course) for _ in range(16)]
    found = match_errors(fixes, 4.0, TRIED)
    assert 2.5 < found.size < 6.0
    assert found.share >= 0.8
    assert np.isinf(found.reach_m)
    halved = promised(blank, 1e-9 * np.eye(count))
    assert halved == pytest.approx(1 - np.sqrt(0.5), abs=0.02)  # one axis of two is known, but where the way turns
    assert promised(blank, 1e4 * np.eye(count)) == pytest.approx(0.0, abs=1e-3)


def sensors(values: dict[str, FloatArray]) -> pl.DataFrame:
    """A ``sensors`` table of some types' values (n, k), 50 a second."""
    tables = []
    for name, each in values.items():
        padded = np.zeros((len(each), 6))
        padded[:, : each.shape[1]] = each
        columns = {f"v{i + 1}": column for i, column in enumerate(padded.T)}
        time_ns = (np.arange(len(each)) * 20_000_000).astype(np.int64)
        tables.append(pl.DataFrame({"sensor": [name] * len(each), "time_ns": time_ns, "repeated": False, **columns}))
    return pl.concat(tables)


def test_gravity_or_a_rotation_says_what_is_vertical() -> None:
    count = 200
    field = np.tile((20.0, 44.0, 3.0), (count, 1))  # of a phone that stands upright, y up
    force = np.tile((0.0, 9.8, 0.0), (count, 1))
    upright = np.tile((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)), (count, 1))  # about x by a quarter turn
    for table in (
        sensors({"MAG": field, "ACC": force}),
        sensors({"MAG": field, "GAME_ROT": upright}),
        sensors({"MAG": field, "ROT": -upright}),
        sensors({"MAG_UN": np.column_stack((field + 7, np.full((count, 3), 7.0))), "ACC": force}),
    ):
        felt = FeltField.of(table)
        assert felt is not None
        assert felt.field_ut[60:-60] == pytest.approx(np.tile((44.0, np.hypot(20, 3)), (count - 120, 1)))
    assert FeltField.of(sensors({"MAG": field})) is None
    assert FeltField.of(sensors({"ACC": force})) is None
