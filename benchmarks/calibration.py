"""Coverage of the smoother's stated regions on generated walks of all kinds, real ones, and completed landmarks.

Errors of all points of a row are pooled; "least" and "most" are the fifths of them with the smallest and the largest
stated sigma. Wanted: 60 to 76 % inside 68 %, 90 to 98.5 % inside 95 %, 50 to 86 % inside 68 % in either fifth. With
five walks or more each share has its standard error, in points, by bootstrap over walks.

    python benchmarks/calibration.py                        walks of 12 seeds a row
    python benchmarks/calibration.py --seeds 200 --count 40
    python benchmarks/calibration.py --rows mild "twice better"
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator

import numpy as np
from data_sets import Walk, every_kth, real_walks, with_tracker

from vislam2tag.common.error_statistics import FEWEST_WALKS, draws, multiplicities
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.quality.evaluation.reliability import region_probability
from vislam2tag.settings import Settings

LANDMARKS = 12
ROUNDS = 200
"""Of the bootstrap."""

Rows = dict[str, Callable[[range], Iterable[Walk]]]


def main() -> None:
    """Print one row for each kind of walk."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=300, help="the first")
    parser.add_argument("--count", type=int, default=12, help="how many; two simulated walks each")
    parser.add_argument("--rows", nargs="+", default=[""], help="only rows whose names hold one of these")
    options = parser.parse_args()
    seeds = range(options.seeds, options.seeds + options.count)
    print("| walks | number | mean | inside 68 % | inside 95 % | least | most |")
    print("| --- " * 7 + "|")
    for name, walks in ROWS.items():
        if any(part in name for part in options.rows):
            print(f"| {name} | {row(walks(seeds))} |", flush=True)


def simulated(times: float, severity: str) -> Callable[[range], Iterator[Walk]]:
    """Simulated walks at a severity with a tracker so many times as noisy."""
    return lambda seeds: with_tracker(seeds, times, severity, LANDMARKS)


ROWS: Rows = {
    "simulator, mild": simulated(1.0, "mild"),
    "simulator, default": simulated(1.0, "default"),
    "simulator, severe": simulated(1.0, "severe"),
    "simulator, tracker twice better": simulated(0.5, "default"),
    "simulator, tracker twice worse": simulated(2.0, "default"),
    "real": lambda _: real_walks(),
    "real, every 3rd landmark": lambda _: every_kth(real_walks(), 3),
    "real, every 5th landmark": lambda _: every_kth(real_walks(), 5),
}


def row(walks: Iterable[Walk]) -> str:
    """Map the walks and describe their errors and regions."""
    strategy = strategy_named("smoother", Settings().mapping)
    return cells([points(walk, strategy.map(walk.camera, walk.log, walk.landmarks)) for walk in walks])


def points(walk: Walk, trajectory: Trajectory) -> FloatArray:
    """Of each labelled point (n, 3): error and sigma, metres, and the probability of the region that just holds it."""
    residuals = walk.residuals(trajectory)
    error = np.linalg.norm(residuals.error_m, axis=1)
    sigma = np.sqrt(np.trace(residuals.covariance_m2, axis1=1, axis2=2) / 2)
    inside = region_probability(residuals.error_m, residuals.covariance_m2 + residuals.truth_covariance_m2)
    every = np.column_stack((error, sigma, inside))
    return np.asarray(every[np.isfinite(every).all(axis=1)])


def cells(walks: Iterable[FloatArray]) -> str:
    """Figures of the points (n, 3) of each walk as :func:`points` gives them."""
    found = [one for one in walks if len(one)]
    if not found:
        return "- | - | - | - | - | -"
    every, walk = np.concatenate(found), np.repeat(np.arange(len(found)), [len(one) for one in found])
    order = np.argsort(every[:, 1], kind="stable")
    inside, walk = every[order, 2], walk[order]
    told = shares(inside, np.ones(len(inside)))
    drawn = [shares(inside, times[walk]) for times in multiplicities(draws(len(found)))[:ROUNDS]]
    spread = [f" ± {100 * one:.0f}" if len(found) >= FEWEST_WALKS else "" for one in np.std(drawn, axis=0)]
    texts = [f"{share:.{digits}%}{off}" for share, digits, off in zip(told, (1, 1, 0, 0), spread, strict=True)]
    return f"{len(found)} | {every[:, 0].mean():.3f} m | {' | '.join(texts)}"


def shares(inside: FloatArray, times: FloatArray) -> list[float]:
    """Inside 68 % and 95 % of all points (n,), ascending by sigma, each counted so many ``times`` (n,); inside 68 % of
    the first and the last fifth."""
    rank = (np.cumsum(times) - times / 2) / times.sum()
    of_all, least, most = times, times * (rank < 0.2), times * (rank > 0.8)
    wanted = ((0.68, of_all), (0.95, of_all), (0.68, least), (0.68, most))
    return [float(np.average(inside < share, weights=weight)) for share, weight in wanted]


if __name__ == "__main__":
    main()
