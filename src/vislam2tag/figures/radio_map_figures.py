"""Radio maps on the plan: how loud an access point is heard, how much that varies, how often it is heard."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray
from PIL import Image

from vislam2tag.dataset.radio_mapping.radio_maps import FloorMaps
from vislam2tag.figures.panels import aspect_of, draw_plan, in_metres, letter, panel_grid, show
from vislam2tag.figures.style import PAGE_IN, print_quality
from vislam2tag.survey.model import Floor

SHEET = 12
"""Maps on a contact sheet, the most heard."""
_COLUMNS = 3


@dataclass(frozen=True)
class Scale:
    """How the cells of one kind of map are coloured."""

    title: str
    unit: str
    low: float
    high: float
    colours: str


SCALES: Mapping[str, Scale] = MappingProxyType(
    {
        "mean_dbm": Scale("Mean RSSI where heard", "dBm", -95.0, -35.0, "viridis"),
        "deviation_db": Scale("Deviation of a reading", "dB", 1.0, 7.0, "magma"),
        "heard": Scale("Share of scans that hear it", "", 0.0, 1.0, "cividis"),
    }
)
"""By the layer of :class:`FloorMaps`."""


@print_quality
def contact_sheet(maps: FloorMaps, floor: Floor) -> Figure:
    """Draw the mean RSSI of the access points that are heard most, on one scale."""
    shown = maps.maps[:SHEET]
    columns = min(_COLUMNS, len(shown))
    figure, axes = panel_grid(len(shown), columns, PAGE_IN, _aspect(maps), extra_in=0.2)
    for number, one in enumerate(axes):
        image = _draw(one, maps, floor, "mean_dbm", number)
        one.label_outer()
    letter(axes, [one.bssid for one in shown])
    figure.colorbar(image, ax=axes, label="mean RSSI where heard / dBm", shrink=0.6, pad=0.01)
    return figure


@print_quality
def access_point_map(maps: FloorMaps, floor: Floor, number: int) -> Figure:
    """Draw all that is known of one access point (by its number in ``maps``): mean, deviation, share heard."""
    figure, axes = panel_grid(len(SCALES), 1, PAGE_IN * 0.7, _aspect(maps), extra_in=0.25)
    for one, (layer, scale) in zip(axes, SCALES.items(), strict=True):
        image = _draw(one, maps, floor, layer, number)
        figure.colorbar(image, ax=one, label=scale.unit, shrink=0.9, pad=0.01)
    letter(axes, [scale.title for scale in SCALES.values()])
    return figure


def _aspect(maps: FloorMaps) -> float:
    left, right, low, high = maps.grid.extent_m
    return aspect_of((np.array([left, low]), np.array([right, high])))


def _draw(axes: Axes, maps: FloorMaps, floor: Floor, layer: str, number: int) -> AxesImage:
    left, right, low, high = maps.grid.extent_m
    scale = SCALES[layer]
    draw_plan(axes, floor)
    image = axes.imshow(
        getattr(maps, layer)[number],
        extent=(left, right, low, high),
        origin="lower",
        interpolation="nearest",
        vmin=scale.low,
        vmax=scale.high,
        cmap=scale.colours,
        alpha=0.85,
        zorder=2,
    )
    in_metres(axes)
    show(axes, (np.array([left, low]), np.array([right, high])))
    return image


def thumbnail(values: NDArray[np.float32], scale: Scale) -> bytes:
    """PNG with one pixel a cell of values (rows, columns), row 0 at the lower edge; cells without one are clear."""
    known = np.isfinite(values)
    share = np.clip((np.where(known, values, scale.low) - scale.low) / (scale.high - scale.low), 0, 1)
    pixels = colormaps[scale.colours](share, bytes=True)
    pixels[~known] = 0
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels[::-1])).quantize(64).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
