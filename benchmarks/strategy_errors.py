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
from pathlib import Path

import polars as pl
from data_sets import Walk, generated, real_walks

from vislam2tag.evaluation.truth import ErrorSummary, average, summarise
from vislam2tag.mapping import strategy_named, strategy_names
from vislam2tag.settings import Settings

FIGURES = ("mean_m", "median_m", "p75_m", "p95_m", "max_m", "labelled_share")
HEADS = ("mean", "median", "p75", "p95", "max", "labelled")
Errors = dict[str, dict[str, ErrorSummary]]
"""By strategy, then by walk."""


def main() -> None:
    """Map every walk with every strategy and print a table for each data set."""
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
    for name, errors in data_sets.items():
        if any(errors.values()):
            print_averages(name, errors)
            if options.walks:
                print_walks(errors)
    if options.csv is not None:
        write_csv(data_sets, options.csv)


def evaluate(walks: Iterable[Walk]) -> Errors:
    """Map each walk with each strategy."""
    strategies = {name: strategy_named(name, Settings()) for name in strategy_names()}
    errors: Errors = {name: {} for name in strategies}
    for number, walk in enumerate(walks, start=1):
        for name, strategy in strategies.items():
            trajectory = strategy.map(walk.camera, walk.log, walk.landmarks)
            errors[name][f"{number} {walk.name}"] = summarise(walk.errors(trajectory))
    return errors


def print_averages(name: str, errors: Errors) -> None:
    """Print the averages over the walks as Markdown."""
    count = len(next(iter(errors.values())))
    print(f"\n{name}, {count} walks (metres; share of the frames or true points)\n")
    print(f"| strategy | {' | '.join(HEADS)} |")
    print("| --- " * (len(HEADS) + 1) + "|")
    for strategy, walks in errors.items():
        print(f"| {strategy} | {cells(average(list(walks.values())))} |")


def cells(summary: ErrorSummary) -> str:
    """Figures of one row."""
    metres = " | ".join(f"{getattr(summary, figure):.2f}" for figure in FIGURES[:-1])
    return f"{metres} | {summary.labelled_share:.1%}"


def print_walks(errors: Errors) -> None:
    """Print each walk's mean error and labelled share as Markdown."""
    print(f"\n| walk | {' | '.join(errors)} |")
    print("| --- " * (len(errors) + 1) + "|")
    for walk in next(iter(errors.values())):
        ours = [errors[strategy][walk] for strategy in errors]
        print(f"| {walk} | {' | '.join(f'{one.mean_m:.2f} ({one.labelled_share:.0%})' for one in ours)} |")


def write_csv(data_sets: dict[str, Errors], path: Path) -> None:
    """Write one row for each data set, strategy and walk."""
    rows = [
        {"data": data, "strategy": strategy, "walk": walk, **{figure: getattr(one, figure) for figure in FIGURES}}
        for data, errors in data_sets.items()
        for strategy, walks in errors.items()
        for walk, one in walks.items()
    ]
    pl.DataFrame(rows).write_csv(path, float_precision=4)


if __name__ == "__main__":
    main()
