"""A registration drawn: where every point lies, how sure it is, and what its measurements are off by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.figures.panels import (
    aspect_of,
    draw_plan,
    extent_around,
    in_metres,
    legend_below,
    panel_grid,
    show,
)
from vislam2tag.figures.style import LANDMARK, PAGE_IN, QUIET, TRUTH, print_quality
from vislam2tag.preparation.registration.record import PositionSource, RegisteredPoint, Registration, Residual
from vislam2tag.site.model import Floor

REGION_95 = 5.991
"""Squared Mahalanobis distance in the plane that holds 95 %."""
_LONGEST_SHARE = 0.08
"""Length of the longest arrow, of the plan's longer side."""
_COLOURS = {PositionSource.STATION: LANDMARK, PositionSource.TAPE: "#009e73", PositionSource.CLICK: "#cc79a7"}
_ODD_SIGMAS = 3.0


@print_quality
def residual_figure(floor: Floor, found: Registration) -> Figure:
    """Draw points with their 95 % regions and residuals on the plan, magnified, and all residuals in sigmas."""
    points = [*found.landmarks, *found.control_points]
    places = np.array([(one.x_m, one.y_m) for one in points], dtype=np.float64).reshape(-1, 2)
    extent = _extent(floor, places)
    figure, (plan, bars) = panel_grid(2, 2, PAGE_IN, aspect_of(extent))
    draw_plan(plan, floor)
    magnified = _draw_points(plan, points, places, extent)
    longer = _draw_arrows(plan, found.residuals, extent)
    in_metres(plan)
    show(plan, extent)
    plan.set_title(f"95 % regions {magnified:g} times, residuals {longer:g} times as large", loc="left")
    _draw_residuals(bars, (*found.residuals, *found.tape_residuals))
    legend_below(figure, [plan, bars])
    return figure


def _extent(floor: Floor, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    if floor.extent_m is not None:
        left, right, low, high = floor.extent_m
        return np.array((left, low)), np.array((right, high))
    return extent_around(places) if len(places) else (np.zeros(2), np.ones(2))


def _draw_points(
    axes: Axes, points: Sequence[RegisteredPoint], places: FloatArray, extent: tuple[FloatArray, FloatArray]
) -> float:
    """Draw the points by source with their regions; return by how much those are magnified (a round number)."""
    if not points:
        return 1.0
    values, vectors = np.linalg.eigh(np.array([one.covariance_m2 for one in points]))
    axes_m = 2 * np.sqrt(REGION_95 * values)
    magnified = _magnified(float(np.median(axes_m.max(axis=1))), extent)
    turn = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    colours = [_COLOURS[one.source] for one in points]
    regions = EllipseCollection(
        (axes_m[:, 1] * magnified).tolist(),
        (axes_m[:, 0] * magnified).tolist(),
        turn.tolist(),
        units="xy",
        offsets=places,
        offset_transform=axes.transData,
        facecolors="none",
        edgecolors=colours,
        linewidths=0.6,
        zorder=3,
    )
    axes.add_collection(regions)
    for source, colour in _COLOURS.items():
        some = np.array([one.source is source for one in points])
        if some.any():
            axes.plot(*places[some].T, "s", color=colour, markersize=2.5, zorder=4, label=f"by {source.value}")
    for one, (x, y) in zip(points, places.tolist(), strict=True):
        axes.annotate(one.point, (x, y), xytext=(3, 3), textcoords="offset points", zorder=5)
    return magnified


def _magnified(length_m: float, extent: tuple[FloatArray, FloatArray]) -> float:
    """The greatest of 1, 2, 5, 10, ... by which a length stays a small share of the plan."""
    wanted = _LONGEST_SHARE * float(np.max(extent[1] - extent[0])) / max(length_m, 1e-9)
    power = 10.0 ** np.floor(np.log10(max(wanted, 1.0)))
    return float(power * max(step for step in (1, 2, 5) if step * power <= max(wanted, 1.0)))


def _draw_arrows(axes: Axes, residuals: Sequence[Residual], extent: tuple[FloatArray, FloatArray]) -> float:
    """Draw what each shot and known point is off by, from where its point lies; return how much magnified."""
    arrows = np.array([(*one.at_m, *one.by_m) for one in residuals if one.at_m and one.by_m]).reshape(-1, 4)
    if not len(arrows):
        return 1.0
    magnified = _magnified(float(np.hypot(*arrows[:, 2:].T).max()), extent)
    by_m = arrows[:, 2:] * magnified
    axes.quiver(*arrows[:, :2].T, *by_m.T, angles="xy", scale_units="xy", scale=1, width=0.002, color=TRUTH, zorder=6)
    axes.plot([], [], color=TRUTH, linewidth=0.8, label="residual")
    return magnified


def _draw_residuals(axes: Axes, residuals: Sequence[Residual]) -> None:
    """Draw how often residuals are how large, in sigmas, beside where measurements begin to be odd."""
    sigmas = np.abs([one.sigmas for one in residuals])
    axes.hist(
        sigmas, bins=np.arange(0, max(_ODD_SIGMAS + 1, sigmas.max(initial=0.0) + 0.5), 0.25).tolist(), color=QUIET
    )
    axes.axvline(_ODD_SIGMAS, color=LANDMARK, linewidth=0.8, linestyle="--", label="3 sigmas")
    axes.set_xlabel("residual / its standard deviation")
    axes.set_ylabel("measurements kept")
    axes.set_title("Residuals", loc="left")
