"""Drawable layers of a page's maps and charts, as Plotly's traces: points, lines, arrows, cells and their hover texts.

A layer is a plain dictionary in the form that Plotly's constructors and its JSON take; :func:`chart` and
:func:`figure_json` turn layers into what a page holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

Trace = dict[str, Any]
Columns = dict[str, list[Any]]
"""A layer's ``x`` and ``y`` and, where it has them, ``hover`` texts and ``sigma`` in metres; equally long."""
BLUE, VERMILION, GREEN, ORANGE, GREY, RED = "#0072b2", "#d55e00", "#00664a", "#e69f00", "#8c959f", "#b00020"
"""Of Okabe and Ito where hue matters; on white each can be read."""
HALO = "0 0 2px white, 0 0 2px white, 0 0 3px white"
"""Behind text on a plan."""
_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
GRID = "#e4e7ea"
_BARB = 0.25
"""Length of an arrow's barbs as a share of its own."""
_BARB_TURN = np.exp(1j * np.pi * (1 - 1 / 7))


def plotly_text(text: str) -> str:
    """Escape text of the user's for Plotly, which reads a few HTML tags in names and hover texts."""
    return escape(text, quote=False)


def scatter(mode: str, name: str, xy: Any = None, hover: str | None = None, **look: Any) -> Trace:
    """Points, lines or texts (``mode``) at places (n, 2), or at ``x``, ``y`` of ``look``; ``hover``: template."""
    trace: Trace = {"type": "scatter", "mode": mode, "name": name}
    if xy is not None:
        trace["x"], trace["y"] = np.asarray(xy, dtype=np.float64).reshape(-1, 2).T.tolist()
    if hover is not None:
        trace["hovertemplate"] = f"{hover}<extra></extra>"
    return trace | look


def cells(name: str, x: NDArray[Any], y: NDArray[Any], z: Any, hover: str, **look: Any) -> Trace:
    """Coloured squares with centres ``x`` (columns) and ``y`` (rows); those without a value stay clear."""
    return {
        "type": "heatmap",
        "name": name,
        "x": x.tolist(),
        "y": y.tolist(),
        "z": z,
        "hoverongaps": False,
        "hovertemplate": f"{hover}<extra></extra>",
    } | look


Arrow = tuple[tuple[float, float], tuple[float, float], str, str]
"""Where it starts, how far it goes (metres), what hovering says, and a text at its tip, which may be empty."""


def arrows(name: str, colour: str, width: float, drawn: Iterable[Arrow], **look: Any) -> Trace:
    """Arrows, true to scale, as one line with breaks; ``look`` has ``textfont`` where there are texts at tips."""
    columns: Columns = {"x": [], "y": [], "text": [], "hovertext": []}
    for start, offset, hover, label in drawn:
        line = arrow_line(complex(*start), complex(*offset))
        columns["x"] += [*np.round(line.real, 3).tolist(), None]
        columns["y"] += [*np.round(line.imag, 3).tolist(), None]
        columns["text"] += ["", plotly_text(label), *[""] * (len(line) - 1)]
        columns["hovertext"] += [plotly_text(hover)] * (len(line) + 1)
    if "textfont" not in look:
        del columns["text"]
    mode = "lines+text" if "textfont" in look else "lines"
    return scatter(mode, name, None, "%{hovertext}", line={"color": colour, "width": width}, **columns, **look)


def arrow_line(start: complex, offset: complex) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the points (5,) of an arrow in one line: start, tip, one barb, tip, the other barb; x + iy, metres."""
    tip = start + offset
    one, other = tip + _BARB * offset * _BARB_TURN, tip + _BARB * offset / _BARB_TURN
    return np.array([start, tip, one, tip, other])


def axis(title: str, span: Sequence[float] | None = None, *, grid: bool = True, **more: Any) -> dict[str, Any]:
    """Return an axis with its title, its range (None: as the data ask) and perhaps a grid."""
    return {
        "title": {"text": title},
        "showgrid": grid,
        "gridcolor": GRID,
        "zeroline": False,
        "ticks": "outside",
        "tickcolor": GRID,
        "automargin": True,
        **({} if span is None else {"range": span}),
        **more,
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


def chart(traces: Sequence[Trace], x: dict[str, Any], y: dict[str, Any], **layout: Any) -> go.Figure:
    """Return a figure of layers with its two axes, in the style of all pages."""
    figure = go.Figure(data=list(traces), layout_template="none")
    figure.update_layout(
        {
            "font": {"family": _FONT, "size": 12, "color": "#24292f"},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "rgba(0,0,0,0)",
            "dragmode": "pan",
            "hoverlabel": {"align": "left"},
            "legend": {"itemclick": "toggle", "itemdoubleclick": "toggleothers"},
            "xaxis": x,
            "yaxis": y,
            **layout,
        }
    )
    return figure


def figure_json(figure: go.Figure) -> str:
    """Write a figure as JSON."""
    # The standard library's encoder, so that the bytes do not depend on what else is installed.
    text: str = figure.to_json(engine="json")
    return text
