"""Positioning models compared: errors, where they are made, floors confused, and how true radii are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, to_hex
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.places import NINETY_FIVE, SIXTY_EIGHT
from vislam2tag.site.model import Floor
from vislam2tag.views.panels import (
    COLUMN_IN,
    DISCARDED,
    PAGE_IN,
    QUIET,
    extent_around,
    floor_panels,
    legend_below,
    letter,
    log_metres,
    panel_grid,
    print_quality,
)

ERROR_SCALE_M = (0.5, 20.0)
"""Ends of the colours of errors on the plan."""
GOOD = {SIXTY_EIGHT: (0.60, 0.76), NINETY_FIVE: (0.90, 0.985)}
"""Shares of true places within the radii that count as calibrated."""
BINS = 10
"""Groups of scans, by stated radius, whose errors are compared with it."""
_LEAST_SHOWN_M = 0.1
_DASHES = ("-", "--", "-.", ":")
_MANY_FLOORS = 8
"""Cells of a confusion matrix hold numbers up to so many floors."""


@dataclass(frozen=True)
class ErrorFloor:
    """What is drawn of a floor: its plan and its scans' predictions, with errors."""

    title: str
    floor: Floor
    predictions: pl.DataFrame


def _look(number: int) -> tuple[str, str]:
    """Colour and dash of the model with this number."""
    colours = [to_hex(colour) for colour in colormaps["tab10"].colors]  # type: ignore[attr-defined]
    return colours[number % len(colours)], _DASHES[number // len(colours) % len(_DASHES)]


@print_quality
def error_distributions_by_model(errors_m: Mapping[str, FloatArray]) -> Figure:
    """Draw the share of all scans (n,) whose position is no farther off than a limit, by model.

    NaN is a scan without answer: the ends of the curves are the shares answered.
    """
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    greatest = 1.0
    for number, (model, error_m) in enumerate(errors_m.items()):
        known = np.sort(error_m[np.isfinite(error_m)])
        colour, dash = _look(number)
        share = np.arange(1, len(known) + 1) / max(len(error_m), 1)
        axes.step(np.maximum(known, _LEAST_SHOWN_M), share, dash, where="post", color=colour, label=model)
        greatest = max([greatest, *known[-1:]])
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="error in the plane / m", ylabel="share of all scans")
    axes.set_xlim(max(_LEAST_SHOWN_M, greatest / 1000), greatest)
    log_metres(axes.xaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.legend()
    return figure


@print_quality
def error_map(floors: Sequence[ErrorFloor]) -> Figure:
    """Draw each scan where it was taken, coloured by its error, joined to where it was found; crosses: wrong floor."""
    points = pl.concat([floor.predictions for floor in floors])
    extent = _shared_extent(floors, points)
    titles = [floor.title for floor in floors]
    figure, axes = floor_panels([floor.floor for floor in floors], [extent] * len(floors), titles, extra_in=0.4)
    norm = LogNorm(*ERROR_SCALE_M, clip=True)
    for one, floor in zip(axes, floors, strict=True):
        _draw_errors(one, floor.predictions, norm)
        one.label_outer()
    bar = figure.colorbar(ScalarMappable(norm, "viridis_r"), ax=axes, label="error in the plane / m", shrink=0.6)
    log_metres(bar.ax.yaxis)
    legend_below(figure, axes)
    return figure


def _shared_extent(floors: Sequence[ErrorFloor], points: pl.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Around the plans and the true places of all floors."""
    plans = [corner for floor in floors for corner in floor.floor.corners_m]
    low, high = extent_around(points.select("x", "y").to_numpy())
    return np.min([low, *plans], axis=0), np.max([high, *plans], axis=0)


def _draw_errors(axes: Axes, predictions: pl.DataFrame, norm: LogNorm) -> None:
    known = predictions.filter(pl.col("error_m").is_not_null()).sort("error_m")
    right, wrong = known.filter("on_floor"), known.filter(~pl.col("on_floor"))
    pairs = right.select("x", "y", "found_x", "found_y").to_numpy().reshape(-1, 2, 2)
    gaps = np.concatenate([pairs, np.full((len(pairs), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    axes.plot(*gaps.T, color=QUIET, linewidth=0.25, alpha=0.6, zorder=3, rasterized=True)
    for marker, part, size, what in (("o", right, 3.0, "scan"), ("x", wrong, 8.0, "scan put on another floor")):
        look: dict[str, Any] = {"s": size, "marker": marker, "linewidths": 0.7 if marker == "x" else 0.0}
        axes.scatter(part["x"], part["y"], c=part["error_m"], norm=norm, cmap="viridis_r", zorder=5, **look)
        axes.collections[-1].set_rasterized(True)
        axes.scatter([], [], color=QUIET, label=what, **look)
    unanswered = predictions.filter(pl.col("error_m").is_null())
    if unanswered.height:
        axes.plot(unanswered["x"], unanswered["y"], "+", color=DISCARDED, markersize=3, zorder=5, label="no answer")


@print_quality
def floor_confusion(storeys: Sequence[str], counts: Mapping[str, FloatArray]) -> Figure:
    """Draw by model which storeys (s) are taken for which: shares of the scans of each true storey (s, s), in rows."""
    columns = min(3, len(counts))
    figure, axes = panel_grid(len(counts), columns, PAGE_IN, 0.9, extra_in=0.3)
    for one, matrix in zip(axes, counts.values(), strict=True):
        share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        image = one.imshow(share, cmap="Blues", vmin=0, vmax=1)
        ticks = np.arange(len(storeys))
        one.set_xticks(ticks, storeys, rotation=90 if max(map(len, storeys)) > 2 else 0)
        one.set_yticks(ticks, storeys)
        one.set(xlabel="found", ylabel="true")
        _write_shares(one, share, matrix)
    letter(axes, list(counts))
    figure.colorbar(image, ax=axes, label="share of the true floor's scans", shrink=0.7)
    return figure


def _write_shares(axes: Axes, share: FloatArray, matrix: FloatArray) -> None:
    """Write percent into the cells that hold any scan."""
    if len(share) > _MANY_FLOORS:
        return
    for row, column in np.argwhere(matrix > 0):
        colour = "white" if share[row, column] > 0.5 else "black"
        text = f"{100 * share[row, column]:.1f}"
        axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=5.5)


@print_quality
def calibration(predictions: Mapping[str, pl.DataFrame]) -> Figure:
    """Draw by model how many true places lie within the stated radii, and whether errors grow with the radius.

    On the left the shares within both radii, and the ranges that count as calibrated; on the right scans in groups of
    like radius: the error that 68 % of a group stay below against the mean radius stated for 68 %.
    """
    figure, (left, right) = panel_grid(2, 2, PAGE_IN, 0.7)
    greatest, least = 1.0, np.inf
    for number, (model, table) in enumerate(predictions.items()):
        stated = table.drop_nulls(["error_m", "radius_68_m", "radius_95_m"])
        if stated.is_empty():
            continue
        colour, dash = _look(number)
        for column, marker in (("radius_68_m", "o"), ("radius_95_m", "s")):
            share = float((stated["error_m"] <= stated[column]).mean())  # type: ignore[arg-type]
            left.plot(share, number, marker, color=colour, markersize=4)
        radius_m, error_m = _by_radius(stated)
        right.plot(radius_m, error_m, dash, color=colour, marker=".", markersize=4, label=model)
        greatest, least = max(greatest, radius_m.max(), error_m.max()), min(least, radius_m.min(), error_m.min())
    for share, (low, high) in GOOD.items():
        left.axvspan(low, high, color=QUIET, alpha=0.2, linewidth=0)
        left.axvline(share, color=QUIET, linewidth=0.6)
    left.set_yticks(range(len(predictions)), list(predictions))
    left.set(xlim=(min(0.4, left.get_xlim()[0]), 1.01), ylim=(len(predictions) - 0.5, -0.5))
    left.set_xlabel("share of true places within the stated radius")
    ends = np.array([min(max(least, _LEAST_SHOWN_M), greatest) / 1.2, greatest * 1.2])
    right.plot(ends, ends, color=QUIET, linewidth=0.6, zorder=1)
    right.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    right.set(xlabel="stated radius of 68 % / m", ylabel="error that 68 % stay below / m")
    log_metres(right.xaxis)
    log_metres(right.yaxis)
    right.legend()
    letter([left, right], ["68 % (dots) and 95 % (squares)", "by stated radius"])
    return figure


def _by_radius(stated: pl.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Mean radius and 68 % quantile of the errors of scans in groups (at most BINS) of rising radius."""
    ordered = stated.sort("radius_68_m")
    groups = [part for part in np.array_split(np.arange(ordered.height), BINS) if len(part)]
    radius_m, error_m = ordered["radius_68_m"].to_numpy(), ordered["error_m"].to_numpy()
    return (
        np.array([radius_m[part].mean() for part in groups]),
        np.maximum([np.quantile(error_m[part], SIXTY_EIGHT) for part in groups], _LEAST_SHOWN_M),
    )
