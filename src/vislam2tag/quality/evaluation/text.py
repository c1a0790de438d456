"""The tables of an evaluation as text: CSV with one figure a field, and LaTeX with booktabs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table
from vislam2tag.quality.evaluation.metrics import ALL, DIRECTED, FIGURES, OVER_WALKS
from vislam2tag.quality.evaluation.record import DenseRow, ErrorRow, FigureWithInterval, SessionEvaluation

_ROW_KEYS = ("truth", "method", "strategy", "group", "selection", "over", "walks", "points")
_WALK_FIGURES = ("points", "labelled", *FIGURES, *DIRECTED)
HEADS = {name: name.removesuffix("_m").replace("rmse", "RMSE") for name in (*FIGURES, *DIRECTED)}
"""What the figures are called in tables for reading."""


def rows_csv(rows: Sequence[ErrorRow]) -> str:
    """One line a row; each figure with its bounds in ``..._low`` and ``..._high``, empty where not known."""
    names = ("labelled", *FIGURES, *DIRECTED)
    head = (*_ROW_KEYS, *(f"{name}{end}" for name in names for end in ("", "_low", "_high")))
    return csv_rows((head, *((*(getattr(row, key) for key in _ROW_KEYS), *_bounds(row, names)) for row in rows)))


def _bounds(row: ErrorRow, names: Sequence[str]) -> list[float | None]:
    figures: list[FigureWithInterval] = [getattr(row, name) for name in names]
    return [value for figure in figures for value in (figure.value, figure.low, figure.high)]


def sessions_csv(sessions: Sequence[SessionEvaluation]) -> str:
    """One line for each session, truth, method and strategy; one with empty figures for a session without any."""
    who = ("floor", "device", "session", "faulty", "movement_m")
    head = (*who, "truth", "method", "strategy", "retention", *_WALK_FIGURES, "error")
    lines: list[tuple[object, ...]] = []
    for session in sessions:
        own = tuple(getattr(session, name) for name in who)
        for one in session.measured:
            figures = (getattr(one, name) for name in _WALK_FIGURES)
            kept = session.retention.get(one.strategy)
            lines.append((*own, one.truth, one.method, one.strategy, kept, *figures, session.error))
        if not session.measured:
            empty = (None,) * (4 + len(_WALK_FIGURES))
            lines.append((*own, *empty, session.error or "; ".join(session.missing)))
    return csv_rows((head, *lines))


def dense_csv(rows: Sequence[DenseRow]) -> str:
    """One line for each strategy and distance or speed."""
    names = tuple(DenseRow.model_fields)
    return csv_rows((names, *(tuple(getattr(row, name) for name in names) for row in rows)))


def latex_text(rows: Sequence[ErrorRow]) -> str:
    """A ``tabular`` (package booktabs) for each truth and method: over walks, with and without faults, metres."""
    shown = [row for row in rows if row.group == ALL and row.over == OVER_WALKS]
    return "\n".join(
        _tabular(f"{truth_name(truth, method)}, over walks", list(group))
        for (truth, method), group in groupby(shown, key=lambda row: (row.truth, row.method))
    )


def truth_name(truth: str, method: str) -> str:
    """What a truth, made by a method, is called in tables: ``control points (nearest)``."""
    words = {"dense": "dense truth"}.get(truth, truth.replace("_", " "))
    return f"{words} ({method})" if method else words


def _tabular(title: str, rows: Sequence[ErrorRow]) -> str:
    heads = ("Trajectories", "Strategy", "Walks", "Labelled", *(head[0].upper() + head[1:] for head in HEADS.values()))
    groups = groupby(sorted(rows, key=lambda row: row.selection), key=lambda row: row.selection)
    caption = f"{title}; metres, 95 % intervals in brackets"
    return latex_table(caption, (heads,), (map(_latex_row, group) for _, group in groups), texts=2)


def _latex_row(row: ErrorRow) -> tuple[str, ...]:
    share = "-" if row.labelled.value is None else rf"{100 * row.labelled.value:.0f}\,\%"
    figures = (_latex_figure(name, getattr(row, name)) for name in HEADS)
    return (row.selection, latex_escaped(row.strategy), str(row.walks), share, *figures)


def _latex_figure(name: str, figure: FigureWithInterval) -> str:
    """Write a figure, the interval of mean and median only: a page is narrow."""
    text = figure_text(figure if name in ("mean_m", "median_m") else FigureWithInterval(value=figure.value))
    return text.replace(" to ", ", ")


def figure_text(figure: FigureWithInterval) -> str:
    """Write ``0.31 [0.25 to 0.40]``; a dash where the figure is not known."""
    if figure.value is None:
        return "-"
    bounds = "" if figure.low is None else f" [{figure.low:.2f} to {figure.high:.2f}]"
    return f"{figure.value:.2f}{bounds}"
