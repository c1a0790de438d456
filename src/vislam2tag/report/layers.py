"""What is drawn on a floor: the layers of its figure, and each session's share of them.

The page joins the sessions' parts into the floor's traces, so only one session is in memory while it is written.
"""

from __future__ import annotations

from html import escape
from typing import Any

from vislam2tag.core.status import Status
from vislam2tag.report.palette import STATUS_STYLES
from vislam2tag.results import Polyline, SessionResult, Stretch, VisitMark

RAW, WIFI, VISITS = "raw", "wifi", "visits"
"""Layers beside those named by a status."""

Trace = dict[str, Any]
"""A Plotly trace in the form its constructors and its JSON take."""

_POINT_HOVER = "%{text}<br>x %{x:.2f} m, y %{y:.2f} m<extra></extra>"


def session_traces() -> list[Trace]:
    """Return the empty traces, bottom to top, that the sessions' parts fill; ``meta`` names the layer."""
    discarded = [label for label in STATUS_STYLES if label not in (Status.OK.label, Status.UNCERTAIN.label)]
    return [
        _line(RAW, "raw path (aligned)", "#8a8a8a", "solid", width=1),
        *(_status_line(label, width=2.5) for label in discarded),
        _status_line(Status.OK.label, width=2),
        _status_line(Status.UNCERTAIN.label, width=2),
        _markers(WIFI, "Wi-Fi scan", {"size": 6, "color": "#009e73", "line": {"width": 1, "color": "white"}}),
        _markers(VISITS, "landmark visit", _ring("#000000")),
    ]


def session_part(result: SessionResult) -> dict[str, Any]:
    """Return the coordinates of one session by layer: ``[x, y]`` or ``[x, y, hover text]``, None between stretches."""
    drawing = result.drawing
    layers: dict[str, list[list[Any]]] = {RAW: _points(drawing.raw), WIFI: _points(drawing.wifi)}
    for stretch in (*drawing.mapped, *drawing.discarded):
        _append(layers.setdefault(stretch.status, [[], []]), stretch)
    layers[VISITS] = _visits(result)
    drawn = {name: columns for name, columns in layers.items() if columns[0]}
    name = f"{result.device} / {result.session}"
    return {"name": name, "hover": plotly_text(name), "layers": drawn}


def plotly_text(text: str) -> str:
    """Escape text of the user's for Plotly, which reads a few HTML tags in names and hover texts."""
    return escape(text, quote=False)


def _status_line(label: str, width: float) -> Trace:
    style = STATUS_STYLES[label]
    return _line(label, style.name, style.colour, style.dash, width)


def _line(layer: str, name: str, colour: str, dash: str, width: float) -> Trace:
    return {
        "type": "scatter",
        "mode": "lines",
        "meta": layer,
        "name": name,
        "line": {"color": colour, "dash": dash, "width": width},
        "hovertemplate": f"{name}<br>{_POINT_HOVER}",
    }


def _markers(layer: str, name: str, marker: dict[str, Any]) -> Trace:
    return {
        "type": "scatter",
        "mode": "markers",
        "meta": layer,
        "name": name,
        "marker": marker,
        "hovertemplate": f"{name}<br>{_POINT_HOVER}",
    }


def _ring(colour: str) -> dict[str, Any]:
    return {"symbol": "circle-open", "size": 9, "color": colour, "line": {"width": 1.5}}


def _points(line: Polyline) -> list[list[Any]]:
    return [[round(x, 2) for x, _ in line], [round(y, 2) for _, y in line]]


def _append(columns: list[list[Any]], stretch: Stretch) -> None:
    """Add a stretch to a layer, apart from the one before."""
    if not stretch.points:
        return
    for column, values in zip(columns, _points(stretch.points), strict=True):
        if column:
            column.append(None)
        column.extend(values)


def _visits(result: SessionResult) -> list[list[Any]]:
    placed = [(visit, visit.position) for visit in result.visits if visit.position is not None]
    xy = _points([position for _, position in placed])
    name = f"{result.device} / {result.session}"
    return [*xy, [plotly_text(f"{name}: {_visit_text(visit, result.start_ns)}") for visit, _ in placed]]


def _visit_text(visit: VisitMark, start_ns: int | None) -> str:
    since = "" if start_ns is None else f" after {(visit.time_ns - start_ns) / 1e9:.0f} s"
    return f"landmark {visit.landmark}, {visit.distance_m:.2f} m away{since}"
