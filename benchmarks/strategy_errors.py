"""Errors of every registered strategy on generated and on real walks, in metres.

Generated walks are compared at every camera frame, real ones at their true points. Each walk counts once: a figure is
the average of the walks' figures.

    python benchmarks/strategy_errors.py                               seeds 1 to 8: 96 generated walks
    python benchmarks/strategy_errors.py --seeds 21 22 --severity mild
    python benchmarks/strategy_errors.py --walks --csv errors.csv      also every walk; the same figures as CSV
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from data_sets import Walk, generated, real_walks

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import STATUS_LABELS, Status
from vislam2tag.evaluation.truth import ErrorSummary, average, summarise
from vislam2tag.mapping import strategy_named, strategy_names
from vislam2tag.settings import Settings

FIGURES = ("mean_m", "median_m", "p75_m", "p95_m", "max_m", "labelled_share")
HEADS = ("mean", "median", "p75", "p95", "max", "labelled")


@dataclass(frozen=True)
class Mapped:
    """What a strategy makes of a walk."""

    error: ErrorSummary
    frames: FloatArray
    """Share of the camera's frames with each status code."""


Results = dict[str, dict[str, Mapped]]
"""By strategy, then by walk."""


def main() -> None:
    """Map every walk with every strategy and print the tables of each data set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 9)))
    parser.add_argument("--severity", default="default")
    parser.add_argument("--walks", action="store_true", help="also a table of every walk's mean error and share")
    parser.add_argument("--csv", type=Path, help="write every walk's figures there")
    options = parser.parse_args()
    data_sets = {
        "generated": evaluate(generated(options.seeds, options.severity)),
        "real": evaluate(real_walks()),
    }
    for name, results in data_sets.items():
        if any(results.values()):
            print_averages(name, results)
            print_averages(f"{name}, only walks of which nothing is discarded", whole(results))
            print_causes(results)
            if options.walks:
                print_walks(results)
    if options.csv is not None:
        write_csv(data_sets, options.csv)


def evaluate(walks: Iterable[Walk]) -> Results:
    """Map each walk with each strategy."""
    strategies = {name: strategy_named(name, Settings()) for name in strategy_names()}
    results: Results = {name: {} for name in strategies}
    for number, walk in enumerate(walks, start=1):
        for name, strategy in strategies.items():
            trajectory = strategy.map(walk.camera, walk.log, walk.landmarks)
            shares = np.bincount(trajectory.status, minlength=len(STATUS_LABELS)) / len(trajectory.status)
            results[name][f"{number} {walk.name}"] = Mapped(summarise(walk.errors(trajectory)), shares)
    return results


def whole(results: Results) -> Results:
    """Keep the walks of which ``local-corrected`` maps every frame that ``local`` maps."""
    local, corrected = results["local"], results["local-corrected"]
    names = [name for name in local if local[name].frames[Status.OK] == corrected[name].frames[Status.OK]]
    return {strategy: {name: walks[name] for name in names} for strategy, walks in results.items()}


def print_averages(name: str, results: Results) -> None:
    """Print the averages over the walks as Markdown."""
    count = len(next(iter(results.values())))
    print(f"\n{name}: {count} walks (metres; share of the frames or true points)\n")
    print(f"| strategy | {' | '.join(HEADS)} |")
    print("| --- " * (len(HEADS) + 1) + "|")
    for strategy, walks in results.items():
        print(f"| {strategy} | {cells(average([mapped.error for mapped in walks.values()]))} |")


def print_causes(results: Results) -> None:
    """Print the average share of the frames with each status as Markdown."""
    shares = {name: np.mean([mapped.frames for mapped in walks.values()], axis=0) for name, walks in results.items()}
    codes = np.flatnonzero(sum(shares.values()) > 0).tolist()
    print(f"\n| strategy | {' | '.join(STATUS_LABELS[code] for code in codes)} |")
    print("| --- " * (len(codes) + 1) + "|")
    for strategy, share in shares.items():
        print(f"| {strategy} | {' | '.join(f'{share[code]:.1%}' for code in codes)} |")


def cells(summary: ErrorSummary) -> str:
    """Figures of one row."""
    metres = " | ".join(f"{getattr(summary, figure):.2f}" for figure in FIGURES[:-1])
    return f"{metres} | {summary.labelled_share:.1%}"


def print_walks(results: Results) -> None:
    """Print each walk's mean error and labelled share as Markdown."""
    print(f"\n| walk | {' | '.join(results)} |")
    print("| --- " * (len(results) + 1) + "|")
    for walk in next(iter(results.values())):
        errors = [results[strategy][walk].error for strategy in results]
        print(f"| {walk} | {' | '.join(f'{one.mean_m:.2f} ({one.labelled_share:.0%})' for one in errors)} |")


def write_csv(data_sets: dict[str, Results], path: Path) -> None:
    """Write one row for each data set, strategy and walk."""
    rows = [
        {"data": data, "strategy": strategy, "walk": walk, **{name: getattr(mapped.error, name) for name in FIGURES}}
        for data, results in data_sets.items()
        for strategy, walks in results.items()
        for walk, mapped in walks.items()
    ]
    pl.DataFrame(rows).write_csv(path, float_precision=4)


if __name__ == "__main__":
    main()
