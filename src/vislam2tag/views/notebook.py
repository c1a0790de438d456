"""Drawings for notebooks: ``plot`` of surveys, trajectories, data sets and radio maps."""

from __future__ import annotations

from functools import singledispatch

import matplotlib.pyplot as plt
import numpy as np
import polars as pl
from matplotlib.axes import Axes

from vislam2tag.common.errors import UsageError
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.radio_maps import FloorMaps
from vislam2tag.labeling.mapped_walk import MappedWalk
from vislam2tag.site.model import Survey
from vislam2tag.views.layers import VERMILION
from vislam2tag.views.panels import draw_plan, in_metres

OK, UNCERTAIN = "#0072b2", "#56b4e9"


def plot(value: object, floor: int | None = None, axes: Axes | None = None) -> Axes:
    """Draw a value into ``axes``, or new ones, and return them; see :meth:`vislam2tag.core.notebook.Drawable.plot`."""
    drawn = plt.subplots()[1] if axes is None else axes
    _draw(value, drawn, floor)
    in_metres(drawn)
    drawn.set_aspect("equal")
    return drawn


@singledispatch
def _draw(value: object, _: Axes, __: int | None) -> None:
    raise TypeError(f"{type(value).__name__} cannot be drawn")


@_draw.register
def _trajectory(value: Trajectory, axes: Axes, floor: int | None) -> None:
    here = np.ones(len(value.status), dtype=np.bool_) if floor is None or not len(value.floor) else value.floor == floor
    for status, colour in ((Status.OK, OK), (Status.UNCERTAIN, UNCERTAIN)):
        shown = here & (value.status == status)
        if shown.any():
            line = np.where(shown[:, None], value.position_bcs[:, :2], np.nan)
            axes.plot(*line.T, color=colour, linewidth=1.2, label=status.label)
    axes.legend()


@_draw.register
def _survey(value: Survey, axes: Axes, floor: int | None) -> None:
    numbers = [one.number for one in value.site.floors]
    number = _chosen(floor, numbers)
    draw_plan(axes, value.site.floor(number))
    _draw_landmarks(axes, value.site.landmarks.on_floor(number))
    axes.set_title(value.site.floor(number).name)


def _draw_landmarks(axes: Axes, landmarks: Landmarks) -> None:
    axes.plot(*landmarks.position_bcs[landmarks.surveyed].T, "s", color=VERMILION, markersize=4, label="landmark")
    for name, place in zip(landmarks.ids, landmarks.position_bcs.tolist(), strict=True):
        if np.isfinite(place).all():
            axes.annotate(name, tuple(place), xytext=(3, 3), textcoords="offset points", fontsize=7)


@_draw.register
def _mapped_walk(value: MappedWalk, axes: Axes, floor: int | None) -> None:
    number = _chosen(value.walk.key.floor if floor is None else floor, value.floors)
    _draw_landmarks(axes, value.landmarks.on_floor(number))
    _trajectory(value.walk.trajectory, axes, number)


@_draw.register
def _dataset(value: Dataset, axes: Axes, floor: int | None) -> None:
    storeys = [Storey(one.building, one.number) for one in value.info.floors]
    number = _chosen(floor, [storey.floor for storey in storeys])
    draw_plan(axes, value.site_floor(next(storey for storey in storeys if storey.floor == number)))
    labelled = value.fingerprints.filter((pl.col("floor") == number) & (pl.col("status") == Status.OK.label))
    points = labelled.select("x", "y", "technology").collect()
    for (technology,), own in sorted(points.group_by("technology")):
        axes.plot(own["x"], own["y"], ".", markersize=4, label=f"{technology}: {len(own)} fingerprints")
    axes.legend()


@_draw.register
def _radio_maps(value: FloorMaps, axes: Axes, _: int | None) -> None:
    """Draw the strongest mean RSSI of any access point."""
    image = axes.imshow(
        np.fmax.reduce(value.mean_dbm, axis=0), extent=value.grid.extent_m, origin="lower", cmap="viridis"
    )
    axes.figure.colorbar(image, ax=axes, label="strongest mean RSSI / dBm")


def _chosen(floor: int | None, there: list[int]) -> int:
    if not there or (floor is not None and floor not in there):
        raise UsageError(f"floor {floor} does not exist; available floors: {', '.join(map(str, there)) or 'none'}")
    return there[0] if floor is None else floor
