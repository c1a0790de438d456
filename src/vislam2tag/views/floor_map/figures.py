"""The Plotly figures of the page: one map a floor, and the time by status of every session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
import plotly.graph_objects as go

from vislam2tag.common.palette import STATUS_STYLES
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import LandmarkContradiction
from vislam2tag.survey.model import Floor
from vislam2tag.views.floor_map.arrows import arrows
from vislam2tag.views.floor_map.layers import Trace, plotly_text, session_traces

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
