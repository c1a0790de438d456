"""The charts of a data set's page: fingerprints by device and floor, over time, access points, RSSI, sigma."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate

import plotly.graph_objects as go

from vislam2tag.common import log_bins
from vislam2tag.dataset.statistics_record import DeviceRssi, SessionStatistics, TechnologyStatistics
from vislam2tag.views.dataset_figures import BINS, floor_name
from vislam2tag.views.floor_map import axis, figure_json, page_layout, plotly_text

BLUE, GREY, ORANGE = "#0072b2", "#c9d1d9", "#e69f00"


def charts(
    technology: TechnologyStatistics, sessions: Sequence[SessionStatistics], name: str, colours: Mapping[str, str]
) -> list[tuple[str, str, str]]:
    """Each chart that there is data for: its title, a sentence, and Plotly's JSON."""
    several = len({walk.started for walk in sessions if walk.started}) > 1
    made = (
        ("Fingerprints per device", "Pale: not labelled.", _by_device(technology, colours)),
        ("Fingerprints per floor", "Those without a label count where their walk was.", _by_floor(technology, colours)),
        ("Access points heard in a fingerprint", "", _heard(technology)),
        (
            "RSSI by device",
            "Box: half of the readings; line: 5 % to 95 %. Of all that is heard, wherever it was walked.",
            _rssi(technology.rssi) if technology.rssi else None,
        ),
        (
            "How much louder a device hears",
            "Against the mean of the devices that heard the same access point in the same 2 m cell.",
            _offsets(technology.rssi),
        ),
        (
            "Sigma of the fingerprints' positions",
            "Share of the fingerprints that are at least so sure.",
            _sigma(technology),
        ),
        ("Labelled fingerprints over time", "", _over_time(sessions, name) if several else None),
    )
    return [(title, about, figure) for title, about, figure in made if figure is not None]


def _by_device(technology: TechnologyStatistics, colours: Mapping[str, str]) -> str:
    devices = sorted(technology.by_device, key=lambda device: technology.by_device[device].fingerprints)
    figure = _figure()
    for shown, colour in (("labelled", [colours.get(device, BLUE) for device in devices]), ("not labelled", GREY)):
        labels = [technology.by_device[device] for device in devices]
        figure.add_bar(
            orientation="h",
            name=shown,
            y=[plotly_text(device) for device in devices],
            x=[one.labelled if shown == "labelled" else one.fingerprints - one.labelled for one in labels],
            marker_color=colour,
            hovertemplate=f"%{{y}}: %{{x}} {shown}<extra></extra>",
        )
    figure.update_layout(barmode="stack", showlegend=False)
    return _bars(figure, len(devices))


def _by_floor(technology: TechnologyStatistics, colours: Mapping[str, str]) -> str:
    figure = _figure()
    floors = [plotly_text(floor_name(floor)) for floor in technology.by_floor]
    for device in sorted(technology.by_device):
        counts = [floor.by_device[device].labelled if device in floor.by_device else 0 for floor in technology.by_floor]
        figure.add_bar(
            orientation="h",
            name=plotly_text(device),
            y=floors,
            x=counts,
            marker_color=colours.get(device, BLUE),
            hovertemplate=f"%{{y}}, {plotly_text(device)}: %{{x}}<extra></extra>",
        )
    missing = [floor.labels.fingerprints - floor.labels.labelled for floor in technology.by_floor]
    figure.add_bar(orientation="h", name="not labelled", y=floors, x=missing, marker_color=GREY)
    figure.update_layout(barmode="stack", showlegend=False)
    return _bars(figure, len(floors))


def _bars(figure: go.Figure, rows: int) -> str:
    figure.update_layout(height=90 + 24 * max(3, rows), bargap=max(0.2, 1 - 0.27 * rows))
    figure.update_xaxes(axis("fingerprints", None, grid=True), rangemode="tozero")
    figure.update_yaxes(type="category", automargin=True)
    return figure_json(figure)


def _heard(technology: TechnologyStatistics) -> str:
    figure = _figure()
    width, bins = technology.heard.binned(BINS)
    figure.add_bar(
        x=[lowest + (width - 1) / 2 for lowest in bins],
        y=list(bins.values()),
        text=[str(lowest) if width == 1 else f"{lowest} to {lowest + width - 1}" for lowest in bins],
        textposition="none",
        marker_color=BLUE,
        hovertemplate="%{text}: %{y} fingerprints<extra></extra>",
    )
    figure.update_layout(bargap=0.05)
    figure.update_xaxes(axis("access points heard", None, grid=False))
    figure.update_yaxes(axis("fingerprints", None, grid=True))
    return figure_json(figure)


def _rssi(rssi: Mapping[str, DeviceRssi]) -> str:
    devices = sorted(rssi, key=lambda device: rssi[device].rssi_dbm.quantiles["0.5"])
    low, first, median, third, high = zip(
        *(rssi[device].rssi_dbm.quantiles.values() for device in devices), strict=True
    )
    figure = _figure()
    figure.add_box(
        y=[plotly_text(device) for device in devices],
        lowerfence=low,
        q1=first,
        median=median,
        q3=third,
        upperfence=high,
        mean=[rssi[device].rssi_dbm.mean for device in devices],
        orientation="h",
        line={"color": BLUE, "width": 1.4},
        name="",
    )
    figure.update_layout(height=90 + 26 * max(3, len(devices)), showlegend=False)
    figure.update_xaxes(axis("RSSI / dBm", None, grid=True))
    figure.update_yaxes(type="category", automargin=True)
    return figure_json(figure)


def _offsets(rssi: Mapping[str, DeviceRssi]) -> str | None:
    """None where no two devices heard the same access point in a cell."""
    known = {device: one for device, one in rssi.items() if one.offset_db is not None}
    if not known:
        return None
    devices = sorted(known, key=lambda device: known[device].offset_db or 0.0)
    figure = _figure()
    figure.add_bar(
        orientation="h",
        y=[plotly_text(device) for device in devices],
        x=[known[device].offset_db for device in devices],
        customdata=[known[device].shared for device in devices],
        marker_color=ORANGE,
        hovertemplate="%{y}: %{x:+.1f} dB over %{customdata} places<extra></extra>",
    )
    figure.update_layout(height=90 + 26 * max(3, len(devices)))
    figure.update_xaxes(axis("offset / dB", None, grid=True), zeroline=True, zerolinecolor="#24292f")
    figure.update_yaxes(type="category", automargin=True)
    return figure_json(figure)


def _sigma(technology: TechnologyStatistics) -> str | None:
    sigma = technology.sigma
    if sigma is None:
        return None
    figure = _figure()
    figure.add_scatter(
        x=[round(log_bins.lower_edge_m(index + 1), 5) for index in sigma.counts],
        y=[round(count / sigma.fingerprints, 5) for count in accumulate(sigma.counts.values())],
        mode="lines",
        line={"color": BLUE, "width": 2.2},
        hovertemplate="%{y:.1%} at most %{x:.2f} m<extra></extra>",
    )
    ticks = [step * 10.0**power for power in range(-3, 3) for step in (1, 2, 3, 5, 7)]
    figure.update_xaxes(
        axis("sigma / m", None, grid=True), type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks]
    )
    figure.update_yaxes(axis("share of the fingerprints", [0.0, 1.02], grid=True), tickformat=".0%")
    return figure_json(figure)


def _over_time(sessions: Sequence[SessionStatistics], technology: str) -> str:
    dated = sorted(
        ((walk.started, walk.session, walk) for walk in sessions if walk.started), key=lambda found: found[:2]
    )
    counts = [walk.labels[technology].labelled if technology in walk.labels else 0 for *_, walk in dated]
    figure = _figure()
    figure.add_scatter(
        x=[started.isoformat() for started, *_ in dated],
        y=list(accumulate(counts)),
        text=[plotly_text(session) for _, session, _ in dated],
        mode="lines+markers",
        line={"color": BLUE, "shape": "hv"},
        marker={"size": 5},
        hovertemplate="%{text}<br>%{y} fingerprints so far<extra></extra>",
    )
    figure.update_xaxes(axis("", None, grid=True), type="date")
    figure.update_yaxes(axis("labelled fingerprints", None, grid=True), rangemode="tozero")
    return figure_json(figure)


def _figure() -> go.Figure:
    figure = go.Figure(layout_template="none")
    return figure.update_layout(page_layout(), height=340, hovermode="closest", dragmode="zoom", showlegend=False)
