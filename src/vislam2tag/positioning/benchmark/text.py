"""The tables of a benchmark as text: CSV with one figure a field, and LaTeX with booktabs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table
from vislam2tag.evaluation.record import FigureWithInterval
from vislam2tag.positioning.benchmark.record import BenchmarkRow, ModelTime
from vislam2tag.positioning.benchmark.rows import ALL, FIGURES, SHARES

HEADS = {
    "floor_hit": "floor hit",
    "mean_m": "mean",
    "median_m": "median",
    "p75_m": "p75",
    "p95_m": "p95",
    "on_floor_mean_m": "mean, right floor",
    "on_floor_median_m": "median, right floor",
    "space_mean_m": "mean in space",
    "ipin_m": "IPIN score",
    "inside_68": "in 68 %",
    "inside_95": "in 95 %",
}
"""What the figures in tables for reading are called; CSV has all."""
_WITH_INTERVAL = {"floor_hit", "mean_m"}


def rows_csv(rows: Sequence[BenchmarkRow]) -> str:
    """One line a row; each figure with its bounds in ``..._low`` and ``..._high``, empty where not known."""
    keys = ("split", "fold", "model", "runs", "test_scans")
    head = (*keys, *(f"{name}{end}" for name in FIGURES for end in ("", "_low", "_high")))
    return csv_rows((head, *((*(getattr(row, key) for key in keys), *_bounds(row)) for row in rows)))


def _bounds(row: BenchmarkRow) -> list[float | None]:
    figures = [row.figures[name] for name in FIGURES]
    return [value for figure in figures for value in (figure.value, figure.low, figure.high)]


def times_csv(times: Sequence[ModelTime]) -> str:
    """One line a model: seconds to train, milliseconds to predict a scan, both as multiples of the reference's."""
    names = tuple(ModelTime.model_fields)
    return csv_rows((names, *([_rounded(getattr(time, name)) for name in names] for time in times)))


def _rounded(value: str | float | None) -> str | float | None:
    return float(f"{value:.4g}") if isinstance(value, float) else value


def latex_text(rows: Sequence[BenchmarkRow]) -> str:
    """A ``tabular`` (package booktabs) for each split: metres, and shares in percent."""
    return "\n".join(_tabular(split, list(group)) for split, group in groupby(rows, key=lambda row: row.split))


def _tabular(split: str, rows: Sequence[BenchmarkRow]) -> str:
    heads = ("Test", "Model", *map(_percent, HEADS.values()))
    groups = groupby(rows, key=lambda row: row.fold)
    title = f"Split {split}; metres; 95 % intervals over seeds in brackets"
    return latex_table(title, (heads,), (map(_latex_row, group) for _, group in groups), texts=2)


def _latex_row(row: BenchmarkRow) -> tuple[str, ...]:
    figures = (_percent(figure_text(name, row.figures[name])).replace(" to ", ", ") for name in HEADS)
    return (latex_escaped(fold_name(row.fold)), latex_escaped(row.model), *figures)


def _percent(text: str) -> str:
    return text.replace(" %", "\\,\\%")


def fold_name(fold: str) -> str:
    """What a fold is called in tables."""
    return "mean of folds" if fold == ALL else fold


def figure_text(name: str, figure: FigureWithInterval) -> str:
    """Write ``6.53 [6.31 to 6.75]`` or ``94.6 %``; a dash where not known; the interval of the main figures only."""
    if figure.value is None:
        return "-"
    share = name in SHARES
    text = _number(figure.value, share=share)
    if figure.low is not None and figure.high is not None and name in _WITH_INTERVAL:
        text += f" [{_number(figure.low, share=share)} to {_number(figure.high, share=share)}]"
    return f"{text} %" if share else text


def _number(value: float, *, share: bool) -> str:
    return f"{100 * value:.1f}" if share else f"{value:.2f}"
