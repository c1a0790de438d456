"""The report's section on uncertainty: sigma of labels, its calibration, and causes of errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from vislam2tag.common.error_statistics import FEWEST_WALKS
from vislam2tag.common.palette import EVENT_STYLES, EventStyle
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import EventKind
from vislam2tag.labeling.results import ErrorRecord, Summary
from vislam2tag.quality.evaluation.reliability import (
    CoverageCurve,
    ReliabilityCurve,
    Verdict,
    coverage_curve,
    reliability_curve,
    verdict,
)
from vislam2tag.quality.evaluation.truth import CONTROL_POINTS
from vislam2tag.views.layers import BLUE, GREY, VERMILION, Trace, axis, chart, figure_json, scatter


def uncertainty(summary: Summary, limit_m: float) -> dict[str, Any]:
    """Uncertainty, errors, events and contradictions of a whole run, for the report's template.

    ``limit_m`` is the sigma above which a frame or reading is uncertain; it may be infinite. ``coverage`` is None if
    no true point has a label.
    """
    errors = summary.errors
    coverage = coverage_curve(errors) if errors else None
    reliability = reliability_curve(errors) if errors else None
    figures = []
    if reliability is not None:
        figures.append(("Reliability: predicted and observed errors", reliability_figure(reliability)))
    if coverage is not None and errors is not None and any(errors.inside):
        title = "Coverage and accuracy for each limit of sigma"
        figures.append((title, coverage_figure(coverage, limit_m)))
    observed = None if reliability is None else reliability.observed
    return {
        "limit_m": limit_m,
        "coverage": coverage,
        "figures": figures,
        "verdict": "" if errors is None or not any(errors.inside) else _verdict(errors, reliability),
        "at_nearest_points": errors is not None and CONTROL_POINTS in errors.sources,
        "inside": [] if observed is None else [(percent, float(observed[percent - 1])) for percent in (68, 95)],
        "events": [(style, summary.events[kind]) for kind, style in EVENT_STYLES.items() if summary.events.get(kind)],
    }


_JUDGED = {Verdict.ABOUT_TRUE: "about right", Verdict.TOO_SURE: "too small", Verdict.TOO_CAUTIOUS: "too large"}


def _verdict(errors: ErrorRecord, reliability: ReliabilityCurve | None) -> str:
    """Judgement of the predicted sigmas, as a sentence."""
    if reliability is None:
        return (
            "These points cannot verify the predicted sigmas, because the ground truth is less exact than the labels "
            "claim to be. Use a total station, or a truth.csv of the whole walk."
        )
    judged = verdict(errors)
    if judged is None:
        return f"Fewer than {FEWEST_WALKS} walks are too few to verify the predicted sigmas."
    size = f"{reliability.times_as_large:.2f} times as large as predicted"
    return f"Errors are {size}: the predicted sigmas are {_JUDGED[judged]}."


def event_style(kind: EventKind) -> EventStyle:
    """Return the style of a kind of event."""
    return EVENT_STYLES[kind]


def reliability_figure(curve: ReliabilityCurve) -> str:
    """Return, as JSON, the observed against the predicted share of errors inside a region, in percent."""
    traces = [
        scatter("lines", "correct uncertainty", x=[0, 100], y=[0, 100], line={"color": GREY, "dash": "dash"}),
        scatter(
            "lines",
            "these labels",
            None,
            "%{y:.1f} % of the errors are inside<br>the predicted %{x:.0f} % region",
            x=_percent(curve.stated),
            y=_percent(curve.observed),
            line={"color": BLUE, "width": 3},
        ),
    ]
    x = axis("predicted region / %", [0, 100], fixedrange=True)
    figure = chart(traces, x, axis("errors inside / %", [0, 100], fixedrange=True))
    for text, at, up in (("too cautious", 20, 90), ("too confident", 80, 10)):
        figure.add_annotation(x=at, y=up, text=text, showarrow=False, font={"color": GREY})
    return figure_json(figure)


def coverage_layers(
    curve: CoverageCurve,
    called: str = "",
    colours: tuple[str, str] = (BLUE, VERMILION),
    dashes: tuple[str, str] = ("solid", "solid"),
) -> list[Trace]:
    """Mean and 95th percentile of the errors against the share labelled in percent."""
    limits = ["no sigma" if np.isnan(limit) else f"sigma up to {limit:.2f} m" for limit in curve.max_sigma_m]
    errors = ((f"{called}mean", curve.mean_m), (f"{called}95th percentile", curve.p95_m))
    return [
        scatter(
            "lines+markers",
            name,
            None,
            f"{name} %{{y:.2f}} m<br>%{{x:.1f}} % labelled<br>%{{hovertext}}",
            x=_percent(curve.labelled),
            y=np.round(error_m, 4).tolist(),
            hovertext=limits,
            marker={"size": 5},
            line={"color": colour, "width": 2, "dash": dash},
        )
        for (name, error_m), colour, dash in zip(errors, colours, dashes, strict=True)
    ]


COVERAGE_AXIS = axis("share of true points labelled / %", [0, 102], fixedrange=True)


def coverage_figure(curve: CoverageCurve, limit_m: float) -> str:
    """Return, as JSON, mean and 95th percentile of the errors against the share labelled, with a mark at the limit."""
    figure = chart(coverage_layers(curve), COVERAGE_AXIS, axis("error / m", fixedrange=True, rangemode="tozero"))
    within = np.flatnonzero(~(curve.max_sigma_m > limit_m))
    if len(within) and np.isfinite(limit_m):
        at = _percent(curve.labelled)[int(within[-1])]
        line = {"color": GREY, "dash": "dot"}
        figure.add_vline(x=at, line=line, annotation_text=f"limit {limit_m:g} m", annotation_position="top left")
    return figure_json(figure)


def _percent(shares: FloatArray) -> list[float]:
    return [round(100 * share, 2) for share in shares.tolist()]
