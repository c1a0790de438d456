"""The page of an evaluation: its tables, and the errors as curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from vislam2tag.evaluation.pooling import ALL, OVER_POINTS, OVER_WALKS
from vislam2tag.evaluation.record import ErrorRow, SessionEvaluation, StrategyErrors, SurveyEvaluation
from vislam2tag.evaluation.text import HEADS, figure_text, truth_name
from vislam2tag.report.page import write_page
from vislam2tag.report.pages.evaluation_figures import cdf_figure, drift_figure, movement_figure


@dataclass(frozen=True)
class TruthView:
    """One truth, made by one method: its rows over all walks and over their points, over the walks of each floor and
    each device, and its figures.
    """

    name: str
    walks: Sequence[ErrorRow]
    points: Sequence[ErrorRow]
    groups: Sequence[ErrorRow]
    curves: str
    movement: str | None
    """None where no walk tells."""


def write_evaluation_page(out_file: Path, title: str, evaluation: SurveyEvaluation) -> None:
    """Write the page ``out_file`` about an evaluation; equal input gives equal bytes.

    It is written beside ``out_file`` and renamed when whole. Raises OutputError where it cannot be.
    """
    context = {
        "title": title,
        "evaluation": evaluation,
        "truths": list(_truths(evaluation)),
        "heads": HEADS,
        "figure_text": figure_text,
        "lines": lambda session: list(_lines(session, evaluation.strategies)),
        "drift_figure": drift_figure(evaluation),
    }
    write_page(out_file, "evaluation.html.j2", context)


def _truths(evaluation: SurveyEvaluation) -> Iterator[TruthView]:
    for (truth, method), group in groupby(evaluation.rows, key=lambda row: (row.truth, row.method)):
        rows = list(group)
        yield TruthView(
            name=truth_name(truth, method),
            walks=[row for row in rows if row.group == ALL and row.over == OVER_WALKS],
            points=[row for row in rows if row.group == ALL and row.over == OVER_POINTS],
            groups=[row for row in rows if row.group != ALL and row.over == OVER_WALKS],
            curves=cdf_figure(evaluation, truth, method),
            movement=movement_figure(evaluation, truth, method),
        )


def _lines(session: SessionEvaluation, strategies: Sequence[str]) -> Iterator[tuple[str, list[StrategyErrors | None]]]:
    """Yield a session's truths by name, and what each strategy shows against it."""
    for truth, method in dict.fromkeys((one.truth, one.method) for one in session.measured):
        here = {one.strategy: one for one in session.measured if (one.truth, one.method) == (truth, method)}
        yield truth_name(truth, method), [here.get(strategy) for strategy in strategies]
