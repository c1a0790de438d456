"""A data set in print: its charts with their numbers, and its coverage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.datasets.coverage import coverage, gap_walks
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import (
    DatasetStatistics,
    DeviceRssi,
    Distribution,
    SessionStatistics,
    SigmaDistribution,
    TechnologyStatistics,
)
from vislam2tag.views.coverage_figures import CoveredFloor, coverage_map, storey_title
from vislam2tag.views.dataset_charts import (
    by_device,
    by_floor,
    colours_of,
    heard,
    over_time,
    rssi_boxes,
    rssi_offsets,
    sigma_curve,
)
from vislam2tag.views.layers import BLUE, PALETTE, Chart, Trace, dots, line, written
from vislam2tag.views.panels import COLUMN_IN, PAGE_IN, printed

_ROW_IN = 0.17
"""Height of a bar and the gap to the next, inches."""


def _with(chart: Chart, *layers: Trace, legend: bool = False) -> Chart:
    """A chart with more layers, and perhaps a legend."""
    return replace(chart, layers=[*chart.layers, *layers], layout={**chart.layout, "showlegend": legend})


def _rows(charts: Sequence[Chart], rows: int) -> Figure:
    """Charts of bars side by side, as high as so many rows ask."""
    return printed(charts, aspect=len(charts) * (0.3 + _ROW_IN * max(3, rows)) / PAGE_IN)


def _numbered(chart: Chart) -> Chart:
    """Stacked bars with the number of all labelled fingerprints at their ends."""
    *labelled, missing = chart.layers
    counts = np.sum([layer["x"] for layer in labelled], axis=0)
    ends = (counts + missing["x"]).tolist()
    wide = _with(chart, written(None, list(map(str, counts)), "middle right") | {"x": ends, "y": missing["y"]})
    return replace(wide, x=chart.x | {"range": (0, 1.13 * max([*ends, 1]))})


def fingerprints_by_device_and_floor(technology: TechnologyStatistics) -> Figure:
    """Draw how many fingerprints each device and each floor has (paper, Figure 8); unlabelled ones are pale."""
    colours = colours_of(sorted(technology.by_device))
    panels = [_numbered(by_device(technology, colours)), _numbered(by_floor(technology, colours))]
    return _rows(panels, max(len(technology.by_device), len(technology.by_floor)))


def access_points_heard(access_points: Distribution) -> Figure:
    """Draw how many access points a fingerprint holds, and the median."""
    chart, median = heard(access_points), access_points.quantiles["0.5"]
    top = 1.1 * max(chart.layers[0]["y"])
    middle = line("", [(median, 0), (median, top)], "#000000", 1.5, "dash")
    name = written([(median, top)], [f"median {median:g}"], "bottom right")
    return printed([_with(chart, middle, name)], width_in=COLUMN_IN, aspect=0.55)


def rssi_by_device(rssi: Mapping[str, DeviceRssi]) -> Figure:
    """Draw what each device hears, and how much louder than others at the same place, with numbers."""
    boxes, offsets = rssi_boxes(rssi), rssi_offsets(rssi)
    if offsets is None:
        return _rows([boxes], len(rssi))
    (bar,) = offsets.layers
    sides = [f"middle {'left' if offset < 0 else 'right'}" for offset in bar["x"]]
    text = [f"{offset:+.1f}" for offset in bar["x"]]
    reach = 1.3 * max([1.0, *map(abs, bar["x"])])
    numbered = _with(offsets, written(None, text) | {"x": bar["x"], "y": bar["y"], "textposition": sides})
    return _rows([boxes, replace(numbered, x=offsets.x | {"range": (-reach, reach)})], len(rssi))


def sigma_distribution(sigma: SigmaDistribution) -> Figure:
    """Draw the share of fingerprints that are at least so sure, with median and 95 %."""
    named = [f"median: {sigma.median_m:.2f} m", f"95 %: {sigma.p95_m:.2f} m"]
    places = [(sigma.median_m, 0.5), (sigma.p95_m, 0.95)]
    chart = _with(sigma_curve(sigma), dots("", places, BLUE, 8, text=named, textposition="bottom right"))
    return printed([chart], width_in=COLUMN_IN, aspect=0.55)


def fingerprints_over_time(sessions: Sequence[SessionStatistics], technology: str) -> Figure:
    """Draw how the labelled fingerprints of walks with a date add up, by device."""
    devices = sorted({walk.device for walk in sessions if walk.started})
    several = 1 < len(devices) <= len(PALETTE)
    chart = over_time(sessions, technology, colours_of(devices) if several else {})
    return printed([_with(chart, legend=several)], aspect=0.35)


def covered_floors(
    dataset: Dataset,
    technology: str,
    settings: CoverageSettings,
    starts: Mapping[Storey, tuple[float, float]],
) -> list[CoveredFloor]:
    """Count the cells of every floor and plan the walks that fill its gaps, from its place of ``starts`` if given."""
    return [
        CoveredFloor(
            title=storey_title(covered.storey),
            floor=dataset.site_floor(covered.storey),
            coverage=covered,
            walks=gap_walks(covered, settings.radius_m, starts.get(covered.storey)),
        )
        for covered in coverage(dataset, technology, settings)
    ]


def dataset_figures(statistics: DatasetStatistics, floors: Sequence[CoveredFloor]) -> Iterator[tuple[str, Figure]]:
    """Yield the figures that there is data for: of Wi-Fi, else of the technology with most fingerprints."""
    if floors:
        yield "coverage", coverage_map(floors)
    if statistics.main is None:
        return
    name, technology = statistics.main
    yield "fingerprints", fingerprints_by_device_and_floor(technology)
    yield "access_points", access_points_heard(technology.heard)
    if technology.rssi:
        yield "rssi", rssi_by_device(technology.rssi)
    if technology.sigma is not None:
        yield "sigma", sigma_distribution(technology.sigma)
    if any(walk.started for walk in statistics.sessions):
        yield "over_time", fingerprints_over_time(statistics.sessions, name)
