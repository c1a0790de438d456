"""Drawable layers of maps and charts: points, lines, arrows, areas, bars, cells, with names, colours and hover texts.

A layer is a plain dictionary in the form of Plotly's traces. :func:`chart` and :func:`figure_json` draw layers on a
page; :func:`.print_layers.draw` draws the same layers in print.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid

Trace = dict[str, Any]
Columns = dict[str, list[Any]]
"""A layer's ``x`` and ``y`` and, optionally, ``hover`` texts and ``sigma`` in metres, all of equal length."""
BLUE, VERMILION, GREEN, ORANGE, GREY, RED = "#0072b2", "#d55e00", "#00664a", "#e69f00", "#8c959f", "#b00020"
"""Okabe and Ito's colours, adapted for contrast on white."""
PALETTE = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
"""Okabe and Ito's colours, which colour-blind readers can distinguish."""
MANY_COLOURS = (
    *("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd"),
    *("#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf"),
)
"""Colours for items that only have to differ from their neighbours."""
HALO = "0 0 2px white, 0 0 2px white, 0 0 3px white"
"""Behind text on a plan."""
_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
GRID = "#e4e7ea"
_BARB = 0.25
_BARB_TURN = np.exp(1j * np.pi * (1 - 1 / 7))


def plotly_text(text: str) -> str:
    """Escape user text for Plotly, which interprets a few HTML tags in names and hover texts."""
    return escape(text, quote=False)


def scatter(mode: str, name: str, xy: Any = None, hover: str | None = None, **look: Any) -> Trace:
    """Points, lines or texts (``mode``) at places (n, 2), or at ``x``, ``y`` of ``look``; ``hover``: template."""
    trace: Trace = {"type": "scatter", "mode": mode, "name": name}
    if xy is not None:
        trace["x"], trace["y"] = np.asarray(xy, dtype=np.float64).reshape(-1, 2).T.tolist()
    if hover is not None:
        trace["hovertemplate"] = f"{hover}<extra></extra>"
    return trace | look


def line(name: str, xy: Any, colour: str, width: float = 2.0, dash: str = "solid", **look: Any) -> Trace:
    """A line through places (n, 2), broken at NaN."""
    return scatter("lines", name, xy, line={"color": colour, "width": width, "dash": dash}, **look)


def dots(name: str, xy: Any, colour: Any, size: float = 6.0, symbol: str = "circle", **look: Any) -> Trace:
    """Points at places (n, 2), with texts beside them if ``look`` has ``text``."""
    mode = "markers+text" if "text" in look else "markers"
    edge = look.pop("edge", {"color": "white", "width": 0})
    return scatter(mode, name, xy, marker={"color": colour, "size": size, "symbol": symbol, "line": edge}, **look)


def written(xy: Any, text: Sequence[str], side: str = "middle center", colour: str = "#000000") -> Trace:
    """Texts beside places (n, 2)."""
    return scatter("text", "", xy, text=text, textposition=side, textfont={"color": colour, "size": 12})


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


def grid_cells(name: str, grid: CellGrid, z: Any, hover: str = "", **look: Any) -> Trace:
    """Coloured squares of a whole grid: ``z`` (rows, columns), row 0 at the lower edge."""
    left, low = grid.origin_m
    x, y = left + (np.arange(grid.columns) + 0.5) * grid.cell_m, low + (np.arange(grid.rows) + 0.5) * grid.cell_m
    return cells(name, x, y, z, hover, **{"dx": grid.cell_m, "dy": grid.cell_m} | look)


def one_colour(colour: str) -> dict[str, Any]:
    """The look of cells with one colour, which the legend explains."""
    return {"colorscale": [[0, colour], [1, colour]], "showscale": False, "showlegend": True}


def area(name: str, points: Any, colour: str, opacity: float, **look: Any) -> Trace:
    """A filled polygon with corners (n, 2)."""
    return scatter("none", name, points, fill="toself", fillcolor=colour, opacity=opacity, hoverinfo="skip", **look)


def bars(name: str, y: Sequence[str], x: Sequence[float | None], colour: Any, hover: str = "", **more: Any) -> Trace:
    """Bars from the left."""
    trace = {"type": "bar", "orientation": "h", "name": name, "y": y, "x": x, "marker": {"color": colour}, **more}
    return trace | ({"hovertemplate": f"{hover}<extra></extra>"} if hover else {})


def joined(parts: Iterable[FloatArray]) -> FloatArray:
    """Lines (k, 2) as one with breaks, for one layer."""
    if isinstance(parts, np.ndarray):
        return np.pad(parts, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan).reshape(-1, 2)[:-1]
    gap = np.full((1, 2), np.nan)
    broken = [row for part in parts for row in (part, gap)]
    return np.concatenate(broken[:-1]) if broken else np.empty((0, 2))


Arrow = tuple[tuple[float, float], tuple[float, float], str, str]
"""Start, vector (metres), hover text, and a text at the tip, which may be empty."""


def arrows(name: str, colour: str, width: float, drawn: Iterable[Arrow], barb: float = _BARB, **look: Any) -> Trace:
    """Arrows, true to scale, as one line with breaks; ``look`` has ``textfont`` if there are texts at tips.

    ``barb`` is the length of an arrow's barbs as a share of its own.
    """
    columns: Columns = {"x": [], "y": [], "text": [], "hovertext": []}
    for start, offset, hover, label in drawn:
        line = arrow_line(complex(*start), complex(*offset), barb)
        columns["x"] += [*np.round(line.real, 3).tolist(), None]
        columns["y"] += [*np.round(line.imag, 3).tolist(), None]
        columns["text"] += ["", plotly_text(label), *[""] * (len(line) - 1)]
        columns["hovertext"] += [plotly_text(hover)] * (len(line) + 1)
    if "textfont" not in look:
        del columns["text"]
    mode = "lines+text" if "textfont" in look else "lines"
    return scatter(mode, name, None, "%{hovertext}", line={"color": colour, "width": width}, **columns, **look)


def arrow_line(start: complex, offset: complex, barb: float = _BARB) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the points (5,) of an arrow in one line: start, tip, one barb, tip, the other barb; x + iy, metres."""
    tip = start + offset
    one, other = tip + barb * offset * _BARB_TURN, tip + barb * offset / _BARB_TURN
    return np.array([start, tip, one, tip, other])


def axis(title: str, span: Sequence[float] | None = None, *, grid: bool = True, **more: Any) -> dict[str, Any]:
    """Return an axis with its title, its range (None: from the data) and an optional grid."""
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
    """Return a colour bar above a map, so that it takes no width on a narrow screen."""
    return {
        "title": {"text": title, "side": "top"},
        "orientation": "h",
        "thickness": 10,
        "len": 0.6,
        "x": 0.5,
        "y": 1.0,
        "yanchor": "bottom",
    }


@dataclass(frozen=True)
class Chart:
    """Layers between two axes, to be drawn on a page or in print."""

    layers: Sequence[Trace]
    x: Trace
    y: Trace
    title: str = ""
    layout: Mapping[str, Any] = field(default_factory=dict)
    """Further options of Plotly's layout; print only uses ``barmode`` and ``bargap``."""

    def json(self) -> str:
        """The chart for a page."""
        return figure_json(chart(self.layers, self.x, self.y, **self.layout))


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
