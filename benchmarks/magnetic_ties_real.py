"""What walks gain in real buildings by where others felt the same magnetic field, with a tracker whose drift is drawn.

Walks of the Indoor Location Competition 2.0 through all their taps, off as ``radio_ties_real.py`` draws it. First what
the field itself says, were the walks where their taps put them: how far ahead along its course each walk is put by each
other, by those that went the same way and by those that it met head-on. A walk that taps late lies behind its field:
who meets it then lies ahead, and who went along does not, so that shifts of one sign, head-on, are habits of tapping.

    python benchmarks/magnetic_ties_real.py ilc20                folder of the unpacked archives of ../shared/data
    python benchmarks/magnetic_ties_real.py ilc20 --fewest 1     fixes are told however few there are
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from magnetic_ties import best_known
from radio_ties_real import DRAWS, DRIFTS, RealWalk, at, drift_covariance, ilc20_walk, traced

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.sessions.tables.ilc20_trace import parse_trace
from vislam2tag.walk_ties import magnetic
from vislam2tag.walk_ties.felt_ways import FeltField, FeltWay
from vislam2tag.walk_ties.field_matching import HALF, FeltFloor
from vislam2tag.walk_ties.fix_errors import match_errors

PLACES = ("site1/F1", "site2/F4")
TAP_M = 2.0
"""Walks may be so far off through their taps, per axis, when it is asked what the field itself says."""
EVERY_STEPS = 4
"""So is each walk asked there: once in a metre."""


@dataclass(frozen=True)
class FeltWalk:
    """A real walk, and what it felt."""

    walk: RealWalk
    felt: FeltField


@dataclass(frozen=True)
class Told:
    """Of one drift: mean error (w,) of each walk without and with ties, errors squared in their units of those told,
    and what fixes are off, metres, and squared in the units that are estimated and told.
    """

    before: FloatArray
    after: FloatArray
    inside: FloatArray
    fix_m: FloatArray
    estimated: FloatArray
    stated: FloatArray


def main() -> None:
    """Print what the field says of each pair of walks, and a row for each floor and drift."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ilc20", type=Path)
    parser.add_argument("--fewest", type=int, default=magnetic.FEWEST_OF_FLOOR)
    options = parser.parse_args()
    magnetic.FEWEST_OF_FLOOR = options.fewest
    floors = {place: felt_walks(options.ilc20 / place) for place in PLACES}
    print("| floor | walk | other | places | ahead, same way | ahead, head-on |\n" + "| --- " * 6 + "|")
    for place, walks in floors.items():
        for line in pairs(walks):
            print(f"| {place} | {line} |", flush=True)
    print(
        "\n| floor | walks | drift | mean | told | gain | worse | fix | estimated | told as |\n" + "| --- " * 10 + "|"
    )
    for place, walks in floors.items():
        for drift in DRIFTS:
            print(f"| {place} | {len(walks)} | {drift} | {row(walks, drift)} |", flush=True)


def felt_walks(folder: Path) -> list[FeltWalk]:
    """The walks of a floor that are long enough and felt something."""
    found = []
    for file in sorted((folder / "path_data_files").glob("*.txt")):
        walk, felt = ilc20_walk(file), FeltField.of(parse_trace(file.read_bytes(), file.name).sensors)
        if walk is not None and felt is not None:
            found.append(FeltWalk(walk, felt))
    return found


def pairs(walks: list[FeltWalk]) -> list[str]:
    """How far ahead along the course of one walk another puts it: median and spread of all places, metres."""
    ways = [
        FeltWay.of(traced(one.walk, np.zeros_like(one.walk.place), TAP_M**2 * np.eye(len(one.walk.place))), one.felt)
        for one in walks
    ]
    floor, lines = FeltFloor.of(ways), []
    for number, own in enumerate(ways):
        rows = np.arange(HALF, len(own.time_ns) - HALF, EVERY_STEPS)
        shifts: dict[int, tuple[list[float], list[float]]] = {}
        for step, found in zip(rows.tolist(), floor.matches(number, rows), strict=True):
            for match in found:
                other = ways[match.walk]
                place = own.place[step] + match.shift_m * own.course[step]
                nearest = int(np.hypot(*(other.place - place).T).argmin())
                against = bool(other.course[nearest] @ own.course[step] < 0)
                shifts.setdefault(match.walk, ([], []))[against].append(match.shift_m)
        for walk, (same, head_on) in sorted(shifts.items()):
            if len(same) + len(head_on) >= magnetic.FEWEST_FIXES:
                lines.append(
                    f"{number} | {walk} | {len(same) + len(head_on)} | {spread_of(same)} | {spread_of(head_on)}"
                )
    return lines


def spread_of(shifts_m: list[float]) -> str:
    """Median and standard deviation."""
    return f"{np.median(shifts_m):+.1f} ± {np.std(shifts_m):.1f} m ({len(shifts_m)})" if shifts_m else "-"


def row(walks: list[FeltWalk], drift: float) -> str:
    """Figures of all walks over some draws of the drift."""
    draws = [drawn(walks, drift, draw) for draw in range(DRAWS)]
    before, after, inside, fix_m, estimated, stated = (
        np.concatenate([getattr(one, name) for one in draws]) for name in Told.__dataclass_fields__
    )
    gained = before - after
    share = f"{gained.mean() / before.mean():.1%} ± {100 * gained.std() / np.sqrt(len(gained)) / before.mean():.1f}"
    told = f"{np.mean(gained != 0):.0%}"
    if len(inside):
        told += f", {np.mean(inside < 2.279):.0%} and {np.mean(inside < 5.991):.0%} inside"
    fixes = f"{len(fix_m)}: {fix_m.mean():.2f} m | {estimated.mean():.2f}" if len(fix_m) else "- | -"
    return (
        f"{before.mean():.2f} m | {told} | {share} | {-gained.min():+.2f} m | {fixes} "
        f"| {f'{stated.mean():.2f}' if len(stated) else '-'}"
    )


def drawn(walks: list[FeltWalk], drift: float, draw: int) -> Told:
    """Draw the drift of all walks, let them tell one another where they were, and use it."""
    rng = np.random.default_rng((0, draw))
    covariances = [drift_covariance(one.walk.way_m, drift) for one in walks]
    errors = [np.linalg.cholesky(one) @ rng.normal(size=(len(one), 2)) for one in covariances]
    ways = [
        FeltWay.of(traced(one.walk, *known), one.felt) for one, *known in zip(walks, errors, covariances, strict=True)
    ]
    fixes = magnetic.walk_fixes(ways)
    some = [one for one in fixes if one is not None]
    errors_of = match_errors(some, magnetic.USUAL_SIZE, magnetic.TRIED) if some else None
    before, after, inside, fix_m, estimated, stated = ([np.empty(0)] for _ in range(6))
    ties = magnetic.magnetic_ties(ways)
    for one, error, covariance, fix, told in zip(walks, errors, covariances, fixes, ties, strict=True):
        if fix is not None and fix.course is not None and errors_of is not None:
            along = np.einsum("ni,ni->n", fix.position - at(one.walk, fix.time_ns), fix.course)
            fix_m.append(np.abs(along))
            estimated.append(along**2 / np.diag(fix.covariance(errors_of)))
        left = error
        if told is not None:
            left, variance = updated(one.walk, error, covariance, told)
            inside.append((left**2 / variance).sum(axis=1))
            stated.append(best_known(told.position_bcs - at(one.walk, told.time_ns), told.covariance_m2)[1])
        before.append(np.array([np.hypot(*error.T).mean()]))
        after.append(np.array([np.hypot(*left.T).mean()]))
    return Told(*(np.concatenate(part) for part in (before, after, inside, fix_m, estimated, stated)))


def updated(
    walk: RealWalk, error: FloatArray, covariance: FloatArray, ties: PlaceTies
) -> tuple[FloatArray, FloatArray]:
    """Errors (n, 2) and variances (n, 2) of a walk off by (n, 2) with a covariance (n, n) of each axis, once ties are
    used.
    """
    rows = np.searchsorted(walk.time_ns, ties.time_ns).clip(0, len(error) - 1)
    both, column = np.kron(covariance, np.eye(2)), (2 * rows[:, None] + (0, 1)).ravel()
    gain = np.linalg.solve(both[np.ix_(column, column)] + ties.covariance_m2, both[column]).T
    seen = (ties.position_bcs - at(walk, ties.time_ns)).ravel()
    left = error.ravel() + gain @ (seen - error.ravel()[column])
    return left.reshape(-1, 2), np.diag(both - gain @ both[column]).reshape(-1, 2)


if __name__ == "__main__":
    main()
