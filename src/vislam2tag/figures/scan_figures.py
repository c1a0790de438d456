"""Where single Wi-Fi scans were taken."""

from __future__ import annotations

import matplotlib as mpl
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vislam2tag.core.tracks import Landmarks
from vislam2tag.figures.panels import aspect_of, draw_floor, extent_around, legend_below, panel_grid, show
from vislam2tag.figures.style import PAGE_IN, print_quality
from vislam2tag.survey.model import Floor

_COLOURS = 10
"""Colours of the map ``tab10``; neighbouring scans never share one."""


@print_quality
def scan_labels(floor: Floor, landmarks: Landmarks, wifi: pl.DataFrame) -> Figure:
    """Draw the label of every reading of a walk, a colour for each scan, and each scan's mean.

    ``wifi`` is the labelled table with ``scan``, ``x`` and ``y`` (BCS, metres, null without a label); at least one
    reading has a label.
    """
    extent = extent_around(wifi.drop_nulls("x").select("x", "y").to_numpy())
    figure, (axes,) = panel_grid(1, 1, PAGE_IN, aspect_of(extent))
    draw_floor(axes, floor, landmarks)
    draw_scans(axes, wifi)
    show(axes, extent)
    legend_below(figure, [axes])
    return figure


def draw_scans(axes: Axes, wifi: pl.DataFrame) -> None:
    """Draw the labelled readings of a table as dots, and the mean of each scan as a star."""
    labelled = wifi.drop_nulls("x").sort("scan")
    rank = labelled["scan"].rank("dense").to_numpy().astype(int) - 1
    colours = mpl.colormaps["tab10"](rank % _COLOURS)
    axes.scatter(labelled["x"], labelled["y"], s=5, c=colours, linewidths=0, zorder=5, label="reading, by scan")
    means = labelled.group_by("scan", maintain_order=True).agg(pl.col("x", "y").mean())
    axes.plot(means["x"], means["y"], "*k", markersize=4, markeredgewidth=0, zorder=6, label="mean of a scan")
