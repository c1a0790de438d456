"""How errors are distributed, with intervals over walks, and what share of labels they are bought with."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from vislam2tag.evaluation.error_curves import ErrorCurve
from vislam2tag.evaluation.reliability import CoverageCurve
from vislam2tag.figures.panels import legend_below, log_metres, panel_grid
from vislam2tag.figures.style import COLUMN_IN, colour_of, name_of, print_quality

LEAST_SHARE = 0.05
"""The surest few labels of all say little: curves begin with this share."""


@print_quality
def error_distributions(curves: Mapping[str, ErrorCurve]) -> Figure:
    """Draw the share of all true points whose label is no farther off than a limit, by strategy, with its bounds.

    The ends of the curves are the shares labelled.
    """
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for strategy, curve in curves.items():
        colour, end = colour_of(strategy), f"{100 * curve.share[-1]:.0f} % labelled"
        axes.plot(curve.error_m, curve.share, color=colour, label=f"{name_of(strategy)} ({end})")
        if curve.low is not None and curve.high is not None:
            axes.fill_between(curve.error_m, curve.low, curve.high, color=colour, alpha=0.18, linewidth=0)
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="error / m", ylabel="share of all true points")
    log_metres(axes.xaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.legend(loc="best")
    return figure


@print_quality
def coverage_accuracy(curves: Mapping[str, CoverageCurve]) -> Figure:
    """Draw mean and 95th percentile of the errors against the share labelled, as the limit of sigma rises.

    A strategy that states no sigma is a point.
    """
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for strategy, curve in curves.items():
        shown = curve.labelled >= min(LEAST_SHARE, curve.labelled[-1])
        marker = "o" if shown.sum() == 1 else ""
        for values, style, fill, what in ((curve.mean_m, "-", "full", "mean"), (curve.p95_m, "--", "none", "95 %")):
            line = axes.plot(curve.labelled[shown], values[shown], style, color=colour_of(strategy), marker=marker)
            line[0].set(fillstyle=fill, markersize=3.5, label=f"{name_of(strategy)}, {what}")
    axes.set(xlim=(0, 1.02), yscale="log", xlabel="share labelled", ylabel="error / m")
    log_metres(axes.yaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    legend_below(figure, [axes], 2)
    return figure
