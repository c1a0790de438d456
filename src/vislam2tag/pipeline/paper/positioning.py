"""The paper's Table IV (section VII-A): its networks, trained and tested on the walks that collect."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.progress import Progress, Stage
from vislam2tag.dataset.folder import is_dataset, open_dataset
from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan, benchmark, write_table_4
from vislam2tag.pipeline.run.store import OutputFolder
from vislam2tag.positioning.benchmark.protocol import published_choices
from vislam2tag.positioning.benchmark.table_4 import SPLITS, table_4
from vislam2tag.report.pages.paper_page import PositioningPart

FOLDER = "positioning"
"""Where in the output folder the benchmark lies; its runs are not repeated."""
STEM = "table_4"


def refuse_without_networks(seeds: int | None) -> None:
    """Raise UsageError where networks are asked for and PyTorch is not installed: before the work, not after it."""
    if seeds is not None:
        for choice in published_choices():
            choice.made(None)


def paper_positioning(
    folder: OutputFolder, fingerprints: Path | None, seeds: int | None, progress: Progress[Stage]
) -> PositioningPart:
    """Train and test on the data set in ``fingerprints``, and write Table IV; without ``seeds`` say how to have it."""
    if fingerprints is None or seeds is None:
        return PositioningPart(STEM, None, "Made with --models, which trains the paper's networks.")
    if not is_dataset(fingerprints):
        return PositioningPart(STEM, None, "No walk that collects fingerprints is in this data.")
    dataset = open_dataset(fingerprints)
    splits = [name for name in SPLITS if name in dataset.splits]
    if not splits:
        return PositioningPart(STEM, None, "There are too few fingerprints to hold some out.")
    plan = BenchmarkPlan(list(published_choices()), splits, seeds, beside_paper=True)
    found = benchmark(dataset, folder.root / FOLDER, plan, progress)
    table = table_4(found.rows)
    write_table_4(folder, table)
    failed = tuple(f"{one.run}: {one.error}" for one in found.failed)
    return PositioningPart(STEM, table, failed=failed)
