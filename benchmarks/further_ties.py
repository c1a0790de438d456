"""What further ties between walks could gain at most: radio likeness, magnetic sequences, corridors walked by many.

Generated floors with 20 landmarks and 8 walks of 3 minutes, of which 3 landmarks are surveyed, mapped alone and with
what the walks tell one another of the sheets (``process --together``). The errors of these paths are taken for a normal
process with the stated sigma (scaled to what they are really off by) and the correlation along the walk that they have,
and are updated, all walks jointly, with

* radio: where a model that has learned the other walks' scans, at their true places, puts each scan; the noise is what
  it is really off by, and correlated as its errors are.
* magnetic: where two walks come within half a metre in the same direction, once every 5 m, how far one lies ahead of
  the other, to 0.3 m.
* corridors: where two walks come within 1.5 m along one line, once every 5 m, that they have no distance across it;
  the noise is what they really have.

Places where walks meet are known from the truth, each level of noise from the errors themselves, and walks' errors are
taken for independent: what is gained is more than any such tie could.

    python benchmarks/further_ties.py --seeds 11 12
    python benchmarks/further_ties.py --seeds 13 14 --severity severe [--labelled]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import polars as pl
from data_sets import Walk, walks_of
from scipy.linalg import block_diag
from together import only, together

from landmark_survey import SETTINGS, chosen, generated_floor, site_of, spread
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.dataset.model import Storey
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import scans_from_readings
from vislam2tag.sessions.registry import open_survey, read_session

STEP_S = 2.0
"""Paths are taken at moments so far apart."""
MAGNETIC_M, MAGNETIC_SIGMA_M, CORRIDOR_M = 0.5, 0.3, 1.5
APART_M = 5.0
"""Two walks are tied once in so much of the way."""
SAME_RAD, LINE_RAD = 0.5, 0.3
"""Directions of walking that are the same, or along one line, differ by less."""
LAGS = 30
"""Correlation is looked at over so many steps."""


@dataclass(frozen=True)
class WalkedPath:
    """A walk's mapped path at ``n`` moments: true places (n, 2), direction (n,), rad, errors (n, 2) and sigma (n,)."""

    time_s: FloatArray
    true: FloatArray
    course_rad: FloatArray
    error: FloatArray
    sigma_m: FloatArray

    def off(self, time_s: FloatArray) -> FloatArray:
        """Errors (k, 2) at some moments; NaN where the path does not lead."""
        axes = [np.interp(time_s, self.time_s, axis, left=np.nan, right=np.nan) for axis in self.error.T]
        return np.column_stack(axes)


@dataclass(frozen=True)
class Fixes:
    """Where a radio map puts the scans of a walk: moments (k,), seconds, and errors (k, 2), metres."""

    time_s: FloatArray
    error: FloatArray


def main() -> None:
    """Print for each choice of surveyed landmarks what each tie takes off the mean error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--severity", default="default")
    parser.add_argument("--surveyed", type=int, default=3)
    parser.add_argument("--model", default="local-kriging")
    parser.add_argument("--labelled", action="store_true", help="learn scans at their walks' labels, not at the truth")
    options = parser.parse_args()
    print(
        "| surveyed | mapped | mean | a radio fix | radio | magnetic | corridors | all three |\n" + "| --- " * 8 + "|"
    )
    floors = [floor_of(seed, options.severity) for seed in options.seeds]
    for name, choose in (("spread", spread), ("at random", lambda marks, count: chosen(marks, count, 0))):
        ways = [both_ways(walks, choose(site_of(walks).landmarks, options.surveyed)) for walks, _ in floors]
        for way, paths in zip(("alone", "together"), zip(*ways, strict=True), strict=True):
            sums, off_m = np.zeros(5), []
            for (walks, heard), (alone, _), found in zip(floors, ways, paths, strict=True):
                rows = [i for i, path in enumerate(alone) if path is not None and found[i] is not None]
                radio = list(radio_fixes(walks, heard, options.model, found if options.labelled else None))
                off_m.append(np.concatenate([np.hypot(*radio[i].error.T) for i in rows]).mean())
                sums += gains([path for i in rows if (path := found[i]) is not None], [radio[i] for i in rows])
            left = " | ".join(f"{1 - one / sums[0]:.1%}" for one in sums[1:])
            figures = f"{sums[0] / len(floors):.3f} m | {np.mean(off_m):.2f} m | {left}"
            print(f"| {options.surveyed}, {name} | {way} | {figures} |", flush=True)


def floor_of(seed: int, severity: str) -> tuple[list[Walk], list[pl.DataFrame]]:
    """The walks of a floor, and what each heard."""
    with generated_floor(seed, severity) as root:
        walks = list(walks_of(root, truth_at_frames=True))
        heard = [read_session(ref).tables["wifi"].filter(~pl.col("repeated")) for ref in open_survey(root).sessions]
    return walks, heard


def both_ways(walks: list[Walk], surveyed: IntArray) -> tuple[list[WalkedPath | None], list[WalkedPath | None]]:
    """Map each walk alone, and with what the others tell of the sheets; None where it cannot be."""
    site = site_of(walks)
    alone = [only(site.landmarks, surveyed)] * len(walks)
    return mapped(walks, alone), mapped(walks, together(site, surveyed))


def radio_fixes(
    walks: list[Walk], heard: list[pl.DataFrame], model: str, paths: list[WalkedPath | None] | None
) -> Iterator[Fixes]:
    """Ask of each walk a model that has learned the others: at their true places, or where paths lead them."""
    first = np.cumsum([0, *(table["scan"].n_unique() for table in heard)])
    rows, names, levels, times = [], [], [], []
    for start, table in zip(first, heard, strict=False):
        number = np.unique(table["scan"].to_numpy(), return_inverse=True)[1]
        rows.append(start + number)
        names.append(table["bssid"].to_numpy().astype(np.str_))
        levels.append(table["rssi_dbm"].to_numpy().astype(np.float64))
        times.append(np.bincount(number, table["time_ns"].to_numpy() * 1e-9) / np.bincount(number))
    walk = np.repeat(np.arange(len(walks)), np.diff(first))
    session = np.array([one.name for one in walks])[walk]
    device = np.array([one.name.split(".")[1] for one in walks])[walk]
    scans = scans_from_readings(
        np.concatenate(rows),
        np.concatenate(names),
        np.concatenate(levels),
        int(first[-1]),
        session=session,
        device=device,
    )
    true = np.concatenate([true_at(one, time) for one, time in zip(walks, times, strict=True)])
    off = [np.zeros((len(time), 2)) for time in times]
    if paths is not None:
        off = [
            np.full_like(zero, np.nan) if path is None else path.off(time)
            for zero, path, time in zip(off, paths, times, strict=True)
        ]
    unknown, storey = np.full(len(true), np.nan), np.zeros(len(true), dtype=np.int64)
    places = ScanPlaces((Storey("", 0),), storey, true + np.concatenate(off), unknown, np.full(len(true), 0.15))
    for one, time_s in enumerate(times):
        own = walk == one
        found = model_named(model).fit(scans[~own], places[~own]).predict(scans[own]).xy
        known = np.isfinite(found).all(axis=1)
        yield Fixes(time_s[known], (found - true[own])[known])


def true_at(walk: Walk, time_s: FloatArray) -> FloatArray:
    """True places (n, 2) at some moments."""
    assert walk.truth is not None
    return np.column_stack([np.interp(time_s, walk.truth.time_ns * 1e-9, axis) for axis in walk.truth.position_bcs.T])


def mapped(walks: list[Walk], landmarks: list[Landmarks]) -> list[WalkedPath | None]:
    """Map each walk; None where it cannot be."""
    paths: list[WalkedPath | None] = []
    for walk, known in zip(walks, landmarks, strict=True):
        found = strategy_named("smoother", SETTINGS.mapping).map(walk.camera, walk.log, known)
        rows = np.flatnonzero(np.isfinite(found.sigma_m))
        if len(rows) < 2:
            paths.append(None)
            continue
        known_s = found.time_ns[rows] * 1e-9
        time_s = np.arange(known_s[0], known_s[-1], STEP_S)
        at = partial(np.interp, time_s, known_s)
        true = true_at(walk, time_s)
        ahead = true_at(walk, time_s + 0.5) - true_at(walk, time_s - 0.5)
        place = np.column_stack([at(axis) for axis in found.position_bcs[rows, :2].T])
        paths.append(
            WalkedPath(time_s, true, np.arctan2(*ahead.T[::-1]), place - true, np.asarray(at(found.sigma_m[rows])))
        )
    return paths


def gains(paths: list[WalkedPath], radio: list[Fixes]) -> FloatArray:
    """Mean error of the paths of a floor as they are, then with each tie, and with all."""
    error = np.concatenate([path.error for path in paths])
    covariance = prior(paths)
    ties = [radio_ties(paths, radio), walk_ties(paths, magnetic=True), walk_ties(paths, magnetic=False)]
    ties.append(joined_ties(ties))
    left = [updated(error, covariance, tie) for tie in ties]
    return np.array([np.hypot(*one.T).mean() for one in (error, *left)])


def prior(paths: list[WalkedPath]) -> FloatArray:
    """Covariance (2n, 2n) of all paths' errors: stated sigmas, scaled to what they are, correlated as they are."""
    units = [path.error / path.sigma_m[:, None] for path in paths]
    scale = float(np.sqrt(np.mean(np.concatenate(units) ** 2)))
    reach = correlation_steps(units)
    blocks = [scale**2 * np.outer(one.sigma_m, one.sigma_m) * fading(len(one.time_s), reach) for one in paths]
    return np.asarray(np.kron(block_diag(*blocks), np.eye(2)), dtype=np.float64)


def fading(count: int, reach: float) -> FloatArray:
    """Correlation (n, n) of rows that is 1/e so many steps apart."""
    step = np.arange(count)
    return np.asarray(np.exp(-np.abs(step[:, None] - step) / reach))


def correlation_steps(series: list[FloatArray]) -> float:
    """After how many rows errors (n, 2) are correlated by 1/e, from all lags at which they are correlated."""
    whole = sum(float(np.sum(one**2)) / one.size for one in series)
    by_lag = [
        sum(float(np.mean(one[lag:] * one[:-lag])) for one in series if len(one) > lag) / whole
        for lag in range(1, LAGS)
    ]
    return float(np.clip(sum(max(one, 0.0) for one in by_lag) + 0.5, 0.5, LAGS))


Ties = tuple[FloatArray, FloatArray, FloatArray]
"""Of ``k`` observations: design (k, 2n) of the paths' errors, what is observed (k,), and its covariance (k, k)."""


def radio_ties(paths: list[WalkedPath], radio: list[Fixes]) -> Ties:
    """Each fix says, with the error that it has, where the path is."""
    count = sum(len(path.time_s) for path in paths)
    design, seen, noise, at = [], [], [], 0
    variance = np.mean([np.mean(fixes.error**2) for fixes in radio])
    reach = correlation_steps([fixes.error for fixes in radio])
    for path, fixes in zip(paths, radio, strict=True):
        inside = (fixes.time_s >= path.time_s[0]) & (fixes.time_s <= path.time_s[-1])
        step = np.rint((fixes.time_s[inside] - path.time_s[0]) / STEP_S).astype(int).clip(0, len(path.time_s) - 1)
        k = len(step)
        rows = np.zeros((2 * k, 2 * count))
        rows[np.arange(2 * k), (2 * (at + step[:, None]) + (0, 1)).ravel()] = 1
        design.append(rows)
        seen.append((path.error[step] - fixes.error[inside]).ravel())
        noise.append(np.kron(variance * fading(k, reach), np.eye(2)))
        at += len(path.time_s)
    return np.concatenate(design), np.concatenate(seen), block_diag(*noise)


def walk_ties(paths: list[WalkedPath], *, magnetic: bool) -> Ties:
    """Where two walks meet: how far one lies ahead of the other, or that neither lies aside of the other."""
    first = np.cumsum([0, *(len(path.time_s) for path in paths)])
    rng = np.random.default_rng(0)
    rows: list[FloatArray] = []
    seen: list[float] = []
    apart: list[float] = []
    for a, one in enumerate(paths):
        for b, other in enumerate(paths[:a]):
            for i, j in meetings(one, other, magnetic=magnetic):
                course = one.course_rad[i]
                along = np.array([np.cos(course), np.sin(course)] if magnetic else [-np.sin(course), np.cos(course)])
                row = np.zeros(2 * first[-1])
                row[2 * (first[a] + i) : 2 * (first[a] + i) + 2] = along
                row[2 * (first[b] + j) : 2 * (first[b] + j) + 2] = -along
                off_m = rng.normal(0, MAGNETIC_SIGMA_M) if magnetic else along @ (one.true[i] - other.true[j])
                rows.append(row)
                seen.append(float(along @ (one.error[i] - other.error[j]) + off_m))
                apart.append(off_m)
    sigma_m = MAGNETIC_SIGMA_M if magnetic else float(np.sqrt(np.mean(np.square(apart)))) if apart else 1.0
    return np.array(rows).reshape(-1, 2 * first[-1]), np.array(seen), sigma_m**2 * np.eye(len(rows))


def meetings(one: WalkedPath, other: WalkedPath, *, magnetic: bool) -> Iterator[tuple[int, int]]:
    """Moments (i, j) at which two walks are near and in one direction, or on one line, once every so many metres."""
    away = np.hypot(*(one.true[:, None] - other.true).transpose(2, 0, 1))
    turn = np.abs(np.angle(np.exp(1j * (one.course_rad[:, None] - other.course_rad))))
    fits = turn < SAME_RAD if magnetic else np.minimum(turn, np.pi - turn) < LINE_RAD
    away = np.where(fits, away, np.inf)
    last = None
    for i, j in enumerate(away.argmin(axis=1).tolist()):
        if away[i, j] > (MAGNETIC_M if magnetic else CORRIDOR_M):
            continue
        if last is None or np.hypot(*(one.true[i] - last)) > APART_M:
            last = one.true[i]
            yield i, j


def joined_ties(ties: list[Ties]) -> Ties:
    """All of them."""
    design, seen, noise = zip(*ties, strict=True)
    return np.concatenate(design), np.concatenate(seen), block_diag(*noise)


def updated(error: FloatArray, covariance: FloatArray, ties: Ties) -> FloatArray:
    """Errors (n, 2) that are left once the ties have been used."""
    design, seen, noise = ties
    spread_of = covariance @ design.T
    gain = np.linalg.solve(design @ spread_of + noise, spread_of.T).T
    return error - (gain @ seen).reshape(-1, 2)


if __name__ == "__main__":
    main()
