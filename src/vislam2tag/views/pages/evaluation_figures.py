"""The Plotly figures of an evaluation's page: errors as curves, against landmark movement, and against distance."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import plotly.graph_objects as go

from vislam2tag.evaluation.dense import SINCE_LANDMARK
from vislam2tag.evaluation.point_errors import TruthKind
from vislam2tag.evaluation.pooling import ErrorCurve, error_curve
from vislam2tag.evaluation.record import SessionEvaluation, StrategyErrors, SurveyEvaluation
from vislam2tag.views.floor_map.figures import axis, figure_json, page_layout
from vislam2tag.views.floor_map.layers import plotly_text

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#4d4d4d")
"""Okabe and Ito's, one for each strategy in turn."""
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def cdf_figure(evaluation: SurveyEvaluation, truth: TruthKind, method: str) -> str:
    """Return, as JSON, each strategy's share of points with an error up to a length, with bands."""
    figure = _figure()
    for number, strategy in enumerate(evaluation.strategies):
        walks = [one for _, one in _measured(evaluation, truth, method, strategy)]
        curve = error_curve(walks) if walks else None
        if curve is not None:
            _add_curve(figure, curve, strategy, number)
    figure.update_xaxes(axis("error / m", None, grid=True), type="log")
    figure.update_yaxes(axis("share of all points", [0.0, 1.0], grid=True), tickformat=".0%")
    return figure_json(figure)


def _add_curve(figure: go.Figure, curve: ErrorCurve, strategy: str, number: int) -> None:
    colour = COLOURS[number % len(COLOURS)]
    x = np.round(curve.error_m, 5).tolist()
    if curve.low is not None and curve.high is not None:
        figure.add_scatter(
            x=x + x[::-1],
            y=_rounded([*curve.high, *curve.low[::-1]]),
            fill="toself",
            mode="none",
            fillcolor=colour,
            opacity=0.15,
            hoverinfo="skip",
            showlegend=False,
            legendgroup=strategy,
        )
    figure.add_scatter(
        x=x,
        y=_rounded(curve.share),
        name=plotly_text(strategy),
        legendgroup=strategy,
        mode="lines",
        line={"color": colour, "width": 2.2, "dash": DASHES[number % len(DASHES)]},
        hovertemplate="%{y:.1%} within %{x:.2f} m",
    )


def movement_figure(evaluation: SurveyEvaluation, truth: TruthKind, method: str) -> str | None:
    """Return, as JSON, each walk's mean error against the movement of its landmarks; None where no walk tells."""
    figure = _figure()
    for number, strategy in enumerate(evaluation.strategies):
        pairs = [
            (session, one.mean_m)
            for session, one in _measured(evaluation, truth, method, strategy)
            if one.mean_m is not None and session.movement_m is not None
        ]
        if pairs:
            figure.add_scatter(
                x=[session.movement_m for session, _ in pairs],
                y=[mean for _, mean in pairs],
                text=[plotly_text(f"floor {s.floor} / {s.device} / {s.session}") for s, _ in pairs],
                name=plotly_text(strategy),
                mode="markers",
                marker={"color": COLOURS[number % len(COLOURS)], "size": 8, "symbol": number, "opacity": 0.8},
                hovertemplate="%{text}<br>moved %{x:.2f} m, error %{y:.2f} m",
            )
    figure.update_xaxes(axis("mean displacement of landmarks / m", None, grid=True), rangemode="tozero")
    figure.update_yaxes(axis("mean error of the walk / m", None, grid=True), rangemode="tozero")
    return figure_json(figure) if figure.data else None


def drift_figure(evaluation: SurveyEvaluation) -> str | None:
    """Return, as JSON, the mean error by the distance walked since the last landmark; None without dense truth."""
    figure = _figure()
    for number, strategy in enumerate(evaluation.strategies):
        rows = [row for row in evaluation.dense if (row.strategy, row.what) == (strategy, SINCE_LANDMARK)]
        if rows:
            figure.add_scatter(
                x=[f"{row.low:g} to {row.high:g}" if row.high is not None else f"over {row.low:g}" for row in rows],
                y=[row.mean_m for row in rows],
                name=plotly_text(strategy),
                mode="lines+markers",
                line={"color": COLOURS[number % len(COLOURS)], "dash": DASHES[number % len(DASHES)]},
                hovertemplate="%{x} m: %{y:.2f} m",
            )
    figure.update_xaxes(axis("distance walked since the last landmark / m", None, grid=False), type="category")
    figure.update_yaxes(axis("mean error / m", None, grid=True), rangemode="tozero")
    return figure_json(figure) if figure.data else None


def _measured(
    evaluation: SurveyEvaluation, truth: TruthKind, method: str, strategy: str
) -> list[tuple[SessionEvaluation, StrategyErrors]]:
    return [
        (session, one)
        for session in evaluation.sessions
        for one in session.measured
        if (one.truth, one.method, one.strategy) == (truth, method, strategy)
    ]


def _figure() -> go.Figure:
    figure = go.Figure(layout_template="none")
    return figure.update_layout(page_layout(), hovermode="closest", dragmode="zoom")


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(float(value), 5) for value in values]
