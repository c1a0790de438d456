"""The paper's tables as text: tidy CSV, Markdown, and LaTeX with booktabs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table
from vislam2tag.quality.evaluation.paper.tables import PUBLISHED, Cell, PaperTable, TableRow
from vislam2tag.quality.evaluation.paper.walks import PaperWalk

NONE = "-"


def csv_text(table: PaperTable) -> str:
    """One line for each cell: ``trajectories,metric,strategy,walks,here_m,paper_m``; empty where there is no figure."""
    rows: list[Sequence[object]] = [("trajectories", "metric", "strategy", "walks", "here_m", "paper_m")]
    for row in table.rows:
        for cell in row.cells:
            here = "" if math.isnan(cell.here_m) else f"{cell.here_m:.4f}"
            paper = "" if cell.paper_m is None else f"{cell.paper_m:.2f}"
            rows.append((row.selection, row.metric, cell.strategy, cell.walks, here, paper))
    return csv_rows(rows)


def walks_csv(walks: Sequence[PaperWalk]) -> str:
    """One line for each walk and strategy; ``error_m`` is empty where the strategy labels nothing."""
    head = ("floor", "device", "session", "truth", "faulty", "movement_m", "strategy", "points", "labelled", "error_m")
    rows: list[Sequence[object]] = [head]
    for walk in walks:
        means = walk.errors.error_m
        for name, points in walk.counted.items():
            key = (walk.key.floor, walk.key.device, walk.key.session, points.kind, walk.faulty)
            error = "" if math.isnan(means[name]) else f"{means[name]:.4f}"
            counts = (len(points), int(points.labelled.sum()))
            rows.append((*key, f"{walk.movement_m:.4f}", name, *counts, error))
    return csv_rows(rows)


def markdown_text(table: PaperTable, names: Mapping[str, str]) -> str:
    """Two columns for each strategy, called by ``names``: here, and in the paper."""
    heads = [head for cell in table.rows[0].cells for head in heads_of(cell, names[cell.strategy])]
    rows = [(f"{row.selection} ({_walks(row.cells)})", row.metric, *_figures(row)) for row in table.rows]
    return markdown_table(table.title, ("trajectories", "metric", *heads), rows, texts=2)


def latex_text(table: PaperTable, names: Mapping[str, str]) -> str:
    """A ``tabular`` (packages booktabs and multirow), two columns for each strategy: here, and in the paper."""
    cells = table.rows[0].cells
    heads = [heads_of(cell, "here") for cell in cells]
    groups = [
        f"\\multicolumn{{{len(head)}}}{{c}}{{{latex_escaped(names[cell.strategy])}}}"
        for cell, head in zip(cells, heads, strict=True)
    ]
    title = (("Trajectories", "Metric", *groups), ("", "", *(head for pair in heads for head in pair)))
    rows = [list(group) for _, group in groupby(table.rows, key=lambda row: row.selection)]
    return latex_table(table.title, title, (_latex_group(group) for group in rows), texts=2)


def _latex_group(rows: Sequence[TableRow]) -> Iterator[tuple[str, ...]]:
    """Rows of one selection of trajectories, which is named once."""
    selection = rf"\multirow{{{len(rows)}}}{{*}}{{{rows[0].selection}}}"
    for number, row in enumerate(rows):
        yield ("" if number else selection, row.metric, *_figures(row))


def _figures(row: TableRow) -> list[str]:
    return [text for cell in row.cells for text in figures_of(cell)]


def heads_of(cell: Cell, name: str) -> tuple[str, ...]:
    """Heads of a cell's columns in a table for reading: the strategy's name, and "paper" where it has the strategy."""
    return (name, "paper") if cell.strategy in PUBLISHED else (name,)


def figures_of(cell: Cell) -> tuple[str, ...]:
    """What stands below :func:`heads_of`: metres with two decimals, a dash where there is no figure."""
    figures = (cell.here_m, math.nan if cell.paper_m is None else cell.paper_m)
    texts = tuple(NONE if math.isnan(figure) else f"{figure:.2f}" for figure in figures)
    return texts if cell.strategy in PUBLISHED else texts[:1]


def _walks(cells: tuple[Cell, ...]) -> str:
    """How many walks the strategies label: one number, or the least and the greatest."""
    counts = sorted({cell.walks for cell in cells})
    return f"{counts[0]} walks" if len(counts) == 1 else f"{counts[0]} to {counts[-1]} walks"
