"""The page that shows all radio maps of a data set, to look through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib import colormaps
from matplotlib.colors import to_hex

from vislam2tag import __version__
from vislam2tag.dataset.map_process import MapKernel
from vislam2tag.dataset.radio_maps import FloorMaps, RadioMap
from vislam2tag.figures.radio_map_figures import (
    SCALES,
    THRESHOLDS_DBM,
    Scale,
    SignalClass,
    heard_access_points,
    strongest_signal,
    thumbnail,
)
from vislam2tag.survey.model import Floor
from vislam2tag.views.floor_map.plan import drawn_plan
from vislam2tag.views.page import data_uri, write_page

_STOPS = 9
"""Colours of a legend's gradient."""


@dataclass(frozen=True)
class MapTile:
    """One access point: what is said of it, and its maps as images by layer."""

    map: RadioMap
    images: dict[str, str]
    file: str
    """Its GeoTIFF."""


@dataclass(frozen=True)
class MapFloor:
    """One floor and technology on the page; made by :meth:`of`."""

    title: str
    stem: str
    technology: str
    aspect: float
    """Width over height of the maps."""
    plan: str | None
    """The plan as a data URI."""
    plan_style: str
    """Where the plan lies under a map, as CSS."""
    scans: int
    kernel: MapKernel
    heard_width_m: float
    offsets_db: dict[str, float]
    tiles: tuple[MapTile, ...]
    strongest: str
    """How loud the loudest access point is, as an image."""
    classes: tuple[SignalClass, ...]
    heard: str
    """How many access points a scan hears, as an image."""
    heard_scale: Scale
    heard_median: float

    def louder_share(self, threshold_dbm: float) -> float:
        """Share of the mapped area where some access point has at least a threshold of :data:`THRESHOLDS_DBM`."""
        return sum(one.share for one in self.classes[: 1 + THRESHOLDS_DBM.index(threshold_dbm)])

    @classmethod
    def of(cls, maps: FloorMaps, floor: Floor, stem: str, files: Sequence[str]) -> MapFloor:
        """Turn one floor's maps into images; ``files`` are their GeoTIFFs relative to the page."""
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
        return cls(
            title=" ".join(part for part in (maps.place.building, floor.name) if part),
            stem=stem,
            technology=maps.place.technology,
            aspect=(right - left) / (high - low),
            plan=plan,
            plan_style=style,
            scans=maps.scans,
            kernel=maps.kernel,
            heard_width_m=maps.heard_width_m,
            offsets_db=maps.offsets_db,
            tiles=tuple(_tile(maps, number, file) for number, file in enumerate(files)),
            strongest=data_uri(strongest),
            classes=tuple(classes),
            heard=data_uri(heard),
            heard_scale=heard_scale,
            heard_median=heard_median,
        )


def _tile(maps: FloorMaps, number: int, file: str) -> MapTile:
    images = {layer: data_uri(thumbnail(getattr(maps, layer)[number], scale)) for layer, scale in SCALES.items()}
    return MapTile(maps.maps[number], images, file)


def write_radio_map_page(out_file: Path, title: str, floors: Sequence[MapFloor]) -> None:
    """Write the page, Wi-Fi before other technologies; equal input gives equal bytes.

    Raises OutputError where it cannot be written.
    """
    context = {
        "title": title,
        "version": __version__,
        "floors": sorted(floors, key=lambda floor: floor.technology != "wifi"),
        "technologies": {"wifi": "Wi-Fi", "ble": "BLE"},
        "gradient": _gradient,
        "scales": {layer: (scale, _gradient(scale)) for layer, scale in SCALES.items()},
    }
    write_page(out_file, "radio_maps.html.j2", context)


def _gradient(scale: Scale) -> str:
    return ", ".join(to_hex(colormaps[scale.colours](step / (_STOPS - 1))) for step in range(_STOPS))
