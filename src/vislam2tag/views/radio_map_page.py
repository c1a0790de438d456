"""Radio maps: the page to browse them, and print maps of access points."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from vislam2tag import __version__
from vislam2tag.datasets.radio_maps import FloorMaps
from vislam2tag.site.model import Floor
from vislam2tag.views.floor_map import drawn_plan
from vislam2tag.views.layers import grid_cells
from vislam2tag.views.page import data_uri, write_page
from vislam2tag.views.panels import PAGE_IN, PlanPanel, printed

SignalClass: TypeAlias = tuple[str, str, float]
"""A class of the strongest signal on a floor: its name, colour, and the share of the known cells, 0 to 1."""
_STOPS = 9
"""Colours of a legend's gradient."""


def map_floor(maps: FloorMaps, floor: Floor, stem: str, files: Sequence[str]) -> dict[str, Any]:
    """One floor and technology on the page, its maps as images; ``files`` are their GeoTIFFs relative to the page."""
    left, right, low, high = maps.grid.extent_m
    plan, _ = drawn_plan(floor)
    across, up = 100 / (right - left), 100 / (high - low)
    strongest, classes = strongest_signal(maps)
    heard, heard_scale, heard_median = heard_access_points(maps)
    style = ""
    if plan is not None and floor.extent_m is not None:
        x0, x1, y0, y1 = floor.extent_m
        style = (
            f"left:{(x0 - left) * across:.3f}%;top:{(high - y1) * up:.3f}%;"
            f"width:{(x1 - x0) * across:.3f}%;height:{(y1 - y0) * up:.3f}%"
        )
    return {
        "title": " ".join(part for part in (maps.place.building, floor.name) if part),
        "stem": stem,
        "technology": maps.place.technology,
        "aspect": (right - left) / (high - low),
        "plan": plan,
        "plan_style": style,
        "maps": maps,
        "tiles": [_tile(maps, number, file) for number, file in enumerate(files)],
        "strongest": data_uri(strongest),
        "classes": classes,
        "louder_share": sum(share for _, _, share in classes[: 1 + THRESHOLDS_DBM.index(LOUD_DBM)]),
        "heard": data_uri(heard),
        "heard_scale": heard_scale,
        "heard_median": heard_median,
    }


def _tile(maps: FloorMaps, number: int, file: str) -> dict[str, Any]:
    images = {layer: data_uri(thumbnail(getattr(maps, layer)[number], scale)) for layer, scale in SCALES.items()}
    return {"map": maps.maps[number], "images": images, "file": file}


def write_radio_map_page(out_file: Path, title: str, floors: Sequence[dict[str, Any]]) -> None:
    """Write the page, Wi-Fi before other technologies; equal input gives equal bytes.

    Raises OutputError if it cannot be written.
    """
    context = {
        "title": title,
        "version": __version__,
        "floors": sorted(floors, key=lambda floor: floor["technology"] != "wifi"),
        "technologies": {"wifi": "Wi-Fi", "ble": "BLE", "wifi+ble": "Wi-Fi and BLE"},
        "gradient": _gradient,
        "scales": {layer: (scale, _gradient(scale)) for layer, scale in SCALES.items()},
    }
    write_page(out_file, "radio_maps.html.j2", context)


def _gradient(scale: Scale) -> str:
    return ", ".join(to_hex(colormaps[scale.colours](step / (_STOPS - 1))) for step in range(_STOPS))


SHEET = 12
"""Maximum number of maps on a contact sheet; those with most readings come first."""
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
        "mean_dbm": Scale("Mean RSSI where received", "dBm", -95.0, -35.0, "viridis"),
        "deviation_db": Scale("Standard deviation of a reading", "dB", 1.0, 7.0, "magma"),
        "heard": Scale("Share of scans that receive it", "", 0.0, 1.0, "cividis"),
    }
)
"""By the layer of :class:`FloorMaps`."""


def contact_sheet(maps: FloorMaps, floor: Floor) -> Figure:
    """Draw the mean RSSI of the access points with most readings, on one scale."""
    shown = maps.maps[:SHEET]
    panels = [_panel(one.bssid, maps, floor, "mean_dbm", number) for number, one in enumerate(shown)]
    return printed(panels, min(_COLUMNS, len(shown)), extra_in=0.2)


def access_point_map(maps: FloorMaps, floor: Floor, number: int) -> Figure:
    """Draw mean, standard deviation and share received of one access point (by its number in ``maps``)."""
    panels = [_panel(scale.title, maps, floor, layer, number) for layer, scale in SCALES.items()]
    return printed(panels, 1, PAGE_IN * 0.7, extra_in=0.25)


def _panel(title: str, maps: FloorMaps, floor: Floor, layer: str, number: int) -> PlanPanel:
    scale = SCALES[layer]
    left, right, low, high = maps.grid.extent_m
    unit = f" / {scale.unit}" if scale.unit else ""
    bar = {"title": {"text": f"{scale.title}{unit}"}}
    look: dict[str, Any] = {
        "colorscale": scale.colours,
        "zmin": scale.low,
        "zmax": scale.high,
        "colorbar": bar,
        "opacity": 0.85,
    }
    layers = [grid_cells("", maps.grid, getattr(maps, layer)[number], **look)]
    return PlanPanel(title, floor, layers, (np.array([left, low]), np.array([right, high])))


THRESHOLDS_DBM = (-55.0, -67.0, -75.0, -85.0)
"""Lower ends of the classes that a map of the strongest signal shows; the last class has none."""
LOUD_DBM = -67.0
"""Signals of at least this level suffice for calls."""
_CLASS_COLOURS = ("#fde725", "#5ec962", "#21918c", "#3b528b", "#440154")


def strongest_signal(maps: FloorMaps) -> tuple[bytes, list[SignalClass]]:
    """Image (PNG, one pixel per cell) and classes of the strongest mean of any access point in each cell."""
    strongest = np.fmax.reduce(maps.mean_dbm, axis=0)
    known = np.isfinite(strongest)
    of_cell = (strongest[..., None] < THRESHOLDS_DBM).sum(axis=-1)
    names = [*(f"at least {low:g} dBm" for low in THRESHOLDS_DBM), f"below {THRESHOLDS_DBM[-1]:g} dBm"]
    pixels = np.array([to_rgba(colour) for colour in _CLASS_COLOURS])[of_cell]
    pixels[~known] = 0
    shares = [float((of_cell[known] == number).mean()) if known.any() else 0.0 for number in range(len(names))]
    classes = list(zip(names, _CLASS_COLOURS, shares, strict=True))
    return _png((255 * pixels).astype(np.uint8)), classes


def heard_access_points(maps: FloorMaps) -> tuple[bytes, Scale, float]:
    """Image (PNG, one pixel per cell) of the number of access points per scan, its scale, and the median."""
    known = np.isfinite(maps.heard).any(axis=0)
    number = np.where(known, np.nansum(maps.heard, axis=0), np.nan)
    scale = Scale("Access points per scan", "", 0.0, max(1.0, float(np.nanmax(number, initial=0.0))), "cividis")
    return thumbnail(number, scale), scale, float(np.median(number[known])) if known.any() else 0.0


def thumbnail(values: NDArray[np.float32], scale: Scale) -> bytes:
    """PNG of values (rows, columns), one pixel per cell, row 0 at the lower edge; NaN is transparent."""
    known = np.isfinite(values)
    share = np.clip((np.where(known, values, scale.low) - scale.low) / (scale.high - scale.low), 0, 1)
    pixels = colormaps[scale.colours](share, bytes=True)
    pixels[~known] = 0
    return _png(pixels)


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """PNG of pixels (rows, columns, 4), row 0 at the lower edge."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels[::-1])).quantize(64).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
