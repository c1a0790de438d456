"""The Plotly figures on how true the stated uncertainty is, and what a limit on it costs and brings."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from vislam2tag.core.arrays import FloatArray
from vislam2tag.evaluation.reliability import CoverageCurve, ReliabilityCurve
from vislam2tag.views.floor_map.figures import axis, figure_json, page_layout

_BLUE, _ORANGE, _GREY = "#0072b2", "#d55e00", "#8c959f"


def reliability_figure(curve: ReliabilityCurve) -> str:
    """Return, as JSON, the observed against the stated share of errors inside a region, in percent."""
    figure = go.Figure(layout_template="none")
    figure.add_scatter(
        x=[0, 100], y=[0, 100], mode="lines", name="true uncertainty", line={"color": _GREY, "dash": "dash"}
    )
    figure.add_scatter(
        x=_percent(curve.stated),
        y=_percent(curve.observed),
        mode="lines",
        name="these labels",
        line={"color": _BLUE, "width": 3},
        hovertemplate="%{y:.1f} % of the errors lie inside<br>the stated %{x:.0f} % region<extra></extra>",
    )
    for text, x, y in (("too cautious", 20, 90), ("too sure", 80, 10)):
        figure.add_annotation(x=x, y=y, text=text, showarrow=False, font={"color": _GREY})
    figure.update_layout(page_layout())
    figure.update_xaxes(axis("stated region / %", [0, 100], grid=True), fixedrange=True)
    figure.update_yaxes(axis("errors inside / %", [0, 100], grid=True), fixedrange=True)
    return figure_json(figure)


def coverage_figure(curve: CoverageCurve, limit_m: float) -> str:
    """Return, as JSON, mean and 95th percentile of the errors against the share labelled; a mark at the limit set."""
    figure = go.Figure(layout_template="none")
    labelled = _percent(curve.labelled)
    limits = ["no sigma stated" if np.isnan(limit) else f"sigma up to {limit:.2f} m" for limit in curve.max_sigma_m]
    for name, errors, colour in (("mean", curve.mean_m, _BLUE), ("95th percentile", curve.p95_m, _ORANGE)):
        figure.add_scatter(
            x=labelled,
            y=np.round(errors, 4).tolist(),
            hovertext=limits,
            mode="lines+markers",
            marker={"size": 5},
            name=name,
            line={"color": colour, "width": 2},
            hovertemplate=f"{name} %{{y:.2f}} m<br>%{{x:.1f}} % labelled<br>%{{hovertext}}<extra></extra>",
        )
    within = np.flatnonzero(~(curve.max_sigma_m > limit_m))
    if len(within) and np.isfinite(limit_m):
        at = labelled[int(within[-1])]
        line = {"color": _GREY, "dash": "dot"}
        figure.add_vline(x=at, line=line, annotation_text=f"limit {limit_m:g} m", annotation_position="top left")
    figure.update_layout(page_layout())
    figure.update_xaxes(axis("share of true points labelled / %", [0, 102], grid=True), fixedrange=True)
    figure.update_yaxes(axis("error / m", None, grid=True), fixedrange=True, rangemode="tozero")
    return figure_json(figure)


def _percent(shares: FloatArray) -> list[float]:
    return [round(100 * share, 2) for share in shares.tolist()]
