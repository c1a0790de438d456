"""The charts of a data set's page: fingerprints by device and floor, over time, access points, RSSI, sigma."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any

from vislam2tag.common import log_bins
from vislam2tag.datasets.statistics_record import DeviceRssi, SessionStatistics, TechnologyStatistics
from vislam2tag.views.dataset_figures import BINS, floor_name
from vislam2tag.views.layers import BLUE, ORANGE, Trace, axis, chart, figure_json, plotly_text

PALE = "#c9d1d9"


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
    labels = [technology.by_device[device] for device in devices]
    names = [plotly_text(device) for device in devices]
    labelled = [one.labelled for one in labels]
    missing = [one.fingerprints - one.labelled for one in labels]
    own = [colours.get(device, BLUE) for device in devices]
    traces = [
        _bars("labelled", names, labelled, own, "%{y}: %{x} labelled"),
        _bars("not labelled", names, missing, PALE, "%{y}: %{x} not labelled"),
    ]
    return _stacked(traces, len(devices))


def _by_floor(technology: TechnologyStatistics, colours: Mapping[str, str]) -> str:
    floors = [plotly_text(floor_name(floor)) for floor in technology.by_floor]
    traces = []
    for device in sorted(technology.by_device):
        counts = [floor.by_device[device].labelled if device in floor.by_device else 0 for floor in technology.by_floor]
        name = plotly_text(device)
        traces.append(_bars(name, floors, counts, colours.get(device, BLUE), f"%{{y}}, {name}: %{{x}}"))
    missing = [floor.labels.fingerprints - floor.labels.labelled for floor in technology.by_floor]
    return _stacked([*traces, _bars("not labelled", floors, missing, PALE)], len(floors))


def _bars(name: str, y: Sequence[str], x: Sequence[float | None], colour: Any, hover: str = "", **more: Any) -> Trace:
    """Bars from the left."""
    trace = {"type": "bar", "orientation": "h", "name": name, "y": y, "x": x, "marker": {"color": colour}, **more}
    return trace | ({"hovertemplate": f"{hover}<extra></extra>"} if hover else {})


def _stacked(traces: Sequence[Trace], rows: int) -> str:
    layout = {"barmode": "stack", "height": 90 + 24 * max(3, rows), "bargap": max(0.2, 1 - 0.27 * rows)}
    return _chart(traces, axis("fingerprints", rangemode="tozero"), _NAMES, **layout)


def _heard(technology: TechnologyStatistics) -> str:
    width, bins = technology.heard.binned(BINS)
    bars = {
        "type": "bar",
        "x": [lowest + (width - 1) / 2 for lowest in bins],
        "y": list(bins.values()),
        "text": [str(lowest) if width == 1 else f"{lowest} to {lowest + width - 1}" for lowest in bins],
        "textposition": "none",
        "marker": {"color": BLUE},
        "hovertemplate": "%{text}: %{y} fingerprints<extra></extra>",
    }
    return _chart([bars], axis("access points heard", grid=False), axis("fingerprints"), bargap=0.05)


def _rssi(rssi: Mapping[str, DeviceRssi]) -> str:
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
    return _chart([boxes], axis("RSSI / dBm"), _NAMES, height=90 + 26 * max(3, len(devices)))


def _offsets(rssi: Mapping[str, DeviceRssi]) -> str | None:
    """None where no two devices heard the same access point in a cell."""
    known = {device: one for device, one in rssi.items() if one.offset_db is not None}
    if not known:
        return None
    devices = sorted(known, key=lambda device: known[device].offset_db or 0.0)
    names = [plotly_text(device) for device in devices]
    shared = [known[device].shared for device in devices]
    hover = "%{y}: %{x:+.1f} dB over %{customdata} places"
    bars = _bars("", names, [known[device].offset_db for device in devices], ORANGE, hover, customdata=shared)
    del bars["name"]
    x = axis("offset / dB") | {"zeroline": True, "zerolinecolor": "#24292f"}
    return _chart([bars], x, _NAMES, height=90 + 26 * max(3, len(devices)))


def _sigma(technology: TechnologyStatistics) -> str | None:
    sigma = technology.sigma
    if sigma is None:
        return None
    line = {
        "type": "scatter",
        "mode": "lines",
        "x": [round(log_bins.lower_edge_m(index + 1), 5) for index in sigma.counts],
        "y": [round(count / sigma.fingerprints, 5) for count in accumulate(sigma.counts.values())],
        "line": {"color": BLUE, "width": 2.2},
        "hovertemplate": "%{y:.1%} at most %{x:.2f} m<extra></extra>",
    }
    ticks = [step * 10.0**power for power in range(-3, 3) for step in (1, 2, 3, 5, 7)]
    x = axis("sigma / m", type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks])
    return _chart([line], x, axis("share of the fingerprints", [0.0, 1.02], tickformat=".0%"))


def _over_time(sessions: Sequence[SessionStatistics], technology: str) -> str:
    dated = sorted(
        ((walk.started, walk.session, walk) for walk in sessions if walk.started), key=lambda found: found[:2]
    )
    counts = [walk.labels[technology].labelled if technology in walk.labels else 0 for *_, walk in dated]
    line = {
        "type": "scatter",
        "mode": "lines+markers",
        "x": [started.isoformat() for started, *_ in dated],
        "y": list(accumulate(counts)),
        "text": [plotly_text(session) for _, session, _ in dated],
        "line": {"color": BLUE, "shape": "hv"},
        "marker": {"size": 5},
        "hovertemplate": "%{text}<br>%{y} fingerprints so far<extra></extra>",
    }
    return _chart([line], axis("", type="date"), axis("labelled fingerprints", rangemode="tozero"))


_NAMES = {"type": "category", "automargin": True}
"""An axis of devices or floors."""


def _chart(traces: Sequence[Trace], x: Trace, y: Trace, **layout: Any) -> str:
    look = {"height": 340, "hovermode": "closest", "dragmode": "zoom", "showlegend": False} | layout
    return figure_json(chart(traces, x, y, **look))
