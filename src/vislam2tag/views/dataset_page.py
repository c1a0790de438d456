"""The page of a data set: statistics, charts, maps of fingerprints and gaps, and splits with their leakage."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from types import MappingProxyType
from typing import Any

import numpy as np
import polars as pl
from plotly.colors import qualitative

from vislam2tag import __version__
from vislam2tag.core.status import Status
from vislam2tag.datasets.coverage import FloorCoverage, coverage, floor_record, gap_walks
from vislam2tag.datasets.leakage import ALL_FOLDS, SplitLeakage, leakage
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import UNKNOWN, DatasetStatistics, Table3
from vislam2tag.site.walkable.walked import WalkedFloor
from vislam2tag.views.coverage_figures import storey_title, walk_layers
from vislam2tag.views.dataset_figures import charts, colours_of
from vislam2tag.views.floor_map import drawn_plan, map_figure, walk_to_fill
from vislam2tag.views.layers import (
    GREY,
    ORANGE,
    PALETTE,
    Trace,
    colour_bar,
    grid_cells,
    one_colour,
    plotly_text,
    scatter,
)
from vislam2tag.views.page import page_text

MOST_SESSIONS = 300
"""Maximum number of walks listed; all are in sessions.parquet."""


def dataset_page(
    dataset: Dataset, statistics: DatasetStatistics, walked: Mapping[Storey, WalkedFloor] = MappingProxyType({})
) -> str:
    """Return the page as self-contained HTML; equal input gives equal text.

    ``walked`` is the coverage of the plans, for floors where it is known.

    However large the set, the page grows only with its floors, devices and (to :data:`MOST_SESSIONS`) walks.
    """
    main = statistics.main
    name, technology = main or ("wifi", None)
    colours = _colours(sorted(technology.by_device)) if technology else {}
    context = {
        "title": dataset.info.title or dataset.info.name,
        "info": dataset.info,
        "version": __version__,
        "statistics": statistics,
        "technology": technology,
        "names": {"wifi": "Wi-Fi", "ble": "BLE", "wifi+ble": "Wi-Fi and BLE"},
        "table": Table3.of(statistics.by_device, statistics.walks),
        "floors": [
            floor_map(dataset, name, covered, colours, walked.get(covered.storey))
            for covered in coverage(dataset, name)
        ],
        "charts": charts(technology, statistics.sessions, name, colours) if technology else [],
        "transmitters": _transmitters(dataset),
        "radius_m": CoverageSettings().radius_m,
        "splits": [_split_view(split, name) for split in leakage(dataset, dataset.splits)],
        "sessions": statistics.sessions[:MOST_SESSIONS],
        "main": name,
    }
    return page_text("dataset.html.j2", context)


def _split_view(split: SplitLeakage, technology: str) -> dict[str, Any]:
    """A split, its folds for the fingerprints of one technology, and all folds together (None without a test set)."""
    own = [fold for fold in split.folds if fold.of == technology]
    folds = [fold for fold in own if fold.fold != ALL_FOLDS]
    together = [fold for fold in own if fold.fold == ALL_FOLDS]
    return {"split": split, "folds": folds, "whole": next(iter(together or folds), None)}


def _transmitters(dataset: Dataset) -> list[dict[str, Any]]:
    """Count the transmitters of each technology; flags are None if no identifier is an address."""
    flag = {name: pl.when(pl.col(name).count() > 0).then(pl.col(name).sum()) for name in ("randomised", "mobile")}
    counted = dataset.access_points.group_by("technology").agg(
        heard=pl.len(), once=(pl.col("readings") == 1).sum(), strongest=pl.col("strongest_dbm").max(), **flag
    )
    return counted.sort("technology").collect().to_dicts()


def _colours(devices: list[str]) -> dict[str, str]:
    """The colours of the print figures, or more if there are too many devices: on screen, hovering shows names."""
    if len(devices) <= len(PALETTE):
        return colours_of(devices)
    return dict(zip(devices, cycle(qualitative.Dark24), strict=False))


MOST_POINTS = 1500
"""Maximum number of fingerprints drawn per floor; more are thinned evenly."""
_CELL_AREA = "counts"


def floor_map(
    dataset: Dataset,
    technology: str,
    coverage: FloorCoverage,
    colours: dict[str, str],
    walked: WalkedFloor | None = None,
) -> dict[str, Any]:
    """Draw one floor; ``colours`` by device, grey where a device has none.

    ``note`` says why there is no plan and what is not drawn; ``walked`` is None without the survey.

    The walk to fill the gaps is that of ``walked`` if there is one, otherwise one over the cells that walks touched.
    """
    building, number = coverage.storey
    floor = dataset.site_floor(Storey(building, number))
    plan, note = drawn_plan(floor)
    walks = gap_walks(coverage)
    points, labelled = _labelled_points(dataset, technology, coverage)
    ways = walk_layers(walks) if walked is None or walked.note else walk_to_fill(walked)
    traces = [_cells(coverage), _gaps(coverage), *_fingerprints(points, colours), *ways]
    left, right, low, high = coverage.grid.extent_m
    shown = np.array([(left, low), (right, high), *(floor.corners_m if plan else ())])
    colour_axis = {"colorscale": "Viridis", "showscale": False, "colorbar": colour_bar("")}
    left_out = f"{len(points)} of {labelled} fingerprints are shown as points." if len(points) < labelled else ""
    far = f"{coverage.far} fingerprints are too far away to be shown." if coverage.far else ""
    return {
        "anchor": f"floor-{building}-{number}" if building else f"floor-{number}",
        "title": storey_title(coverage.storey, floor.name),
        "note": " ".join(text for text in (note, left_out, far) if text),
        "figure": map_figure(floor, plan, traces, shown, coloraxis=colour_axis),
        "record": floor_record(coverage, walks),
        "fingerprints": labelled,
        "walked": walked,
        "by_plan": walked is not None and not walked.note,
    }


def _labelled_points(dataset: Dataset, technology: str, coverage: FloorCoverage) -> tuple[pl.DataFrame, int]:
    """Labelled fingerprints of a floor, thinned evenly, and how many there are."""
    building, number = coverage.storey
    here = dataset.fingerprints.filter(
        (pl.col("technology") == technology)
        & (pl.col("status") == Status.OK.label)
        & (pl.col("floor") == number)
        & (pl.col("building").fill_null("") == building)
    )
    count = int(here.select(pl.len()).collect(engine="streaming").item())
    columns = here.select("x", "y", "sigma", "readings", "session", pl.col("device").fill_null(UNKNOWN))
    step = max(1, -(-count // MOST_POINTS))
    return columns.gather_every(step).collect(engine="streaming"), count


def _fingerprints(points: pl.DataFrame, colours: dict[str, str]) -> list[Trace]:
    """One trace per device; ``customdata`` contains sigma (metres) and the number of access points, for colours."""
    return [_device(str(device), own, colours) for (device,), own in sorted(points.group_by("device"))]


def _device(device: str, points: pl.DataFrame, colours: dict[str, str]) -> Trace:
    name = plotly_text(device)
    return scatter(
        "markers",
        name,
        points.select(pl.col("x", "y").round(2)).to_numpy(),
        f"{name}, %{{text}}<br>x %{{x:.2f}} m, y %{{y:.2f}} m<br>sigma %{{customdata[0]}} m, "
        "%{customdata[1]} readings",
        meta="fingerprints",
        customdata=points.select(pl.col("sigma").round(3), "readings").rows(),
        text=[plotly_text(session) for session in points["session"]],
        marker={"size": 6, "color": colours.get(device, GREY), "line": {"width": 0.5, "color": "white"}},
    )


def _cells(coverage: FloorCoverage) -> Trace:
    """Fingerprints per cell, as a heat map."""
    counts = [[value or None for value in row] for row in coverage.total.tolist()]
    look = {"colorscale": "YlGnBu", "zmin": 0, "visible": False, "colorbar": colour_bar("fingerprints a cell")}
    return grid_cells(
        "fingerprints a cell", coverage.grid, counts, "%{z} fingerprints", opacity=0.7, meta=_CELL_AREA, **look
    )


def _gaps(coverage: FloorCoverage) -> Trace:
    missing = coverage.gaps
    name = "walkable, no fingerprint nearby"
    values = np.where(missing, 1.0, np.nan).tolist() if missing.any() else []
    look = one_colour(ORANGE) | {"showlegend": bool(missing.any())}
    return grid_cells(name, coverage.grid, values, name, opacity=0.7, **look)
