"""The map of a floor on a page: its plan, what was surveyed, and the layers that results add, as Plotly's traces.

The page joins the sessions' parts into the floor's traces, so only one session is in memory while it is written.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from vislam2tag.common.palette import EVENT_STYLES, STATUS_STYLES
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.status import EventKind, Status
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import (
    EventMark,
    LandmarkContradiction,
    PlacingRecord,
    Polyline,
    SessionResult,
    Stretch,
    VisitMark,
)
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import plan_picture
from vislam2tag.views.layers import (
    HALO,
    RED,
    Columns,
    Trace,
    arrows,
    axis,
    chart,
    figure_json,
    plotly_text,
    scatter,
)
from vislam2tag.views.page import data_uri

if TYPE_CHECKING:  # SciPy, which the report of a run does without
    from vislam2tag.site.walkable.walked import WalkedFloor

RAW, WIFI, VISITS, BAND = "raw", "wifi", "visits", "band"
"""Layers besides those named by a status or kind of event; the page computes the band from the mapped layers."""

_POINT_HOVER = "%{hovertext}<br>x %{x:.2f} m, y %{y:.2f} m"
MAX_PIXELS = 1400
"""Longer side of the embedded plan, pixels."""
_JPEG_QUALITY = 80
_MARGIN_M = 1.0
_MIN_WEIGHT = 0.02
"""Less probable paths are not drawn."""
_PATH_LOOKS = (
    *(("#0072b2", "solid", 2.5), ("#e69f00", "dash", 2.0), ("#009e73", "dot", 1.6), ("#d55e00", "dashdot", 1.4)),
    *(("#cc79a7", "solid", 1.2), ("#56b4e9", "dash", 1.2), ("#9a6200", "dot", 1.2), ("#6e7781", "dashdot", 1.2)),
)
"""Colour, dash and width of the possible paths, the most probable first, as in the studio."""
PATHS = tuple(f"path_{rank}" for rank in range(1, len(_PATH_LOOKS) + 1))
"""Layers of the possible paths."""


def session_traces() -> list[Trace]:
    """Return the empty traces, bottom to top, that the sessions' parts fill; ``meta`` names the layer."""
    discarded = [label for label in STATUS_STYLES if label not in (Status.OK.label, Status.UNCERTAIN.label)]
    wifi = {"size": 6, "color": "#009e73", "line": {"width": 1, "color": "white"}}
    visit = {"symbol": "circle-open", "size": 9, "color": "#000000", "line": {"width": 1.5}}
    band: dict[str, Any] = {
        "meta": BAND,
        "line": {"width": 0},
        "fillcolor": "rgba(110, 119, 129, 0.22)",
        "hoverinfo": "skip",
    }
    return [
        scatter("lines", "95 % region", fill="toself", **band),
        _layer("lines", RAW, "raw path (aligned)", line={"color": "#8a8a8a", "dash": "solid", "width": 1}),
        *(
            _layer("lines", layer, f"possible path {rank}", line={"color": colour, "dash": dash, "width": width})
            for rank, (layer, (colour, dash, width)) in enumerate(zip(PATHS, _PATH_LOOKS, strict=True), start=1)
        ),
        *(_status_line(label, width=2.5) for label in discarded),
        _status_line(Status.OK.label, width=2),
        _status_line(Status.UNCERTAIN.label, width=3.5),
        _layer("markers", WIFI, "Wi-Fi scan", marker=wifi),
        _layer("markers", VISITS, "landmark visit", marker=visit),
        *(
            _layer(
                "markers",
                event_layer(kind),
                f"tracker: {style.name}",
                marker={"symbol": style.symbol, "size": 11, "color": style.colour, "line": {"width": 2}},
            )
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
    if floor is None and result.placing is not None:
        layers |= _possible_paths(result.placing, f"{result.device} / {result.session}")
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


def _status_line(label: str, width: float) -> Trace:
    style = STATUS_STYLES[label]
    return _layer("lines", label, style.name, line={"color": style.colour, "dash": style.dash, "width": width})


def _layer(mode: str, layer: str, name: str, **look: Any) -> Trace:
    return scatter(mode, name, None, f"{name}<br>{_POINT_HOVER}", meta=layer, **look)


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


def _possible_paths(placing: PlacingRecord, name: str) -> dict[str, Columns]:
    """The paths that a walk may have taken, a layer each."""
    paths = [path for path in placing.candidates if path.weight >= _MIN_WEIGHT][: len(PATHS)]
    texts = (
        f"possible path {rank} of {len(paths)}, {100 * one.weight:.0f} % probable" for rank, one in enumerate(paths, 1)
    )
    return {
        layer: _points(path.points) | {"hover": [plotly_text(f"{name}: {text}")] * len(path.points)}
        for layer, path, text in zip(PATHS, paths, texts, strict=False)
    }


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
    """The walk to fill the gaps."""
    if walked is None or walked.walk is None:
        return []
    name = f"walk to fill the gaps, {walked.walk.length_m:.0f} m"
    return [scatter("lines", name, walked.walk.points_m, line={"color": "#8a2d77", "width": 2.5}, hoverinfo="name")]


def contradicting(found: Sequence[LandmarkContradiction]) -> list[Trace]:
    """Return one trace with an arrow and a text at its tip for each contradiction; none if nothing contradicts."""
    if not found:
        return []
    drawn = [
        (
            one.surveyed_m,
            one.offset_m,
            f"{one.called} contradicts the others<br>by {size_m(one):.2f} m "
            f"(in {one.sessions} of the {one.seen} sessions that logged it)",
            f"{one.landmark}: {size_m(one):.2f} m off",
        )
        for one in found
    ]
    sides = ["middle left" if one.offset_m[0] < 0 else "middle right" for one in found for _ in range(6)]
    font = {"size": 12, "color": RED, "shadow": HALO}
    return [arrows("contradictory landmark", RED, 2.5, drawn, textfont=font, textposition=sides)]


def size_m(found: LandmarkContradiction) -> float:
    """Length of the mean offset, metres."""
    return math.hypot(*found.offset_m)


def plan_data_uri(floor: Floor) -> str:
    """Return a floor's plan over its extent, scaled to at most :data:`MAX_PIXELS`, as a JPEG data URI.

    Raises OSError if it is unreadable, as :func:`vislam2tag.site.plans.load.plan_picture` does.
    """
    buffer = io.BytesIO()
    plan_picture(floor, MAX_PIXELS).save(buffer, "JPEG", quality=_JPEG_QUALITY, optimize=True)
    return data_uri(buffer.getvalue(), "image/jpeg")


def drawn_plan(floor: Floor) -> tuple[str | None, str]:
    """Return a floor's plan as a data URI, or None and a sentence that says why it cannot be drawn."""
    plan = floor.plan
    if plan is None:
        return None, "This floor has no plan; the map shows a grid instead."
    if floor.extent_m is None:
        return None, f"{plan.name} is not shown because no file gives the floor's size; the map shows a grid instead."
    try:
        return plan_data_uri(floor), ""
    except OSError as error:
        return None, f"{plan.name} {error}; the map shows a grid instead."


def floor_figure(
    floor: Floor, landmarks: Landmarks, plan: str | None, contradictions: Sequence[LandmarkContradiction] = ()
) -> str:
    """Return, as JSON, a floor's map in BCS metres: plan (a data URI), landmarks, control points, contradictions.

    Its session layers are still empty (:func:`.session_traces`).
    """
    return site_figure(floor, landmarks, plan, session_traces(), contradicting(contradictions))


def site_figure(
    floor: Floor, landmarks: Landmarks, plan: str | None, below: Sequence[Trace], above: Sequence[Trace]
) -> str:
    """Return, as JSON, a floor's plan and what was surveyed there, with traces below and above it.

    The axes span the plan and all surveyed points; the page widens them to show mapped frames.
    """
    surveyed = landmarks.position_bcs[surveyed_on(floor, landmarks)]
    shown = np.vstack((floor.corners_m, surveyed, floor.control_points.position_bcs))
    return map_figure(floor, plan, [*below, *site_layers(floor, landmarks), *above], shown)


def map_figure(floor: Floor, plan: str | None, traces: Sequence[Trace], shown: FloatArray, **layout: Any) -> str:
    """Return, as JSON, traces over a floor's plan, whose axes span what is ``shown`` (n, 2), metres.

    The plan covers width x height of the floor; without a plan there is a metric grid.
    """
    spans = [(shown.min(axis=0) - _MARGIN_M).tolist(), (shown.max(axis=0) + _MARGIN_M).tolist()] if len(shown) else []
    across, up = zip(*spans, strict=True) if spans else (None, None)
    x = axis("x / m", across, grid=plan is None, constrain="domain")
    y = axis("y / m", up, grid=plan is None, constrain="domain", scaleanchor="x")
    figure = chart(traces, x, y, **layout)
    if plan:
        figure.add_layout_image(
            source=plan,
            xref="x",
            yref="y",
            x=floor.lower_left_m[0],
            y=None if floor.height_m is None else floor.lower_left_m[1] + floor.height_m,
            sizex=floor.width_m,
            sizey=floor.height_m,
            sizing="stretch",
            layer="below",
            opacity=0.75,
        )
    return figure_json(figure)


def surveyed_on(floor: Floor, landmarks: Landmarks) -> BoolArray:
    """Return which of the landmarks (n,) are on this floor and have a surveyed position, (n,)."""
    placed = landmarks.surveyed & np.isfinite(landmarks.position_bcs).all(axis=1)
    return np.asarray(placed & (landmarks.floor == floor.number))


def site_layers(floor: Floor, landmarks: Landmarks, *, ids: bool = True) -> list[Trace]:
    """Return the floor's landmarks, surveyed or not, and its control points, each with its id beside it if wanted."""
    here = (landmarks.floor == floor.number) & np.isfinite(landmarks.position_bcs).all(axis=1)
    points = floor.control_points
    kinds: list[tuple[str, Iterable[str], FloatArray, str, str]] = [
        ("control point", points.ids, points.position_bcs, "cross-thin-open", "#6a3d9a")
    ]
    for name, wanted, symbol, colour in (
        ("landmark", surveyed_on(floor, landmarks), "square", "#1b1b1b"),
        ("landmark (not surveyed)", here & ~landmarks.surveyed, "square-open", RED),
    ):
        kinds.append((name, compress(landmarks.ids, wanted), landmarks.position_bcs[wanted], symbol, colour))
    return [
        scatter(
            "markers+text" if ids else "markers",
            name,
            np.round(place, 3),
            f"{name} %{{text}}<br>x %{{x:.2f}} m, y %{{y:.2f}} m",
            text=[plotly_text(one) for one in names],
            textposition="top right",
            textfont={"size": 11, "color": colour, "shadow": HALO},
            marker={"size": 8, "line": {"width": 2}, "symbol": symbol, "color": colour},
        )
        for name, names, place, symbol, colour in kinds
    ]
