"""The charts of a data set, on its page and in print: fingerprints by device and floor, over time, RSSI, sigma.

The print figures include numbers and coverage.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.common import error_statistics
from vislam2tag.datasets.coverage import coverage, gap_walks
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import (
    DatasetStatistics,
    DeviceRssi,
    Distribution,
    FloorLabels,
    SessionStatistics,
    SigmaDistribution,
    TechnologyStatistics,
)
from vislam2tag.views.coverage_figures import CoveredFloor, coverage_map, storey_title
from vislam2tag.views.layers import (
    BLUE,
    ORANGE,
    PALETTE,
    Chart,
    Trace,
    axis,
    bars,
    dots,
    line,
    plotly_text,
    scatter,
    written,
)
from vislam2tag.views.panels import COLUMN_IN, PAGE_IN, printed

PALE = "#c9d1d9"
BINS = 60
"""Maximum number of bars of a histogram."""
_NAMES = {"type": "category", "automargin": True}
"""An axis of devices or floors."""


def charts(
    technology: TechnologyStatistics, sessions: Sequence[SessionStatistics], name: str, colours: Mapping[str, str]
) -> list[tuple[str, str, str]]:
    """Each chart with data: its title, a sentence, and Plotly's JSON."""
    several = len({walk.started for walk in sessions if walk.started}) > 1
    made = (
        ("Pale bars: not labelled.", by_device(technology, colours)),
        ("Fingerprints without a label count for the floor of their walk.", by_floor(technology, colours)),
        ("", heard(technology.heard)),
        (
            "All readings. Box: middle half; line: 5 % to 95 %.",
            rssi_boxes(technology.rssi) if technology.rssi else None,
        ),
        (
            "Difference from the mean of devices that received the same access point in the same 2 m cell.",
            rssi_offsets(technology.rssi),
        ),
        (
            "Share of fingerprints with at most this sigma.",
            None if technology.sigma is None else sigma_curve(technology.sigma),
        ),
        ("", over_time(sessions, name) if several else None),
    )
    return [(chart.title, about, chart.json()) for about, chart in made if chart is not None]


def colours_of(devices: Sequence[str]) -> dict[str, str]:
    """A colour for each device; one colour for all if there are more devices than colours."""
    return {device: PALETTE[n] if len(devices) <= len(PALETTE) else BLUE for n, device in enumerate(devices)}


def by_device(technology: TechnologyStatistics, colours: Mapping[str, str]) -> Chart:
    """Fingerprints of each device, unlabelled ones pale."""
    devices = sorted(technology.by_device, key=lambda device: technology.by_device[device].fingerprints)
    labels = [technology.by_device[device] for device in devices]
    names = [plotly_text(device) for device in devices]
    labelled = [one.labelled for one in labels]
    missing = [one.fingerprints - one.labelled for one in labels]
    own = [colours.get(device, BLUE) for device in devices]
    layers = [
        bars("labelled", names, labelled, own, "%{y}: %{x} labelled"),
        bars("not labelled", names, missing, PALE, "%{y}: %{x} not labelled"),
    ]
    return _stacked("Fingerprints per device", layers, len(devices))


def by_floor(technology: TechnologyStatistics, colours: Mapping[str, str]) -> Chart:
    """Fingerprints of each floor by device, unlabelled ones pale."""
    floors = [plotly_text(floor_name(floor)) for floor in technology.by_floor]
    layers = []
    for device in sorted(technology.by_device):
        counts = [floor.by_device[device].labelled if device in floor.by_device else 0 for floor in technology.by_floor]
        name = plotly_text(device)
        layers.append(bars(name, floors, counts, colours.get(device, BLUE), f"%{{y}}, {name}: %{{x}}"))
    missing = [floor.labels.fingerprints - floor.labels.labelled for floor in technology.by_floor]
    return _stacked("Fingerprints per floor", [*layers, bars("not labelled", floors, missing, PALE)], len(floors))


def floor_name(floor: FloorLabels) -> str:
    """Building and number, if known."""
    number = "no floor" if floor.floor is None else f"floor {floor.floor}"
    return f"{floor.building}, {number}" if floor.building else number


def _stacked(title: str, layers: Sequence[Trace], rows: int) -> Chart:
    layout = {"barmode": "stack", "height": 90 + 24 * max(3, rows), "bargap": max(0.2, 1 - 0.27 * rows)}
    return _chart(title, layers, axis("fingerprints", rangemode="tozero"), _NAMES, **layout)


def heard(access_points: Distribution) -> Chart:
    """The number of access points per fingerprint."""
    width, bins = access_points.binned(BINS)
    bar = {
        "type": "bar",
        "name": "",
        "x": [lowest + (width - 1) / 2 for lowest in bins],
        "y": list(bins.values()),
        "text": [str(lowest) if width == 1 else f"{lowest} to {lowest + width - 1}" for lowest in bins],
        "textposition": "none",
        "marker": {"color": BLUE},
        "hovertemplate": "%{text}: %{y} fingerprints<extra></extra>",
    }
    x = axis("access points received", grid=False)
    return _chart("Access points per fingerprint", [bar], x, axis("fingerprints"), bargap=0.05)


def rssi_boxes(rssi: Mapping[str, DeviceRssi]) -> Chart:
    """RSSI by device: quartiles, 5 % to 95 %, mean."""
    devices = sorted(rssi, key=lambda device: rssi[device].rssi_dbm.quantiles["0.5"])
    quantiles = zip(*(rssi[device].rssi_dbm.quantiles.values() for device in devices), strict=True)
    boxes = {
        "type": "box",
        "y": [plotly_text(device) for device in devices],
        **dict(zip(("lowerfence", "q1", "median", "q3", "upperfence"), quantiles, strict=True)),
        "mean": [rssi[device].rssi_dbm.mean for device in devices],
        "orientation": "h",
        "line": {"color": BLUE, "width": 1.4},
        "name": "",
    }
    return _chart("RSSI by device", [boxes], axis("RSSI / dBm"), _NAMES, height=90 + 26 * max(3, len(devices)))


def rssi_offsets(rssi: Mapping[str, DeviceRssi]) -> Chart | None:
    """RSSI offsets of devices at the same place; None if no two received the same access point in a cell."""
    known = {device: one for device, one in rssi.items() if one.offset_db is not None}
    if not known:
        return None
    devices = sorted(known, key=lambda device: known[device].offset_db or 0.0)
    names = [plotly_text(device) for device in devices]
    shared = [known[device].shared for device in devices]
    hover = "%{y}: %{x:+.1f} dB over %{customdata} places"
    bar = bars("", names, [known[device].offset_db for device in devices], ORANGE, hover, customdata=shared)
    x = axis("offset / dB") | {"zeroline": True, "zerolinecolor": "#24292f"}
    return _chart("RSSI offset by device", [bar], x, _NAMES, height=90 + 26 * max(3, len(devices)))


def sigma_curve(sigma: SigmaDistribution) -> Chart:
    """The share of fingerprints with at most a given sigma."""
    edges = [min(sigma.counts), *(index + 1 for index in sigma.counts)]
    line = scatter(
        "lines",
        "",
        hover="%{y:.1%} at most %{x:.2f} m",
        x=[round(error_statistics.lower_edge_m(edge), 5) for edge in edges],
        y=[round(count / sigma.fingerprints, 5) for count in accumulate(sigma.counts.values(), initial=0)],
        line={"color": BLUE, "width": 2.2},
    )
    ticks = [step * 10.0**power for power in range(-3, 3) for step in (1, 2, 3, 5, 7)]
    x = axis("sigma / m", type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks])
    y = axis("share of the fingerprints", [0.0, 1.02], tickformat=".0%")
    return _chart("Sigma of the fingerprints' positions", [line], x, y)


def over_time(
    sessions: Sequence[SessionStatistics], technology: str, colours: Mapping[str, str] | None = None
) -> Chart:
    """Cumulative labelled fingerprints of dated walks, in total and by device with a colour."""
    dated = sorted(
        ((walk.started, walk.session, walk) for walk in sessions if walk.started), key=lambda found: found[:2]
    )
    layers = []
    for device, colour in ((None, BLUE if colours is None else "#000000"), *(colours or {}).items()):
        own = [row for row in dated if device in (None, row[2].device)]
        counts = [walk.labels[technology].labelled if technology in walk.labels else 0 for *_, walk in own]
        layers.append(
            scatter(
                "lines+markers",
                "all devices" if device is None else plotly_text(device),
                hover="%{text}<br>%{y} fingerprints so far",
                x=[started.isoformat() for started, *_ in own],
                y=list(accumulate(counts)),
                text=[plotly_text(session) for _, session, _ in own],
                line={"color": colour, "shape": "hv"},
                marker={"size": 5},
            )
        )
    y = axis("labelled fingerprints", rangemode="tozero")
    return _chart("Labelled fingerprints over time", layers, axis("", type="date"), y)


def _chart(title: str, layers: Sequence[Trace], x: Trace, y: Trace, **layout: Any) -> Chart:
    look = {"height": 340, "hovermode": "closest", "dragmode": "zoom", "showlegend": False} | layout
    return Chart(layers, x, y, title, look)


_ROW_IN = 0.17
"""Height of a bar and the gap to the next, inches."""


def _with(chart: Chart, *layers: Trace, legend: bool = False) -> Chart:
    """A chart with more layers, and perhaps a legend."""
    return replace(chart, layers=[*chart.layers, *layers], layout={**chart.layout, "showlegend": legend})


def _rows(charts: Sequence[Chart], rows: int) -> Figure:
    """Bar charts side by side, with a height for the given number of rows."""
    return printed(charts, aspect=len(charts) * (0.3 + _ROW_IN * max(3, rows)) / PAGE_IN)


def _numbered(chart: Chart) -> Chart:
    """Stacked bars with the number of all labelled fingerprints at their ends."""
    *labelled, missing = chart.layers
    counts = np.sum([layer["x"] for layer in labelled], axis=0)
    ends = (counts + missing["x"]).tolist()
    wide = _with(chart, written(None, list(map(str, counts)), "middle right") | {"x": ends, "y": missing["y"]})
    return replace(wide, x=chart.x | {"range": (0, 1.13 * max([*ends, 1]))})


def fingerprints_by_device_and_floor(technology: TechnologyStatistics) -> Figure:
    """Draw the number of fingerprints per device and floor (paper, Figure 8); unlabelled ones are pale."""
    colours = colours_of(sorted(technology.by_device))
    panels = [_numbered(by_device(technology, colours)), _numbered(by_floor(technology, colours))]
    return _rows(panels, max(len(technology.by_device), len(technology.by_floor)))


def access_points_heard(access_points: Distribution) -> Figure:
    """Draw the number of access points per fingerprint, and the median."""
    chart, median = heard(access_points), access_points.quantiles["0.5"]
    top = 1.1 * max(chart.layers[0]["y"])
    middle = line("", [(median, 0), (median, top)], "#000000", 1.5, "dash")
    name = written([(median, top)], [f"median {median:g}"], "bottom right")
    return printed([_with(chart, middle, name)], width_in=COLUMN_IN, aspect=0.55)


def rssi_by_device(rssi: Mapping[str, DeviceRssi]) -> Figure:
    """Draw the RSSI of each device, and its offset from others at the same place, with numbers."""
    boxes, offsets = rssi_boxes(rssi), rssi_offsets(rssi)
    if offsets is None:
        return _rows([boxes], len(rssi))
    (bar,) = offsets.layers
    sides = [f"middle {'left' if offset < 0 else 'right'}" for offset in bar["x"]]
    text = [f"{offset:+.1f}" for offset in bar["x"]]
    reach = 1.3 * max([1.0, *map(abs, bar["x"])])
    numbered = _with(offsets, written(None, text) | {"x": bar["x"], "y": bar["y"], "textposition": sides})
    unknown = ", ".join(device for device, one in rssi.items() if one.offset_db is None)
    title = f"{offsets.title} (unknown: {unknown})" if unknown else offsets.title
    return _rows([boxes, replace(numbered, title=title, x=offsets.x | {"range": (-reach, reach)})], len(rssi))


def sigma_distribution(sigma: SigmaDistribution) -> Figure:
    """Draw the share of fingerprints with at most a given sigma, with median and 95 %."""
    named = [f"median: {sigma.median_m:.2f} m", f"95 %: {sigma.p95_m:.2f} m"]
    places = [(sigma.median_m, 0.5), (sigma.p95_m, 0.95)]
    chart = _with(sigma_curve(sigma), dots("", places, BLUE, 8, text=named, textposition="bottom right"))
    return printed([chart], width_in=COLUMN_IN, aspect=0.55)


def fingerprints_over_time(sessions: Sequence[SessionStatistics], technology: str) -> Figure:
    """Draw the cumulative labelled fingerprints of dated walks by device."""
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
    """Count the cells of every floor and plan walks to fill its gaps, from its start in ``starts`` if given."""
    return [
        CoveredFloor(
            title=storey_title(covered.storey, dataset.site_floor(covered.storey).name),
            floor=dataset.site_floor(covered.storey),
            coverage=covered,
            walks=gap_walks(covered, settings.radius_m, starts.get(covered.storey)),
        )
        for covered in coverage(dataset, technology, settings)
    ]


def dataset_figures(statistics: DatasetStatistics, floors: Sequence[CoveredFloor]) -> Iterator[tuple[str, Figure]]:
    """Yield the figures with data: of Wi-Fi, or otherwise of the technology with most fingerprints."""
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
