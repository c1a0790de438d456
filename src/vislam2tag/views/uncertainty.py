"""The report's section on uncertainty: how sure labels are, whether that is true, what caused errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.common.bootstrap import FEWEST_WALKS
from vislam2tag.common.palette import EVENT_STYLES, EventStyle
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.faults import EventKind
from vislam2tag.labeling.results import Summary
from vislam2tag.quality.evaluation.reliability import (
    CoverageCurve,
    ReliabilityCurve,
    coverage_curve,
    reliability_curve,
    verdict,
)
from vislam2tag.quality.evaluation.truth import CONTROL_POINTS
from vislam2tag.views.layers import BLUE, GREY, VERMILION, axis, chart, figure_json, scatter


@dataclass(frozen=True)
class UncertaintyView:
    """Uncertainty, errors, events and contradictions of a whole run."""

    summary: Summary
    limit_m: float
    """Sigma above which a frame or reading is uncertain, metres; may be infinite."""

    @cached_property
    def coverage(self) -> CoverageCurve | None:
        """Errors against the share labelled; None where no true point has a label."""
        return coverage_curve(self.summary.errors) if self.summary.errors else None

    @cached_property
    def reliability(self) -> ReliabilityCurve | None:
        """Observed against stated shares; None where there is no truth or no stated uncertainty."""
        return reliability_curve(self.summary.errors) if self.summary.errors else None

    @property
    def figures(self) -> list[tuple[str, str]]:
        """Each figure as Plotly's JSON with what it shows."""
        figures = []
        if self.reliability is not None:
            title = "Reliability: is the stated uncertainty true?"
            figures.append((title, reliability_figure(self.reliability)))
        if self.coverage is not None and self.summary.errors is not None and any(self.summary.errors.inside):
            title = "Coverage and accuracy: what a limit on sigma costs and brings"
            figures.append((title, coverage_figure(self.coverage, self.limit_m)))
        return figures

    @property
    def verdict(self) -> str:
        """What to think of the stated sigmas, as a sentence; empty where no truth is known."""
        if self.summary.errors is None or not any(self.summary.errors.inside):
            return ""
        if self.reliability is None:
            return (
                "Whether the stated sigmas are true cannot be told here: this truth is itself less exact than the "
                "labels say they are. A total station, or a truth.csv of the whole walk, would tell."
            )
        judged = verdict(self.summary.errors)
        if judged is None:
            return f"Fewer than {FEWEST_WALKS} walks: too few to tell whether the stated sigmas are true."
        factor = f"{self.reliability.times_as_large:.2f} times as large as stated"
        return f"So errors are {factor}: the stated sigmas are {judged}."

    @property
    def at_nearest_points(self) -> bool:
        """Whether errors are, at least in part, distances to the nearest control point."""
        return self.summary.errors is not None and CONTROL_POINTS in self.summary.errors.sources

    @property
    def inside(self) -> list[tuple[int, float]]:
        """Percent of the 68 % and of the 95 % region, each with the share of errors inside."""
        curve = self.reliability
        return [] if curve is None else [(percent, float(curve.observed[percent - 1])) for percent in (68, 95)]

    @property
    def events(self) -> list[tuple[EventStyle, int]]:
        """Kinds of events that occurred, with their number."""
        return [
            (style, self.summary.events[kind]) for kind, style in EVENT_STYLES.items() if self.summary.events.get(kind)
        ]


def event_style(kind: EventKind) -> EventStyle:
    """Return the style of a kind of event."""
    return EVENT_STYLES[kind]


def reliability_figure(curve: ReliabilityCurve) -> str:
    """Return, as JSON, the observed against the stated share of errors inside a region, in percent."""
    traces = [
        scatter("lines", "true uncertainty", x=[0, 100], y=[0, 100], line={"color": GREY, "dash": "dash"}),
        scatter(
            "lines",
            "these labels",
            None,
            "%{y:.1f} % of the errors lie inside<br>the stated %{x:.0f} % region",
            x=_percent(curve.stated),
            y=_percent(curve.observed),
            line={"color": BLUE, "width": 3},
        ),
    ]
    x = axis("stated region / %", [0, 100], fixedrange=True)
    figure = chart(traces, x, axis("errors inside / %", [0, 100], fixedrange=True))
    for text, at, up in (("too cautious", 20, 90), ("too sure", 80, 10)):
        figure.add_annotation(x=at, y=up, text=text, showarrow=False, font={"color": GREY})
    return figure_json(figure)


def coverage_figure(curve: CoverageCurve, limit_m: float) -> str:
    """Return, as JSON, mean and 95th percentile of the errors against the share labelled; a mark at the limit set."""
    labelled = _percent(curve.labelled)
    limits = ["no sigma stated" if np.isnan(limit) else f"sigma up to {limit:.2f} m" for limit in curve.max_sigma_m]
    traces = [
        scatter(
            "lines+markers",
            name,
            None,
            f"{name} %{{y:.2f}} m<br>%{{x:.1f}} % labelled<br>%{{hovertext}}",
            x=labelled,
            y=np.round(errors, 4).tolist(),
            hovertext=limits,
            marker={"size": 5},
            line={"color": colour, "width": 2},
        )
        for name, errors, colour in (("mean", curve.mean_m, BLUE), ("95th percentile", curve.p95_m, VERMILION))
    ]
    x = axis("share of true points labelled / %", [0, 102], fixedrange=True)
    figure = chart(traces, x, axis("error / m", fixedrange=True, rangemode="tozero"))
    within = np.flatnonzero(~(curve.max_sigma_m > limit_m))
    if len(within) and np.isfinite(limit_m):
        at = labelled[int(within[-1])]
        line = {"color": GREY, "dash": "dot"}
        figure.add_vline(x=at, line=line, annotation_text=f"limit {limit_m:g} m", annotation_position="top left")
    return figure_json(figure)


def _percent(shares: FloatArray) -> list[float]:
    return [round(100 * share, 2) for share in shares.tolist()]
