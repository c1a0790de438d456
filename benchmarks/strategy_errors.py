"""Errors of every registered strategy on generated and on real walks, in metres.

Generated walks are compared at every camera frame, real ones at their true points; nothing is marked uncertain. Each
walk counts once: a figure is the average of the walks' figures. Coverage is pooled over all points. The smoother is
also compared with each other strategy on the points that both label.

With ``--thinned`` a floor has fewer landmarks. Generated floors have 24; of these, and of those of the real walks,
every k-th is kept, starting with another one for each walk. The others are also removed from the logs. With "+
unsurveyed" the smoother gets them back, logged but not surveyed.

    python benchmarks/strategy_errors.py                               96 generated, 3 real
    python benchmarks/strategy_errors.py --seeds 21 22 --severity none mild default severe
    python benchmarks/strategy_errors.py --walks --csv errors.csv      also every walk; the same figures as CSV
    python benchmarks/strategy_errors.py --thinned                     seeds 1 to 4: 32 generated walks
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np
import polars as pl
from data_sets import Walk, generated, real_walks

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import STATUS_LABELS, Status
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import MappingStrategy, strategies_for_poses, strategy_named
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.quality.evaluation.metrics import ErrorSummary, average, summarise
from vislam2tag.quality.evaluation.reliability import added, reduce_errors
from vislam2tag.simulation.settings import BuildingSettings

FIGURES = ("mean_m", "median_m", "p75_m", "p95_m", "max_m", "labelled_share")
HEADS = ("mean", "median", "p75", "p95", "max", "labelled")
STATED = (0.68, 0.95)
DATA = ("generated", "real")
SEVERITIES = ("none", "mild", "default", "severe")
OURS = "smoother"
LANDMARKS = 24
UNSURVEYED = "smoother + unsurveyed"
Curves = dict[str, dict[int, ErrorSummary]]
"""By strategy, then by k."""


@dataclass(frozen=True)
class Mapped:
    """What a strategy makes of a walk."""

    error: ErrorSummary
    errors_m: FloatArray
    """Error at each point asked for, NaN without a label."""
    record: ErrorRecord
    """Errors counted by the region that the strategy states."""
    frames: FloatArray
    """Share of the camera's frames with each status code."""

    @classmethod
    def of(cls, walk: Walk, strategy: MappingStrategy) -> Mapped:
        """Map a walk and compare it with its truth."""
        trajectory = strategy.map(walk.camera, walk.log, walk.landmarks)
        errors, residuals = walk.errors(trajectory), walk.residuals(trajectory)
        shares = np.bincount(trajectory.status, minlength=len(STATUS_LABELS)) / len(trajectory.status)
        record = reduce_errors("truth.csv", residuals.error_m, residuals.covariance_m2, residuals.truth_covariance_m2)
        return cls(summarise(errors), errors, record, shares)


Results = dict[str, dict[str, Mapped]]
"""By strategy, then by walk."""


def main() -> None:
    """Map every walk with every strategy and print the tables of each data set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", nargs="+", choices=DATA, default=DATA, help="default: both")
    parser.add_argument("--seeds", type=int, nargs="+", help="default: 1 to 8; thinned: 1 to 4")
    parser.add_argument("--severity", nargs="+", choices=SEVERITIES, default=["default"])
    parser.add_argument("--walks", action="store_true", help="also a table of every walk's mean error and share")
    parser.add_argument("--csv", type=Path, help="write every walk's figures there")
    parser.add_argument("--thinned", action="store_true", help="errors when fewer landmarks hang on a floor")
    options = parser.parse_args()
    seeds = options.seeds or list(range(1, 5 if options.thinned else 9))
    if options.thinned:
        print_thinned(options.data, options.severity, seeds)
        return
    asked_for = chosen(options.data, options.severity, seeds)
    data_sets = {name: evaluate(walks) for name, walks in asked_for.items()}
    for name, results in data_sets.items():
        if any(results.values()):
            print_averages(name, results)
            print_averages(f"{name}, only walks of which nothing is discarded", whole(results))
            print_comparison(name, results)
            print_causes(results)
            if options.walks:
                print_walks(results)
    print_coverage(data_sets)
    if options.csv is not None:
        write_csv(data_sets, options.csv)


def chosen(data: Sequence[str], severities: Sequence[str], seeds: list[int]) -> dict[str, Iterable[Walk]]:
    """Walks of the data sets asked for, by the name of their tables."""
    walks: dict[str, Iterable[Walk]] = {}
    if "generated" in data:
        walks |= {f"generated, {level}": generated(seeds, level) for level in severities}
    if "real" in data:
        walks["real"] = real_walks()
    return walks


def evaluate(walks: Iterable[Walk]) -> Results:
    """Map each walk with each strategy."""
    strategies = {name: strategy_named(name, MappingSettings()) for name in strategies_for_poses()}
    results: Results = {name: {} for name in strategies}
    for number, walk in enumerate(walks, start=1):
        for name, strategy in strategies.items():
            results[name][f"{number} {walk.name}"] = Mapped.of(walk, strategy)
    return results


def whole(results: Results) -> Results:
    """Keep the walks of which ``local-corrected`` maps every frame that ``local`` maps."""
    local, corrected = results["local"], results["local-corrected"]
    names = [name for name in local if local[name].frames[Status.OK] == corrected[name].frames[Status.OK]]
    return {strategy: {name: walks[name] for name in names} for strategy, walks in results.items()}


def print_averages(name: str, results: Results) -> None:
    """Print the averages over the walks, if there are any, as Markdown."""
    count = len(next(iter(results.values())))
    if count == 0:
        return
    print(f"\n{name}: {count} walks (metres; share of the frames or true points)\n")
    print(f"| strategy | {' | '.join(HEADS)} |")
    print("| --- " * (len(HEADS) + 1) + "|")
    for strategy, walks in results.items():
        print(f"| {strategy} | {cells(average([mapped.error for mapped in walks.values()]))} |")


def print_comparison(name: str, results: Results) -> None:
    """Print how the smoother does against each other strategy where both have a label, as Markdown."""
    print(f"\n{name}: mean error on the points that both label, averaged over the walks (metres)\n")
    print("| strategy | its error | smoother's | ratio | walks | worst excess of a walk |")
    print("| --- " * 6 + "|")
    for strategy, walks in results.items():
        pairs = {walk: common_means(results[OURS][walk], mapped) for walk, mapped in walks.items()}
        compared = {walk: pair for walk, pair in pairs.items() if pair is not None}
        if strategy == OURS or not compared:
            continue
        ours, theirs = np.mean(list(compared.values()), axis=0).tolist()
        excess, worst = max((mine - its, walk) for walk, (mine, its) in compared.items())
        row = f"{theirs:.3f} | {ours:.3f} | {ours / theirs:.2f} | {len(compared)} | {excess:+.3f} ({worst})"
        print(f"| {strategy} | {row} |")


def common_means(ours: Mapped, theirs: Mapped) -> tuple[float, float] | None:
    """Mean errors where both have a label; None where that is nowhere."""
    both = np.isfinite(ours.errors_m) & np.isfinite(theirs.errors_m)
    return (float(ours.errors_m[both].mean()), float(theirs.errors_m[both].mean())) if both.any() else None


def print_coverage(data_sets: dict[str, Results]) -> None:
    """Print for strategies that state a covariance the share of all errors inside its regions, as Markdown."""
    print(f"\n| data | strategy | points | {' | '.join(f'inside {stated:.0%}' for stated in STATED)} |")
    print("| --- " * (3 + len(STATED)) + "|")
    for data, results in data_sets.items():
        for strategy, walks in results.items():
            inside = np.array(reduce(added, [one.record for one in walks.values()]).inside) if walks else np.zeros(100)
            if inside.sum():
                shares = [f"{inside[: round(100 * stated)].sum() / inside.sum():.1%}" for stated in STATED]
                print(f"| {data} | {strategy} | {inside.sum()} | {' | '.join(shares)} |")


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


def print_thinned(data: Sequence[str], severities: Sequence[str], seeds: list[int]) -> None:
    """Map every walk with every thinning and strategy, and print the tables."""
    floors = BuildingSettings(landmarks=LANDMARKS)
    found: dict[str, Curves] = {}
    if "generated" in data:
        for level in severities:
            found[f"generated, {level}"] = curves(generated(seeds, level, floors, sessions=2), 6)
    if "real" in data:
        found["real"] = curves(real_walks(), 3)
    for name, errors in found.items():
        if errors:
            print_table(name, errors)


def curves(walks: Iterable[Walk], sparsest: int) -> Curves:
    """Map each walk with every 1st to ``sparsest``-th landmark, and average."""
    found: dict[tuple[str, int], list[ErrorSummary]] = {}
    for number, walk in enumerate(walks):
        for k in range(1, sparsest + 1):
            for strategy, one in variants(walk, number, k):
                mapping = strategy_named(strategy.split(" ")[0], MappingSettings())
                trajectory = mapping.map(one.camera, one.log, one.landmarks)
                found.setdefault((strategy, k), []).append(summarise(one.errors(trajectory)))
    result: Curves = {}
    for (strategy, k), errors in found.items():
        result.setdefault(strategy, {})[k] = average(errors)
    return result


def variants(walk: Walk, number: int, k: int) -> list[tuple[str, Walk]]:
    """Each strategy with the walk that it gets: every k-th landmark, the others gone or not surveyed."""
    kept = walk.landmarks.select(list(range(number % k, len(walk.landmarks.ids), k)))
    unsurveyed = replace(walk, landmarks=kept)
    logged = [i for i, name in enumerate(walk.log.ids) if name in kept.index]
    gone = replace(unsurveyed, log=walk.log.select(logged))
    return [(name, gone) for name in strategies_for_poses()] + [(UNSURVEYED, unsurveyed)]


def print_table(name: str, found: Curves) -> None:
    """Print mean, 95th percentile and share labelled as Markdown."""
    columns = sorted(next(iter(found.values())))
    print(f"\n{name}: mean / 95th percentile in metres (share labelled) with every k-th landmark\n")
    print(f"| strategy | {' | '.join(f'k = {k}' for k in columns)} |")
    print("| --- " * (len(columns) + 1) + "|")
    for strategy, errors in found.items():
        cells = [f"{e.mean_m:.2f} / {e.p95_m:.2f} ({e.labelled_share:.0%})" for e in map(errors.get, columns) if e]
        print(f"| {strategy} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
