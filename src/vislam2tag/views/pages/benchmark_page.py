"""The page of a benchmark: its tables, its figures, and how it was run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from vislam2tag.positioning.benchmark_record import Benchmark
from vislam2tag.positioning.benchmark_tables import HEADS, TABLE_4_TITLE, Table4, figure_text, fold_name
from vislam2tag.views.page import write_page
from vislam2tag.views.pages.paper_page import FigurePart


def write_benchmark_page(
    out_file: Path, found: Benchmark, figures: Sequence[FigurePart], table_4: Table4 | None
) -> None:
    """Write the page ``out_file`` about a benchmark; ``table_4`` where it was asked for.

    It is written beside ``out_file`` and renamed when whole. Raises OutputError where it cannot be.
    """
    context = {
        "title": found.dataset,
        "found": found,
        "best": found.best,
        "maps": [part for part in figures if part.stem.startswith("map.")],
        "splits": [(split, list(rows)) for split, rows in groupby(found.rows, key=lambda row: row.split)],
        "heads": HEADS,
        "figure_text": figure_text,
        "fold_name": fold_name,
        "models": _models(found),
        "versions": found.runs[0].versions if found.runs else {"vislam2tag": found.version},
        "figures": [part for part in figures if not part.stem.startswith("map.")],
        "table_4": table_4,
        "table_4_title": TABLE_4_TITLE,
    }
    write_page(out_file, "benchmark.html.j2", context)


def _models(found: Benchmark) -> list[tuple[str, str]]:
    """Each model with its parameters but the seed, as JSON."""
    parameters = {run.model: {k: v for k, v in run.parameters.items() if k != "seed"} for run in found.runs}
    return [(name, json.dumps(own, sort_keys=True)) for name, own in parameters.items()]
