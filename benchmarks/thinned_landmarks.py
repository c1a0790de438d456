"""Errors of every strategy when fewer landmarks hang on a floor.

Generated floors have 24 landmarks; of these, and of those given with the real walks, every k-th is kept, starting with
another one for each walk; the others are taken out of the logs too. With "+ unsurveyed" the smoother gets them back,
logged but not surveyed. Nothing is marked uncertain; each walk counts once.

    python benchmarks/thinned_landmarks.py                                seeds 1 to 4: 32 generated walks
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace

from data_sets import Walk, generated, real_walks

from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategies_for_poses, strategy_named
from vislam2tag.quality.evaluation.metrics import ErrorSummary, average, summarise
from vislam2tag.simulation.settings import BuildingSettings

LANDMARKS = 24
SMOOTHER = "smoother"
UNSURVEYED = "smoother + unsurveyed"
Curves = dict[str, dict[int, ErrorSummary]]
"""By strategy, then by k."""


def main() -> None:
    """Map every walk with every thinning and strategy, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--severity", default="default")
    options = parser.parse_args()
    floors = BuildingSettings(landmarks=LANDMARKS)
    data_sets = {
        "generated": curves(generated(options.seeds, options.severity, floors, sessions=2), 6),
        "real": curves(real_walks(), 3),
    }
    for name, found in data_sets.items():
        if found:
            print_table(name, found)


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
