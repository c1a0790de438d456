"""Layers and charts (:mod:`.layers`) in print: drawn by Matplotlib into one panel."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from html import unescape
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, PercentFormatter

from vislam2tag.views.layers import Chart, Trace

Scales: TypeAlias = dict[str, tuple[ScalarMappable, Mapping[str, Any]]]
"""A panel's colour bar: its title and look."""
MANY_DECADES = 1000.0
"""Logarithmic axes that span more than this ratio have fewer numbers."""
_POINTS, _LETTER_POINTS = 0.4, 0.5
"""Print points per pixel of a page, for lines and markers, and for letters."""
_RASTERIZED = 5000
"""Layers with more points are drawn as images."""
_DASHES = {
    "solid": "-",
    "dash": "--",
    "dot": ":",
    "dashdot": "-.",
    "longdash": (0, (8, 3)),
    "longdashdot": (0, (8, 2, 2, 2)),
}
_SYMBOLS = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "cross": "P",
    "x": "X",
    "triangle-up": "^",
    "triangle-down": "v",
}
_SYMBOLS |= {"star": "*", "cross-thin": "+", "x-thin": "x"} | {str(number): one for number, one in enumerate("osDPX")}
_ACROSS = {"left": (-3, "right"), "center": (0, "center"), "right": (3, "left")}
_UP = {"bottom": (-3, "top"), "middle": (0, "center"), "top": (3, "bottom")}
"""Offset in points and alignment of a text for each side of its point."""


def draw(axes: Axes, layers: Iterable[Trace], bargap: float = 0.2, *, stacked: bool = False) -> Scales:
    """Draw layers one over the other, the last on top; return their colour bars."""
    scales: Scales = {}
    ends: dict[Any, float] = defaultdict(float)
    for layer in layers:
        mappable = None
        if layer["type"] == "bar":
            _draw_bars(axes, layer, bargap, ends if stacked else defaultdict(float))
        elif layer["type"] == "box":
            _draw_boxes(axes, layer)
        else:
            mappable = (_draw_cells if layer["type"] == "heatmap" else _draw_scatter)(axes, layer)
        bar = layer.get("colorbar") or layer.get("marker", {}).get("colorbar")
        if mappable is not None and bar is not None:
            scales[bar["title"]["text"]] = mappable, bar
    return scales


def _look(axes: Axes, layer: Trace) -> dict[str, Any]:
    """Opacity, name in the legend, and z-order above everything drawn so far."""
    named = layer.get("showlegend", True) and layer["name"]
    label = _plain(layer["name"]) if named else "_nolegend_"
    return {"alpha": layer.get("opacity"), "label": label, "zorder": 3 + 0.01 * len(axes.get_children())}


def _plain(text: str) -> str:
    """A text for Plotly, converted for print."""
    return unescape(re.sub("<br>", "\n", re.sub("</?b>", "", text)))


def _values(values: Any) -> Any:
    """Numbers with NaN for missing values; names and dates unchanged."""
    kept = isinstance(values, np.ndarray) or (len(values) > 0 and isinstance(values[0], str))
    return values if kept else np.array(values, dtype=np.float64)


def _draw_scatter(axes: Axes, layer: Trace) -> ScalarMappable | None:
    x, y, look, mode = _values(layer["x"]), _values(layer["y"]), _look(axes, layer), layer["mode"]
    found = None
    if not len(x):
        return None
    if layer.get("fill"):
        axes.fill(x, y, color=layer["fillcolor"], linewidth=0, **look)
    elif "markers" in mode and not isinstance(layer["marker"].get("color", ""), str):
        found = _draw_coloured(axes, x, y, layer["marker"], look)
    elif mode != "text":
        axes.plot(x, y, **_line(layer), **_marker(layer), **look, rasterized=len(x) > _RASTERIZED)
    if "text" in mode:
        _write(axes, layer, x, y, look["zorder"])
    return found


def _line(layer: Trace) -> dict[str, Any]:
    line = layer.get("line", {})
    if "lines" not in layer["mode"]:
        return {"linestyle": "none"}
    steps = "steps-post" if line.get("shape") == "hv" else "default"
    dash, width = _DASHES[line.get("dash", "solid")], _POINTS * line.get("width", 2)
    return {"color": line["color"], "linestyle": dash, "linewidth": width, "drawstyle": steps}


def _marker(layer: Trace) -> dict[str, Any]:
    if "markers" not in layer["mode"]:
        return {}
    marker = layer["marker"]
    colour = marker.get("color") or layer["line"]["color"]
    symbol = str(marker.get("symbol", "circle"))
    hollow, edge = symbol.endswith("-open"), marker.get("line", {})
    return {
        "marker": _SYMBOLS.get(symbol.removesuffix("-open"), "o"),
        "markersize": _POINTS * marker.get("size", 6),
        "markerfacecolor": "none" if hollow else colour,
        "markeredgecolor": colour if hollow else edge.get("color", colour),
        "markeredgewidth": _POINTS * edge.get("width", 0),
    }


def _draw_coloured(axes: Axes, x: Any, y: Any, marker: Mapping[str, Any], look: Mapping[str, Any]) -> ScalarMappable:
    """Points each with a colour of its own, given by name or as a number on a scale."""
    scale: dict[str, Any] = {"cmap": _colours(marker["colorscale"])} if "colorscale" in marker else {}
    limits = {"vmin": marker["cmin"], "vmax": marker["cmax"]} if "cmin" in marker else {}
    symbol = _SYMBOLS[marker.get("symbol", "circle")]
    size = (_POINTS * marker["size"]) ** 2
    points = axes.scatter(x, y, size, marker["color"], marker=symbol, linewidths=0, **scale, **limits, **look)
    points.set_rasterized(len(x) > _RASTERIZED)
    return points


def _colours(scale: Any) -> Colormap:
    return mpl.colormaps[scale] if isinstance(scale, str) else LinearSegmentedColormap.from_list("", scale)


def _write(axes: Axes, layer: Trace, x: Any, y: Any, above: float) -> None:
    """Write the texts beside their points."""
    sides, font = layer.get("textposition", "middle center"), layer.get("textfont", {})
    size = _LETTER_POINTS * font.get("size", 12)
    for number, text in enumerate(layer["text"]):
        if text:
            up, across = (sides if isinstance(sides, str) else sides[number]).split()
            (dx, ha), (dy, va) = _ACROSS[across], _UP[up]
            written = axes.annotate(_plain(text), (x[number], y[number]), (dx, dy), textcoords="offset points")
            written.set(ha=ha, va=va, color=font.get("color", "black"), fontsize=size, zorder=above)
            if "shadow" in font:
                written.set_path_effects([withStroke(linewidth=1.5, foreground="white")])


def _draw_bars(axes: Axes, layer: Trace, gap: float, ends: dict[Any, float]) -> None:
    across = layer.get("orientation") == "h"
    places, sizes = (layer["y"], layer["x"]) if across else (layer["x"], layer["y"])
    named = not len(places) or isinstance(places[0], str)
    if named:
        places = [_plain(place) for place in places]
    starts = [ends[place] for place in places]
    thick = (1 - gap) * (1.0 if named or len(places) < 2 else places[1] - places[0])
    look = {"color": layer["marker"]["color"], "linewidth": 0, **_look(axes, layer)}
    if across:
        axes.barh(places, sizes, thick, starts, **look)
    else:
        axes.bar(places, sizes, thick, starts, **look)
    for place, size in zip(places, sizes, strict=True):
        ends[place] += size


def _draw_boxes(axes: Axes, layer: Trace) -> None:
    """Horizontal quartiles, whiskers and means."""
    names = {"lowerfence": "whislo", "q1": "q1", "median": "med", "q3": "q3", "upperfence": "whishi", "mean": "mean"}
    boxes = [dict(zip(names.values(), row, strict=True)) for row in zip(*(layer[name] for name in names), strict=True)]
    line = {"color": layer["line"]["color"], "linewidth": _POINTS * layer["line"]["width"]}
    axes.bxp(
        boxes,
        positions=range(len(boxes)),
        orientation="horizontal",
        widths=0.6 * min(1, len(boxes) / 3),
        showfliers=False,
        showmeans=True,
        patch_artist=True,
        boxprops={"facecolor": "#cfe3f1", "edgecolor": line["color"], "linewidth": line["linewidth"]},
        medianprops=line | {"linewidth": 2 * line["linewidth"]},
        whiskerprops=line,
        capprops=line,
        meanprops={"marker": "d", "markersize": 2.5, "markerfacecolor": "black", "markeredgewidth": 0},
    )
    axes.set_yticks(range(len(boxes)), list(map(_plain, layer["y"])))


def _draw_cells(axes: Axes, layer: Trace) -> ScalarMappable | None:
    look, (x, y) = _look(axes, layer), (layer["x"], layer["y"])
    scale = layer["colorscale"]
    values = np.ma.masked_invalid(np.array(layer["z"], dtype=np.float64))
    if layer.get("showlegend") and values.count():
        axes.fill([], [], color=scale[-1][1], **look)
    if not values.size:
        return None
    dx, dy = layer.get("dx", 1.0), layer.get("dy", 1.0)
    extent = (x[0] - dx / 2, x[-1] + dx / 2, y[0] - dy / 2, y[-1] + dy / 2)
    shown = {"vmin": layer.get("zmin"), "vmax": layer.get("zmax"), "alpha": look["alpha"], "zorder": look["zorder"]}
    return axes.imshow(values, _colours(scale), extent=extent, origin="lower", interpolation="nearest", **shown)


def draw_chart(axes: Axes, chart: Chart) -> Scales:
    """Draw a chart's layers and its two axes; return their colour bars."""
    layers = chart.layers
    if chart.x.get("type") == "date":
        layers = [{**layer, "x": np.array(layer["x"], dtype="datetime64[ms]")} for layer in layers]
    stacked = chart.layout.get("barmode") == "stack"
    scales = draw(axes, layers, chart.layout.get("bargap", 0.2), stacked=stacked)
    for name, axis, look in (("x", axes.xaxis, chart.x), ("y", axes.yaxis, chart.y)):
        _draw_axis(axes, name, axis, look)
    return scales


def _draw_axis(axes: Axes, name: str, axis: Axis, look: Mapping[str, Any]) -> None:
    """Title, limits, numbers and grid of one axis."""
    kind, span = look.get("type"), look.get("range")
    axis.set_label_text(look.get("title", {}).get("text", ""))
    if kind == "log":
        axes.set(**{f"{name}scale": "log"})
    if span is not None:
        axes.set(**{f"{name}lim": [10.0**end for end in span] if kind == "log" else span})
    elif look.get("rangemode") == "tozero":
        axes.set(**{f"{name}lim": (0, None)})
    if look.get("autorange") == "reversed":
        axis.set_inverted(True)
    _number_axis(axis, kind, look)
    if look.get("showgrid"):
        axis.grid(linewidth=0.3, alpha=0.6)
        axes.set_axisbelow(True)


def _number_axis(axis: Axis, kind: str | None, look: Mapping[str, Any]) -> None:
    if kind == "log":
        log_metres(axis)
    elif kind == "date":
        locator = AutoDateLocator(maxticks=8)  # type: ignore[no-untyped-call]
        axis.set_major_locator(locator)
        axis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    elif kind == "category":
        axis.set_tick_params(length=0)
    elif "tickvals" in look:
        axis.set_ticks(look["tickvals"], labels=look["ticktext"])
        axis.set_tick_params(rotation=-look.get("tickangle", 0))
    elif look.get("tickformat") == ".0%":
        axis.set_major_formatter(PercentFormatter(1, 0, " %"))


def log_metres(axis: Axis) -> None:
    """Label a logarithmic axis in metres with plain numbers: 0.1, 0.2, 0.5, 1, ..."""
    low, high = axis.get_view_interval()
    steps = (1.0, 2.0, 5.0) if high / low < MANY_DECADES else (1.0, 3.0)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
