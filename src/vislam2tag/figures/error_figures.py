"""Labels against truth on the floor, and errors against what they come from."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.figures.panels import (
    aspect_of,
    draw_control_points,
    draw_floor,
    draw_walk,
    extent_around,
    extent_of,
    legend_below,
    letter,
    log_metres,
    panel_grid,
    show,
)
from vislam2tag.figures.style import COLUMN_IN, PAGE_IN, TRUTH, colour_of, name_of, print_quality
from vislam2tag.quality.evaluation.metrics import ErrorCurve
from vislam2tag.quality.evaluation.reliability import CoverageCurve
from vislam2tag.quality.evaluation.truth import PointErrors
from vislam2tag.site.model import Floor


@print_quality
def control_point_errors(
    floor: Floor, landmarks: Landmarks, walks: Mapping[str, tuple[Trajectory, PointErrors]]
) -> Figure:
    """Draw one walk as mapped by several strategies (by name), its label at each press joined to the control point."""
    extent = extent_of(floor, landmarks)
    figure, axes = panel_grid(len(walks), min(2, len(walks)), PAGE_IN, aspect_of(extent))
    for one, (strategy, (trajectory, errors)) in zip(axes, walks.items(), strict=True):
        draw_floor(one, floor, landmarks)
        draw_control_points(one, floor)
        draw_walk(one, trajectory, colour_of(strategy), "walk", width=0.5)
        joined = np.stack((errors.truth_bcs, errors.label_bcs), axis=1)[errors.labelled]
        for pair in joined:
            one.plot(*pair.T, color=TRUTH, linewidth=0.7, zorder=5)
        one.plot(*errors.label_bcs.T, ".", color=TRUTH, markersize=2.5, zorder=5, label="label at a press")
        show(one, extent)
    legend_below(figure, axes[:1])
    letter(axes, [f"{name_of(name)}: {_mean(errors)}" for name, (_, errors) in walks.items()])
    return figure


def _mean(errors: PointErrors) -> str:
    return f"{errors.error_m[errors.labelled].mean():.2f} m" if errors.labelled.any() else "no label"


@print_quality
def error_by_landmark_movement(movement_m: FloatArray, errors_m: Mapping[str, FloatArray]) -> Figure:
    """Draw each walk's mean error (w,) by strategy against how far its landmarks moved (w,), metres."""
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for marker, (strategy, error_m) in zip("os^Dv", errors_m.items(), strict=False):
        axes.plot(
            movement_m, error_m, marker, color=colour_of(strategy), markersize=3.5, alpha=0.8, label=name_of(strategy)
        )
    axes.set(xscale="log", yscale="log", xlabel="mean movement of the logged landmarks / m", ylabel="mean error / m")
    log_metres(axes.xaxis)
    log_metres(axes.yaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.legend()
    return figure


@print_quality
def station_overlay(
    floor: Floor, landmarks: Landmarks, strategy: str, trajectory: Trajectory, errors: PointErrors
) -> Figure:
    """Draw a mapped walk over the total station's track, and below it the error over time."""
    extent = extent_around(errors.truth_bcs)
    figure = Figure(figsize=(PAGE_IN, 1.3 + PAGE_IN * np.clip(aspect_of(extent), 0.15, 0.8)), layout="constrained")
    plan, below = figure.subplots(2, 1, height_ratios=(2, 1))
    draw_floor(plan, floor, landmarks)
    plan.plot(*errors.truth_bcs.T, ".", color=TRUTH, markersize=3, zorder=2, label="total station")
    draw_walk(plan, trajectory, colour_of(strategy), name_of(strategy), width=0.8)
    show(plan, extent)
    plan.legend(loc="upper right", ncols=3)
    time_s = (errors.time_ns - errors.time_ns[0]) * 1e-9
    below.plot(time_s, errors.error_m, ".", color=colour_of(strategy), markersize=1.5)
    below.set(xlabel="time / s", ylabel="error / m", ylim=(0, None))
    return figure


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
