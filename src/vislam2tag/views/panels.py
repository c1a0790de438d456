"""Figures in print: the style of a two-column page, grids of panels, and what is drawn into one panel."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import plan_picture

COLUMN_IN, PAGE_IN = 3.5, 7.16
"""Widths of one column and of a page with two, inches."""
LANDMARK, TRUTH, QUIET, DISCARDED = "#d55e00", "#000000", "#8c959f", "#cc79a7"
"""Colours, of Okabe and Ito where hue matters: the colour-blind can tell them apart."""

Extent: TypeAlias = tuple[FloatArray, FloatArray]
"""Lower left and upper right corner (2,) of what is shown, BCS metres."""
_Args = ParamSpec("_Args")
_STYLE = Path(__file__).with_name("print.mplstyle")
_STRATEGIES = {
    "local": ("Local", "#e69f00"),
    "local-corrected": ("Local (corrected)", "#0072b2"),
    "global": ("Global", "#cc79a7"),
    "global-affine": ("Global (LS)", "#cc79a7"),
    "smoother": ("Smoother", "#009e73"),
}


def print_quality(draw: Callable[_Args, Figure]) -> Callable[_Args, Figure]:
    """Let a function draw in the style of print; matplotlib's own settings stay as they are."""

    @wraps(draw)
    def drawn(*args: _Args.args, **kwargs: _Args.kwargs) -> Figure:
        with mpl.rc_context(fname=_STYLE):
            return draw(*args, **kwargs)

    return drawn


def name_of(strategy: str) -> str:
    """How a strategy is called in figures and tables: the paper's name where it has one."""
    return _STRATEGIES[strategy][0] if strategy in _STRATEGIES else strategy


def colour_of(strategy: str) -> str:
    """Colour of a strategy, the same in all figures; grey for one that is not the package's own."""
    return _STRATEGIES[strategy][1] if strategy in _STRATEGIES else QUIET


def rendered(figure: Figure, kind: str) -> bytes:
    """Bytes of a figure as ``svg``, ``pdf`` or ``png``; equal figures give equal bytes."""
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    buffer = io.BytesIO()
    with mpl.rc_context(fname=_STYLE):
        figure.savefig(buffer, format=kind, bbox_inches="tight", pad_inches=0.02, dpi=300, metadata=dates.get(kind, {}))
    return buffer.getvalue()


PLAN_PIXELS = 1600
"""Longer side of a plan in print, pixels: 300 dots an inch over most of a page."""
MARGIN_M = 3.0
MANY_DECADES = 1000.0
"""Ratio of a logarithmic axis' ends from which on fewer numbers stand at it."""
LEAST_ASPECT, GREATEST_ASPECT = 0.3, 1.2
"""Height over width that a panel may have."""


def panel_grid(
    count: int, columns: int, width_in: float, aspect: float, *, extra_in: float = 0.45
) -> tuple[Figure, list[Axes]]:
    """Make ``count`` lettered axes in rows of ``columns``, each ``aspect`` times as high as wide."""
    rows = -(-count // columns)
    side = np.clip(aspect, LEAST_ASPECT, GREATEST_ASPECT) * width_in / columns
    figure = Figure(figsize=(width_in, rows * (side + extra_in)), layout="constrained")
    axes = [figure.add_subplot(rows, columns, number + 1) for number in range(count)]
    return figure, axes


def floor_panels(
    floors: Sequence[Floor], extents: Sequence[Extent], titles: Sequence[str], *, extra_in: float = 0.45
) -> tuple[Figure, list[Axes]]:
    """Make lettered axes over the page's width, each with a floor's plan, which show what lies between two corners."""
    columns = min(2, len(floors))
    figure, axes = panel_grid(len(floors), columns, PAGE_IN, max(map(aspect_of, extents)), extra_in=extra_in)
    for one, floor, extent in zip(axes, floors, extents, strict=True):
        draw_plan(one, floor)
        in_metres(one)
        show(one, extent)
    letter(axes, titles)
    return figure, axes


def letter(axes: Sequence[Axes], titles: Sequence[str]) -> None:
    """Head each panel with a letter and its title."""
    for number, (one, title) in enumerate(zip(axes, titles, strict=True)):
        one.set_title(f"({chr(ord('a') + number)}) {title}", loc="left")


def legend_below(figure: Figure, axes: Sequence[Axes], columns: int = 5) -> None:
    """Explain below all panels what is drawn in them, each thing once."""
    shown = {}
    for one in axes:
        handles, labels = one.get_legend_handles_labels()
        shown.update(dict(zip(labels, handles, strict=True)))
    figure.legend(list(shown.values()), list(shown), loc="outside lower center", ncols=columns)


def in_metres(axes: Axes) -> None:
    """Give both axes the same scale, and name their unit."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x / m")
    axes.set_ylabel("y / m")


def log_metres(axis: Axis) -> None:
    """Number an axis of metres that is scaled by its logarithm in plain figures: 0.1, 0.2, 0.5, 1, ..."""
    low, high = axis.get_view_interval()
    steps = (1.0, 2.0, 5.0) if high / low < MANY_DECADES else (1.0, 3.0)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def extent_of(floor: Floor, landmarks: Landmarks) -> Extent:
    """Lower left and upper right corner (2,) of what is shown of a floor: the plan's, else around its landmarks."""
    if floor.extent_m is not None:
        return floor.corners_m[0], floor.corners_m[1]
    here = landmarks.on_floor(floor.number)
    points = np.concatenate((here.position_bcs[here.surveyed], floor.control_points.position_bcs, np.zeros((0, 2))))
    return extent_around(points) if len(points) else (np.zeros(2), np.ones(2))


def extent_around(points: FloatArray) -> Extent:
    """Lower left and upper right corner (2,) of what lies around points (k, 2), metres; NaN do not count."""
    return np.nanmin(points, axis=0) - MARGIN_M, np.nanmax(points, axis=0) + MARGIN_M


def aspect_of(extent: Extent) -> float:
    """Height over width of what lies between two corners, (2,) each."""
    width, height = extent[1] - extent[0]
    return float(height / width)


def show(axes: Axes, extent: Extent) -> None:
    """Show what lies between two corners, (2,) each, metres, and no more."""
    axes.set(xlim=(extent[0][0], extent[1][0]), ylim=(extent[0][1], extent[1][1]))


def draw_floor(axes: Axes, floor: Floor, landmarks: Landmarks, *, ids: bool = False) -> None:
    """Draw the plan, pale, as far as there is one, and the floor's surveyed landmarks, with their ids if wanted."""
    draw_plan(axes, floor)
    here = landmarks.on_floor(floor.number)
    here = here.select(np.flatnonzero(here.surveyed).tolist())
    axes.plot(*here.position_bcs.T, "s", color=LANDMARK, markersize=2.5, zorder=4, label="landmark")
    for name, point in zip(here.ids if ids else (), here.position_bcs[: len(here.ids) if ids else 0], strict=True):
        text = axes.annotate(name, (point[0], point[1]), xytext=(3, 3), textcoords="offset points", color=LANDMARK)
        text.set(zorder=7, path_effects=[withStroke(linewidth=1.5, foreground="white")])
    in_metres(axes)
    show(axes, extent_of(floor, landmarks))


def draw_plan(axes: Axes, floor: Floor) -> None:
    """Draw the plan over the floor's extent where it is known and the image can be read (findings say why not)."""
    if floor.plan is None or floor.extent_m is None:
        return
    try:
        image = plan_picture(floor, PLAN_PIXELS)
    except OSError:
        return
    axes.imshow(image, extent=floor.extent_m, alpha=0.4, zorder=0)


def draw_cells(
    axes: Axes, values: Any, extent_m: tuple[float, float, float, float], zorder: int, **look: Any
) -> AxesImage:
    """Paint cells (rows, columns), row 0 at the lower edge, over an extent: left, right, low, high, metres."""
    return axes.imshow(values, extent=extent_m, origin="lower", zorder=zorder, **look)


def arrow(axes: Axes, start: Sequence[float] | FloatArray, tip: Sequence[float] | FloatArray, **look: Any) -> None:
    """Draw an arrow between two places; ``look`` is that of its ``arrowprops``, and ``zorder``."""
    zorder = look.pop("zorder")
    props = {"arrowstyle": "-|>", **look}
    (x, y), (to_x, to_y) = map(float, start), map(float, tip)
    axes.annotate("", (to_x, to_y), (x, y), arrowprops=props, annotation_clip=False, zorder=zorder)


def draw_control_points(axes: Axes, floor: Floor) -> None:
    """Draw the floor's control points as stars."""
    points = floor.control_points.position_bcs
    axes.plot(*points.T, "*", color="#56b4e9", markersize=6, markeredgecolor="white", markeredgewidth=0.3, zorder=6)
    axes.lines[-1].set_label("control point")


def draw_walk(axes: Axes, trajectory: Trajectory, colour: str, label: str, width: float = 1.0) -> None:
    """Draw the mapped frames as a line, ``width`` points wide, broken where frames have no position."""
    counted = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    axes.plot(*trajectory.position_bcs[counted, :2].T, color=colour, linewidth=width, zorder=3, label=label)


def draw_recording(axes: Axes, camera: CameraTrack, log: LandmarkLog) -> None:
    """Draw a walk as recorded, in the tracker's frame, and wherever the tracker had its landmarks."""
    axes.plot(*camera.plane_acs[camera.usable].T, color=QUIET, label="camera")
    known = np.unique(np.round(log.plane_acs[~log.lost], 2), axis=0)
    axes.plot(*known.T, ".", color=LANDMARK, markersize=1.5, label="landmarks as logged", rasterized=len(known) > 5000)
    in_metres(axes)
