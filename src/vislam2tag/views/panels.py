"""Figures in print: the style of a two-column page, panels with letters, colour bars and one legend."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import plan_picture
from vislam2tag.views.layers import GREY, Chart, Trace
from vislam2tag.views.print_layers import Scales, draw, draw_chart

COLUMN_IN, PAGE_IN = 3.5, 7.16
"""Widths of one column and of both columns, inches."""

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
    "floor-plan": ("Floor plan", "#8c6bb1"),
}


def print_quality(draw: Callable[_Args, Figure]) -> Callable[_Args, Figure]:
    """Make a function draw in print style without changing matplotlib's global settings."""

    @wraps(draw)
    def drawn(*args: _Args.args, **kwargs: _Args.kwargs) -> Figure:
        with mpl.rc_context(fname=_STYLE):
            return draw(*args, **kwargs)

    return drawn


def name_of(strategy: str) -> str:
    """Name of a strategy in figures and tables: the paper's name if there is one."""
    return _STRATEGIES[strategy][0] if strategy in _STRATEGIES else strategy


def colour_of(strategy: str) -> str:
    """Colour of a strategy, the same in all figures; grey for strategies of plugins."""
    return _STRATEGIES[strategy][1] if strategy in _STRATEGIES else GREY


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
_LETTERS_IN, _KEY_LETTERS = 21.0, 7
"""Letters of a legend per inch, and the width of an entry's symbol and gaps in letters."""
LEAST_ASPECT, GREATEST_ASPECT = 0.3, 1.2
"""Limits of a panel's height over width."""


@dataclass(frozen=True)
class PlanPanel:
    """Layers over a floor's plan (None: without one); ``extent`` is the area shown (None: all layers)."""

    title: str
    floor: Floor | None
    layers: Sequence[Trace]
    extent: Extent | None = None


@print_quality
def printed(
    panels: Sequence[PlanPanel | Chart],
    columns: int | None = None,
    width_in: float = PAGE_IN,
    aspect: float | None = None,
    extra_in: float = 0.45,
) -> Figure:
    """Draw panels in rows of ``columns`` (None: two), each ``aspect`` times as high as wide (None: from the floors).

    Titles of several panels begin with letters; a legend below all panels names each layer once.
    """
    columns = columns or min(2, max(1, len(panels)))
    if aspect is None:
        extents = [one.extent for one in panels if isinstance(one, PlanPanel) and one.extent is not None]
        aspect = max(map(aspect_of, extents), default=1.0)
    rows, side = -(-len(panels) // columns), np.clip(aspect, LEAST_ASPECT, GREATEST_ASPECT) * width_in / columns
    figure = Figure(figsize=(width_in, rows * (side + extra_in)), layout="constrained")
    axes = [figure.add_subplot(rows, columns, number + 1) for number in range(len(panels))]
    draw_panels(figure, axes, panels)
    return figure


def draw_panels(figure: Figure, axes: Sequence[Axes], panels: Sequence[PlanPanel | Chart]) -> None:
    """Draw each panel into its axes, with letters, colour bars and a legend below."""
    bars: dict[str, tuple[ScalarMappable, Mapping[str, Any], list[Axes]]] = {}
    for number, (one, panel) in enumerate(zip(axes, panels, strict=True)):
        scales = draw_plan_panel(one, panel) if isinstance(panel, PlanPanel) else draw_chart(one, panel)
        for title, scale in scales.items():
            bars.setdefault(title, (*scale, []))[2].append(one)
        one.set_title(f"({chr(ord('a') + number)}) {panel.title}" if len(panels) > 1 else panel.title, loc="left")
    for title, (mappable, look, beside) in bars.items():
        bar = figure.colorbar(mappable, ax=beside, label=title, shrink=0.7, pad=0.01)
        if "tickvals" in look:
            bar.set_ticks(look["tickvals"], labels=look["ticktext"])
    shown = {}
    for one, panel in zip(axes, panels, strict=True):
        if isinstance(panel, PlanPanel) or panel.layout.get("showlegend", True):
            handles, labels = one.get_legend_handles_labels()
            shown.update(dict(zip(labels, handles, strict=True)))
    if shown:
        columns = int(_LETTERS_IN * figure.get_figwidth() / (max(map(len, shown)) + _KEY_LETTERS))
        figure.legend(list(shown.values()), list(shown), loc="outside lower center", ncols=max(1, columns))


def draw_plan_panel(axes: Axes, panel: PlanPanel) -> Scales:
    """Draw a floor's plan and layers over it, both axes in metres."""
    if panel.floor is not None:
        draw_plan(axes, panel.floor)
    scales = draw(axes, panel.layers)
    in_metres(axes)
    if panel.extent is not None:
        (left, low), (right, high) = panel.extent
        axes.set(xlim=(left, right), ylim=(low, high))
    return scales


def draw_plan(axes: Axes, floor: Floor) -> None:
    """Draw the plan over the floor's extent if that is known and the image can be read (findings say why not)."""
    if floor.plan is None or floor.extent_m is None:
        return
    try:
        image = plan_picture(floor, PLAN_PIXELS)
    except OSError:
        return
    axes.imshow(image, extent=floor.extent_m, alpha=0.4, zorder=0)


def in_metres(axes: Axes) -> None:
    """Give both axes the same scale, and name their unit."""
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlabel="x / m", ylabel="y / m")


def extent_of(floor: Floor, landmarks: Landmarks) -> Extent:
    """Lower left and upper right corner (2,) of a floor's drawing: the plan's, or around its landmarks."""
    if floor.extent_m is not None:
        return floor.corners_m[0], floor.corners_m[1]
    here = landmarks.on_floor(floor.number)
    return extent_around(np.concatenate((here.position_bcs[here.surveyed], floor.control_points.position_bcs)))


def extent_around(points: FloatArray) -> Extent:
    """Lower left and upper right corner (2,) of an area around points (k, 2), metres; NaN do not count."""
    if not len(points):
        return np.zeros(2), np.ones(2)
    return np.nanmin(points, axis=0) - MARGIN_M, np.nanmax(points, axis=0) + MARGIN_M


def extent_over(*corners: Any) -> Extent:
    """Lower left and upper right corner (2,) of all corners (k, 2) given."""
    every = np.concatenate([np.asarray(each, dtype=np.float64).reshape(-1, 2) for each in corners])
    return every.min(axis=0), every.max(axis=0)


def aspect_of(extent: Extent) -> float:
    """Height over width of the area between two corners, (2,) each."""
    width, height = extent[1] - extent[0]
    return float(height / width)
