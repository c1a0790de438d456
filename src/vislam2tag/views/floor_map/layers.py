"""What is drawn on a floor: the layers of its figure, and each session's share of them.

The page joins the sessions' parts into the floor's traces, so only one session is in memory while it is written.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from vislam2tag.common.palette import EVENT_STYLES, STATUS_STYLES
from vislam2tag.core.faults import EventKind
from vislam2tag.core.status import Status
from vislam2tag.labeling.results import EventMark, Polyline, SessionResult, Stretch, VisitMark

if TYPE_CHECKING:  # SciPy, which the report of a run does without
    from vislam2tag.walkable.walked.walked_record import WalkedFloor

RAW, WIFI, VISITS, BAND = "raw", "wifi", "visits", "band"
"""Layers beside those named by a status or by the kind of an event; the page makes the band from the mapped layers."""

Trace = dict[str, Any]
"""A Plotly trace in the form its constructors and its JSON take."""

Columns = dict[str, list[Any]]
"""A layer's ``x`` and ``y`` and, where it has them, ``hover`` texts and ``sigma`` in metres; equally long."""

_FILLING = "#8a2d77"
_POINT_HOVER = "%{hovertext}<br>x %{x:.2f} m, y %{y:.2f} m<extra></extra>"


def session_traces() -> list[Trace]:
    """Return the empty traces, bottom to top, that the sessions' parts fill; ``meta`` names the layer."""
    discarded = [label for label in STATUS_STYLES if label not in (Status.OK.label, Status.UNCERTAIN.label)]
    return [
        _band(),
        _line(RAW, "raw path (aligned)", "#8a8a8a", "solid", width=1),
        *(_status_line(label, width=2.5) for label in discarded),
        _status_line(Status.OK.label, width=2),
        _status_line(Status.UNCERTAIN.label, width=3.5),
        _markers(WIFI, "Wi-Fi scan", {"size": 6, "color": "#009e73", "line": {"width": 1, "color": "white"}}),
        _markers(VISITS, "landmark visit", _ring("#000000")),
        *(
            _markers(event_layer(kind), f"tracker: {style.name}", _symbol(style.symbol, style.colour))
            for kind, style in EVENT_STYLES.items()
        ),
    ]


def session_part(result: SessionResult, floor: int | None = None) -> dict[str, Any]:
    """Return the columns of one session by layer, None between its stretches; layers without a point are left out.

    They are those of another ``floor`` that the walk led to, or of the session's own.
    """
    drawing = result.drawing if floor is None else result.elsewhere[floor]
    stretches = (*drawing.mapped, *drawing.discarded)
    layers: dict[str, Columns] = {RAW: _points(drawing.raw), WIFI: _points(drawing.wifi)}
    for status in dict.fromkeys(stretch.status for stretch in stretches):
        layers[status] = _joined(stretch for stretch in stretches if stretch.status == status)
    for layer, (x, y), text in _marks(result, floor):
        columns = layers.setdefault(layer, {"x": [], "y": [], "hover": []})
        for name, value in (("x", x), ("y", y), ("hover", plotly_text(f"{result.device} / {result.session}: {text}"))):
            columns[name].append(value)
    name = f"{result.device} / {result.session}"
    drawn = {layer: columns for layer, columns in layers.items() if columns["x"]}
    return {"name": name, "hover": plotly_text(name), "layers": drawn}


def event_layer(kind: EventKind) -> str:
    """Name the layer of a kind of event (a status may be called alike)."""
    return f"event_{kind.value}"


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


def _band() -> Trace:
    return {
        "type": "scatter",
        "mode": "lines",
        "fill": "toself",
        "meta": BAND,
        "name": "95 % region",
        "line": {"width": 0},
        "fillcolor": "rgba(110, 119, 129, 0.22)",
        "hoverinfo": "skip",
    }


def _symbol(symbol: str, colour: str) -> dict[str, Any]:
    return {"symbol": symbol, "size": 11, "color": colour, "line": {"width": 2}}


def _ring(colour: str) -> dict[str, Any]:
    return {"symbol": "circle-open", "size": 9, "color": colour, "line": {"width": 1.5}}


def _points(line: Polyline) -> Columns:
    return {"x": [round(x, 2) for x, _ in line], "y": [round(y, 2) for _, y in line]}


def _joined(stretches: Iterable[Stretch]) -> Columns:
    """Put stretches one after the other, apart."""
    columns: Columns = {"x": [], "y": [], "sigma": []}
    for stretch in stretches:
        if columns["x"] and stretch.points:
            for column in columns.values():
                column.append(None)
        sigma: list[Any] = stretch.sigma_m or [None] * len(stretch.points)
        for name, values in (_points(stretch.points) | {"sigma": sigma}).items():
            columns[name].extend(values)
    if not any(columns["sigma"]):
        del columns["sigma"]
    return columns


def _marks(result: SessionResult, floor: int | None) -> Iterator[tuple[str, tuple[float, float], str]]:
    """Yield layer, place and text of each visit and event that has a place on a floor (None: the session's own)."""
    for visit in result.visits:
        if visit.position is not None and visit.floor == floor:
            yield VISITS, visit.position, _visit_text(visit, result.start_ns)
    for event in result.events:
        if event.position is not None and event.floor == floor:
            yield event_layer(event.kind), event.position, _event_text(event, result.start_ns)


def _visit_text(visit: VisitMark, start_ns: int | None) -> str:
    return f"landmark {visit.landmark}, {visit.distance_m:.2f} m away{_since(visit.time_ns, start_ns)}"


def _event_text(event: EventMark, start_ns: int | None) -> str:
    turn = "" if event.turn_rad is None else f", turned by {math.degrees(event.turn_rad):.1f}°"
    why = f" ({event.reason.lower().replace('_', ' ')})" if event.reason else ""
    return f"{EVENT_STYLES[event.kind].name}{why} of {event.size_m:.2f} m{turn}{_since(event.time_ns, start_ns)}"


def _since(time_ns: int, start_ns: int | None) -> str:
    return "" if start_ns is None else f" after {(time_ns - start_ns) / 1e9:.0f} s"


def walk_to_fill(walked: WalkedFloor | None) -> list[Trace]:
    """The walk that fills what was not walked."""
    if walked is None or walked.walk is None:
        return []
    x, y = np.array(walked.walk.points_m).T.tolist()
    name = f"walk that fills the rest, {walked.walk.length_m:.0f} m"
    return [
        {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": x,
            "y": y,
            "line": {"color": _FILLING, "width": 2.5},
            "hoverinfo": "name",
        }
    ]
