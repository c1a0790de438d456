"""The landmark configuration, and the way from it to labelled readings."""

from __future__ import annotations

import matplotlib as mpl
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.figures.panels import (
    aspect_of,
    draw_control_points,
    draw_floor,
    draw_recording,
    draw_walk,
    extent_around,
    extent_of,
    legend_below,
    letter,
    panel_grid,
    show,
)
from vislam2tag.figures.style import PAGE_IN, colour_of, print_quality
from vislam2tag.survey.model import Floor, Site

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


@print_quality
def landmark_configuration(site: Site) -> Figure:
    """Draw every floor that has landmarks: its plan, the landmarks with their ids, the control points."""
    floors = [floor for floor in site.floors if len(site.landmarks.on_floor(floor.number).ids)]
    aspect = max((aspect_of(extent_of(floor, site.landmarks)) for floor in floors), default=1.0)
    figure, axes = panel_grid(len(floors), min(2, max(1, len(floors))), PAGE_IN, aspect)
    for one, floor in zip(axes, floors, strict=True):
        draw_floor(one, floor, site.landmarks, ids=True)
        if len(floor.control_points.ids):
            draw_control_points(one, floor)
    letter(axes, [f"Floor {floor.number}" for floor in floors])
    legend_below(figure, axes)
    return figure


@print_quality
def workflow(
    floor: Floor,
    landmarks: Landmarks,
    camera: CameraTrack,
    log: LandmarkLog,
    trajectory: Trajectory,
    wifi: pl.DataFrame,
) -> Figure:
    """Draw what becomes of a walk: landmarks surveyed, the walk recorded, mapped, its Wi-Fi readings labelled.

    ``wifi`` is the labelled table (see :func:`vislam2tag.labeling.tables.label_readings`).
    """
    figure, axes = panel_grid(4, 2, PAGE_IN, aspect_of(extent_of(floor, landmarks)))
    draw_floor(axes[0], floor, landmarks, ids=True)
    draw_recording(axes[1], camera, log)
    draw_floor(axes[2], floor, landmarks)
    draw_walk(axes[2], trajectory, colour_of("local-corrected"), "mapped, without what is discarded")
    draw_floor(axes[3], floor, landmarks)
    draw_scans(axes[3], wifi)
    legend_below(figure, axes, 6)
    letter(axes, ["Landmarks are placed and surveyed", "A walk is recorded", "It is mapped", "Readings are labelled"])
    return figure
