"""The paper's Tables I and II on generated copies of its evaluation, one for each seed.

Each copy is written as a raw survey and read back, like any other: 24 walks over control points, 10 in the view of a
total station. Every figure is printed beside the paper's; the last columns tell its median over the seeds as a
multiple of the paper's, and how many seeds lie within a factor of 1.5.

    python benchmarks/paper_tables.py                    seeds 1 to 5
    python benchmarks/paper_tables.py --seeds 11 12 13
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from vislam2tag.pipeline.paper.data import open_paper_data, paper_walks
from vislam2tag.quality.evaluation.paper import (
    PAPER_TABLE_1,
    PAPER_TABLE_1_NON_FAULTY,
    PAPER_TABLE_2,
    WalkErrors,
    WalkSummary,
    summarise_walks,
)
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import simulate

FACTOR = 1.5
Walks = list[WalkErrors]
Triple = tuple[float, float, float]


def main() -> None:
    """Simulate and evaluate one copy a seed, then print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--severity", default="default")
    options = parser.parse_args()
    copies = [evaluate_copy(seed, options.severity) for seed in options.seeds]
    pressed, tracked = [copy[0] for copy in copies], [copy[1] for copy in copies]
    print_table("Table I, all walks", options.seeds, PAPER_TABLE_1, pressed, summarise_walks)
    print_table("Table I, non-faulty walks", options.seeds, PAPER_TABLE_1_NON_FAULTY, pressed, over_non_faulty)
    print_table("Table II, total station", options.seeds, PAPER_TABLE_2, tracked, summarise_walks)


def evaluate_copy(seed: int, severity: str) -> tuple[Walks, Walks]:
    """Write one copy of the paper's evaluation, read it back and evaluate it."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(paper_evaluation(seed, severity), root)
        found = paper_walks(open_paper_data(root), Settings())
    return [walk.errors for walk in found.pressed], [walk.errors for walk in found.tracked]


def over_non_faulty(walks: Walks, strategy: str) -> WalkSummary:
    """Reduce the walks from which ``local-corrected`` discards nothing."""
    return summarise_walks(walks, strategy, only_non_faulty=True)


def print_table(
    title: str,
    seeds: list[int],
    paper: Mapping[str, Triple],
    copies: list[Walks],
    reduce: Callable[[Walks, str], WalkSummary],
) -> None:
    """Print one table as Markdown: a row for each strategy and statistic."""
    print(f"\n{title} (metres)\n")
    heads = [f"seed {seed}" for seed in seeds]
    print("| strategy | over walks | paper |", " | ".join(heads), "| median / paper | within 1.5 |")
    print("| --- " * (len(seeds) + 5) + "|")
    for strategy, published in paper.items():
        rows = [reduce(walks, strategy) for walks in copies]
        found = ([r.mean_m for r in rows], [r.median_m for r in rows], [r.max_m for r in rows])
        for name, value, values in zip(("mean", "median", "maximum"), published, found, strict=True):
            near = sum(1 / FACTOR <= one / value <= FACTOR for one in values)
            cells = " | ".join(f"{one:.2f}" for one in values)
            ratio = statistics.median(values) / value
            print(f"| {strategy} | {name} | {value:.2f} | {cells} | {ratio:.2f} | {near} of {len(values)} |")


if __name__ == "__main__":
    main()
