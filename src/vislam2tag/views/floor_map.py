"""The map of a floor on a page: its plan, what was surveyed, and the layers that results add, as Plotly's traces.

The page joins the sessions' parts into the floor's traces, so only one session is in memory while it is written.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from vislam2tag.common.palette import EVENT_STYLES, STATUS_STYLES
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.faults import EventKind
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import EventMark, LandmarkContradiction, Polyline, SessionResult, Stretch, VisitMark
from vislam2tag.survey.model import Floor
from vislam2tag.survey.plans.load import plan_picture
from vislam2tag.views.page import data_uri

if TYPE_CHECKING:
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


_RED = "#b00020"
_BARB = 0.25
"""Length of the arrow's barbs as a share of its own."""
_BARB_TURN = np.exp(1j * np.pi * (1 - 1 / 7))


def arrows(contradictions: Sequence[LandmarkContradiction]) -> list[Trace]:
    """Return one trace with an arrow, true to scale, and a text at its tip for each; none where nothing contradicts."""
    if not contradictions:
        return []
    columns: Columns = {"x": [], "y": [], "text": [], "textposition": [], "hovertext": []}
    for found in contradictions:
        line = arrow_line(complex(*found.surveyed_m), complex(*found.offset_m))
        columns["x"] += [*np.round(line.real, 3).tolist(), None]
        columns["y"] += [*np.round(line.imag, 3).tolist(), None]
        columns["text"] += ["", plotly_text(_label(found)), *[""] * 4]
        columns["textposition"] += ["middle left" if found.offset_m[0] < 0 else "middle right"] * 6
        columns["hovertext"] += [plotly_text(_sentence(found))] * 6
    return [
        {
            "type": "scatter",
            "mode": "lines+text",
            "name": "contradicting landmark",
            "line": {"color": _RED, "width": 2.5},
            "textfont": {"size": 12, "color": _RED, "shadow": "0 0 2px white, 0 0 2px white, 0 0 3px white"},
            "hovertemplate": "%{hovertext}<extra></extra>",
            **columns,
        }
    ]


def size_m(found: LandmarkContradiction) -> float:
    """Length of the mean offset, metres."""
    return math.hypot(*found.offset_m)


def arrow_line(start: complex, offset: complex) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the points (5,) of an arrow in one line: start, tip, one barb, tip, the other barb; x + iy, metres."""
    tip = start + offset
    one, other = tip + _BARB * offset * _BARB_TURN, tip + _BARB * offset / _BARB_TURN
    return np.array([start, tip, one, tip, other])


def _label(found: LandmarkContradiction) -> str:
    return f"{found.landmark}: {size_m(found):.2f} m off"


def _sentence(found: LandmarkContradiction) -> str:
    return (
        f"{found.called} contradicts the others<br>by {size_m(found):.2f} m "
        f"(in {found.sessions} of the {found.seen} sessions that logged it)"
    )


MAX_PIXELS = 1400
"""Longer side of the embedded plan, pixels."""

_JPEG_QUALITY = 80


def plan_data_uri(floor: Floor) -> str:
    """Return a floor's plan over its extent, scaled to at most :data:`MAX_PIXELS`, as a JPEG data URI.

    Raises OSError where it is unreadable, as :func:`vislam2tag.survey.plans.load.plan_picture` does.
    """
    buffer = io.BytesIO()
    plan_picture(floor, MAX_PIXELS).save(buffer, "JPEG", quality=_JPEG_QUALITY, optimize=True)
    return data_uri(buffer.getvalue(), "image/jpeg")


def drawn_plan(floor: Floor) -> tuple[str | None, str]:
    """Return a floor's plan as a data URI where it can be drawn, else None and a sentence that says why not."""
    plan = floor.plan
    if plan is None:
        return None, "There is no plan of this floor: a grid is drawn instead."
    if floor.extent_m is None:
        return None, f"{plan.name} is not drawn, as no file gives the floor's size: a grid is drawn instead."
    try:
        return plan_data_uri(floor), ""
    except OSError as error:
        return None, f"{plan.name} {error}: a grid is drawn instead."


FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
_MARGIN_M = 1.0
_GRID = "#e4e7ea"
_HALO = "0 0 2px white, 0 0 2px white, 0 0 3px white"


@dataclass(frozen=True)
class TimeBar:
    """One session's column in the overview: what it is called, where its row is, and its seconds by status."""

    floor: str
    name: str
    anchor: str
    seconds: dict[str, float]
    failed: bool


def floor_figure(
    floor: Floor, landmarks: Landmarks, plan: str | None, contradictions: Sequence[LandmarkContradiction] = ()
) -> str:
    """Return, as JSON, a floor's map in BCS metres: plan (a data URI), landmarks, control points, contradictions.

    Its session layers are still empty (:func:`.session_traces`); the plan covers width x
    height of the floor, and a metric grid stands in where there is none. The axes span the plan and all that was
    surveyed, also beside it; the page widens them by what is mapped.
    """
    return site_figure(floor, landmarks, plan, session_traces(), arrows(contradictions))


def site_figure(
    floor: Floor, landmarks: Landmarks, plan: str | None, below: Sequence[Trace], above: Sequence[Trace]
) -> str:
    """Return, as JSON, a floor's plan and what was surveyed there, with traces below and above it."""
    figure = go.Figure(data=[*below, *_site_traces(floor, landmarks), *above], layout_template="none")
    figure.update_layout(page_layout())
    x, y = np.vstack((landmarks.position_bcs[surveyed_on(floor, landmarks)], floor.control_points.position_bcs)).T
    across, up = (_span(np.append(*each)) for each in zip(floor.corners_m.T, (x, y), strict=True))
    figure.update_xaxes(axis("x / m", across, grid=plan is None), constrain="domain")
    figure.update_yaxes(axis("y / m", up, grid=plan is None), scaleanchor="x", constrain="domain")
    if plan:
        figure.add_layout_image(placed_plan(plan, floor))
    return figure_json(figure)


def surveyed_on(floor: Floor, landmarks: Landmarks) -> BoolArray:
    """Return which of the landmarks (n,) lie on this floor and have a surveyed position, (n,)."""
    placed = landmarks.surveyed & np.isfinite(landmarks.position_bcs).all(axis=1)
    return np.asarray(placed & (landmarks.floor == floor.number))


def time_figure(bars: Sequence[TimeBar]) -> str:
    """Return, as JSON, stacked columns of minutes by status, one for each session, floor beside floor."""
    figure = go.Figure(layout_template="none")
    for label, style in STATUS_STYLES.items():
        minutes = [round(bar.seconds.get(label, 0.0) / 60, 3) for bar in bars]
        if any(minutes):
            figure.add_bar(
                **_columns(bars, range(len(bars)), f"{style.name}: %{{y:.2f}} min"),
                y=minutes,
                name=style.name,
                marker_color=style.colour,
            )
    failed = [index for index, bar in enumerate(bars) if bar.failed]
    if failed:
        figure.add_scatter(
            **_columns(bars, failed, "failed"),
            y=[0.0] * len(failed),
            mode="markers",
            name="failed session",
            marker={"symbol": "x", "size": 11, "color": "#b00020"},
            cliponaxis=False,
        )
    names = [plotly_text(bar.name) for bar in bars]
    figure.update_layout(page_layout(), barmode="stack", bargap=0.35, hovermode="closest", dragmode=False)
    figure.update_xaxes(tickvals=list(range(len(bars))), ticktext=names, tickangle=-90, range=[-0.6, len(bars) - 0.4])
    figure.update_xaxes(fixedrange=True, automargin=True, showgrid=False, zeroline=False)
    figure.update_yaxes(title="minutes", gridcolor=_GRID, fixedrange=True, rangemode="tozero", automargin=True)
    _name_floors(figure, bars)
    return figure_json(figure)


def _columns(bars: Sequence[TimeBar], places: Sequence[int], hover: str) -> dict[str, Any]:
    """Return where a trace of the overview stands, what its hover says and which rows its columns lead to."""
    return {
        "x": list(places),
        "hovertext": [plotly_text(f"{bars[place].floor}, {bars[place].name}") for place in places],
        "hovertemplate": f"%{{hovertext}}<br>{hover}<extra></extra>",
        "customdata": [bars[place].anchor for place in places],
    }


def _name_floors(figure: go.Figure, bars: Sequence[TimeBar]) -> None:
    """Write each floor's name above its columns, and a line between floors."""
    for floor, group in groupby(enumerate(bars), key=lambda item: item[1].floor):
        places = [place for place, _ in group]
        figure.add_annotation(
            x=(places[0] + places[-1]) / 2, y=1, yref="paper", yanchor="bottom", text=floor, showarrow=False
        )
        if places[0] > 0:
            figure.add_vline(x=places[0] - 0.5, line={"color": "#8c959f", "width": 1})


def _site_traces(floor: Floor, landmarks: Landmarks) -> list[Trace]:
    """Return the floor's landmarks, surveyed or not, and its control points."""
    here = (landmarks.floor == floor.number) & np.isfinite(landmarks.position_bcs).all(axis=1)
    known = _pick(landmarks, surveyed_on(floor, landmarks))
    unknown = _pick(landmarks, here & ~landmarks.surveyed)
    points = floor.control_points
    return [
        _named("control point", points.ids, points.position_bcs, {"symbol": "cross-thin-open", "color": "#6a3d9a"}),
        _named("landmark", *known, {"symbol": "square", "color": "#1b1b1b"}),
        _named("landmark, not surveyed", *unknown, {"symbol": "square-open", "color": "#b00020"}),
    ]


def _pick(landmarks: Landmarks, wanted: BoolArray) -> tuple[tuple[str, ...], FloatArray]:
    index = np.flatnonzero(wanted)
    return tuple(landmarks.ids[i] for i in index), landmarks.position_bcs[index]


def _named(name: str, ids: Sequence[str], position_bcs: FloatArray, marker: dict[str, Any]) -> Trace:
    """Return a trace of points with their ids beside them."""
    xy = np.round(position_bcs, 3)
    return {
        "type": "scatter",
        "mode": "markers+text",
        "name": name,
        "x": xy[:, 0].tolist(),
        "y": xy[:, 1].tolist(),
        "text": [plotly_text(landmark) for landmark in ids],
        "textposition": "top right",
        "textfont": {"size": 11, "color": marker["color"], "shadow": _HALO},
        "marker": {"size": 8, "line": {"width": 2}, **marker},
        "hovertemplate": f"{name} %{{text}}<br>x %{{x:.2f}} m, y %{{y:.2f}} m<extra></extra>",
    }


def page_layout() -> dict[str, Any]:
    """Return what the page's figures have in common."""
    return {
        "font": {"family": FONT, "size": 12, "color": "#24292f"},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "dragmode": "pan",
        "hoverlabel": {"align": "left"},
        "legend": {"itemclick": "toggle", "itemdoubleclick": "toggleothers"},
    }


def _span(known: FloatArray) -> list[float] | None:
    """Return the range of an axis around the plan's edges and the surveyed values; None where nothing is known."""
    return [float(known.min()) - _MARGIN_M, float(known.max()) + _MARGIN_M] if len(known) else None


def axis(title: str, span: list[float] | None, grid: bool) -> dict[str, Any]:
    """Return an axis with its title, its range (None: as the data ask) and perhaps a grid."""
    return {
        "title": {"text": title},
        "showgrid": grid,
        "gridcolor": _GRID,
        "zeroline": False,
        "ticks": "outside",
        "tickcolor": _GRID,
        "automargin": True,
        **({} if span is None else {"range": span}),
    }


def colour_bar(title: str) -> dict[str, Any]:
    """Return a bar of colours above a map, where it takes no width on a narrow screen."""
    return {
        "title": {"text": title, "side": "top"},
        "orientation": "h",
        "thickness": 10,
        "len": 0.6,
        "x": 0.5,
        "y": 1.0,
        "yanchor": "bottom",
    }


def placed_plan(image: str, floor: Floor) -> dict[str, Any]:
    """Return the plan as a layout image that covers exactly width x height of the floor."""
    return {
        "source": image,
        "xref": "x",
        "yref": "y",
        "x": floor.lower_left_m[0],
        "y": None if floor.height_m is None else floor.lower_left_m[1] + floor.height_m,
        "sizex": floor.width_m,
        "sizey": floor.height_m,
        "sizing": "stretch",
        "layer": "below",
        "opacity": 0.75,
    }


def figure_json(figure: go.Figure) -> str:
    """Write a figure as JSON."""
    # The standard library's encoder, so that the bytes do not depend on what else is installed.
    text: str = figure.to_json(engine="json")
    return text
