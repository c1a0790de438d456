"""Pages of print tables and figures: of the paper and of a benchmark."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from vislam2tag import __version__
from vislam2tag.datasets.statistics_record import TABLE_3_TITLE, Table3
from vislam2tag.positioning.benchmark import Benchmark
from vislam2tag.positioning.benchmark_tables import HEADS, TABLE_4_TITLE, Table4, figure_text, fold_name
from vislam2tag.quality.evaluation.paper import PaperTable, figures_of, heads_of
from vislam2tag.views.page import data_uri, write_page


@dataclass(frozen=True)
class TablePart:
    """A table, the stem of its files, and the share of points that each strategy labels (0 to 1).

    ``missing`` says why there is none.
    """

    stem: str
    table: PaperTable
    labelled: Mapping[str, float]
    missing: str = ""

    def shares(self, names: Mapping[str, str]) -> str:
        """The shares as text, with the ``names`` of strategies."""
        return ", ".join(f"{names[strategy]} {100 * share:.0f} %" for strategy, share in self.labelled.items())


@dataclass(frozen=True)
class CollectionPart:
    """The paper's Table III and the stem of its files; ``missing`` says why there is none."""

    stem: str
    table: Table3 | None
    sentence: str = ""
    """Number and cost of fingerprints, compared with the paper's."""
    missing: str = ""


@dataclass(frozen=True)
class PositioningPart:
    """The paper's Table IV and the stem of its files; ``missing`` says why there is none."""

    stem: str
    table: Table4 | None
    missing: str = ""
    failed: tuple[str, ...] = ()
    """One sentence for each run that failed."""


@dataclass(frozen=True)
class FigurePart:
    """A figure and the stem of its files: title, description, and its SVG or why there is none (``missing``)."""

    stem: str
    title: str
    about: str
    svg: bytes = b""
    width_in: float = 0.0
    """Width in print, inches."""
    missing: str = ""

    @property
    def data_uri(self) -> str:
        """The figure as a data URI."""
        return data_uri(self.svg, "image/svg+xml")


def write_paper_page(
    out_file: Path,
    title: str,
    names: Mapping[str, str],
    tables: Sequence[TablePart],
    collection: CollectionPart,
    positioning: PositioningPart,
    figures: Sequence[FigurePart],
    failed: Sequence[str],
) -> None:
    """Write the page ``out_file``; equal input gives equal bytes.

    ``names`` are those of the strategies, ``failed`` one sentence for each session that could not be evaluated. Raises
    OutputError if it cannot be written.
    """
    context = {
        "title": title,
        "version": __version__,
        "names": names,
        "tables": tables,
        "collection": collection,
        "collection_title": TABLE_3_TITLE,
        "positioning": positioning,
        "positioning_title": TABLE_4_TITLE,
        "figures": figures,
        "failed": failed,
        "figures_of": figures_of,
        "heads_of": heads_of,
    }
    write_page(out_file, "paper.html.j2", context)


def write_benchmark_page(
    out_file: Path, found: Benchmark, figures: Sequence[FigurePart], table_4: Table4 | None
) -> None:
    """Write the page ``out_file`` about a benchmark; ``table_4`` if requested.

    It is written beside ``out_file`` and renamed when complete. Raises OutputError if it cannot be written.
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
    """Each model with its parameters except the seed, as JSON."""
    parameters = {run.model: {k: v for k, v in run.parameters.items() if k != "seed"} for run in found.runs}
    return [(name, json.dumps(own, sort_keys=True)) for name, own in parameters.items()]
