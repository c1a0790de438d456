"""Comparison of positioning models: errors, their places, confused floors, and calibration of radii."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.places import NINETY_FIVE, SIXTY_EIGHT
from vislam2tag.site.model import Floor
from vislam2tag.views.layers import (
    GREY,
    MANY_COLOURS,
    Chart,
    Trace,
    area,
    axis,
    cells,
    dots,
    joined,
    line,
    scatter,
    written,
)
from vislam2tag.views.panels import COLUMN_IN, PlanPanel, extent_around, extent_over, printed

ERROR_SCALE_M = (0.5, 20.0)
"""Ends of the colours of errors on the plan."""
GOOD = {SIXTY_EIGHT: (0.60, 0.76), NINETY_FIVE: (0.90, 0.985)}
"""Shares of true positions within the radii that count as calibrated."""
BINS = 10
"""Number of groups of scans by predicted radius."""
_LEAST_SHOWN_M = 0.1
_DASHES = ("solid", "dash", "dashdot", "dot")
_MANY_FLOORS = 8
"""Maximum number of floors with numbers in the cells of a confusion matrix."""


@dataclass(frozen=True)
class ErrorFloor:
    """A floor to draw: its plan and its scans' predictions with errors."""

    title: str
    floor: Floor
    predictions: pl.DataFrame


def _line(number: int) -> dict[str, object]:
    """Look of the model with this number."""
    dash = _DASHES[number // len(MANY_COLOURS) % len(_DASHES)]
    return {"color": MANY_COLOURS[number % len(MANY_COLOURS)], "dash": dash, "width": 2.5}


def error_distributions_by_model(errors_m: Mapping[str, FloatArray]) -> Figure:
    """Draw the share of all scans (n,) with an error up to a limit, by model.

    NaN is a scan without answer, so the curves end at the shares answered.
    """
    layers = []
    greatest = 1.0
    for number, (model, error_m) in enumerate(errors_m.items()):
        known = np.sort(error_m[np.isfinite(error_m)])
        share = np.arange(len(known) + 1) / max(len(error_m), 1)
        steps = np.column_stack((np.maximum([0.0, *known], _LEAST_SHOWN_M), share))
        layers.append(scatter("lines", model, steps, line={**_line(number), "shape": "hv"}))
        greatest = max([greatest, *known[-1:]])
    span = np.log10([max(_LEAST_SHOWN_M, greatest / 1000), greatest]).tolist()
    y = axis("share of all scans", [0.0, 1.02], tickformat=".0%")
    chart = Chart(layers, axis("horizontal error / m", span, type="log"), y)
    return printed([chart], width_in=COLUMN_IN, aspect=0.7)


def error_map(floors: Sequence[ErrorFloor]) -> Figure:
    """Draw each scan at its true position, coloured by error, with a line to the prediction; crosses: wrong floor."""
    places = pl.concat([floor.predictions for floor in floors]).select("x", "y").to_numpy()
    extent = extent_over(*extent_around(places), *(floor.floor.corners_m for floor in floors))
    return printed(
        [PlanPanel(floor.title, floor.floor, _error_layers(floor.predictions), extent) for floor in floors],
        extra_in=0.6,
    )


def _error_layers(predictions: pl.DataFrame) -> list[Trace]:
    known = predictions.filter(pl.col("error_m").is_not_null()).sort("error_m")
    right, wrong = known.filter("on_floor"), known.filter(~pl.col("on_floor"))
    pairs = right.select("x", "y", "found_x", "found_y").to_numpy().reshape(-1, 2, 2)
    unanswered = predictions.filter(pl.col("error_m").is_null()).select("x", "y").to_numpy()
    return [
        line("to the predicted position", joined(pairs), GREY, 0.6, opacity=0.6),
        _scans("scan", right, "circle", 5),
        _scans("scan located on a wrong floor", wrong, "x", 7),
        dots("no answer", unanswered, "#cc79a7", 8, "cross-thin-open", edge={"width": 2}),
    ]


def _scans(name: str, rows: pl.DataFrame, symbol: str, size: float) -> Trace:
    ticks = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
    logarithms = np.log10(np.clip(rows["error_m"].to_numpy(), *ERROR_SCALE_M)).tolist()
    low, high = np.log10(ERROR_SCALE_M).tolist()
    bar = {"title": {"text": "error in the plane / m"}, "tickvals": np.log10(ticks).tolist()}
    bar["ticktext"] = [f"{tick:g}" for tick in ticks]
    scale = {"color": logarithms, "colorscale": "viridis_r", "cmin": low, "cmax": high, "colorbar": bar}
    return scatter("markers", name, rows.select("x", "y").to_numpy(), marker={"symbol": symbol, "size": size, **scale})


def floor_confusion(storeys: Sequence[str], counts: Mapping[str, FloatArray]) -> Figure:
    """Draw by model which storeys (s) are taken for which: shares of the scans of each true storey (s, s), in rows."""
    numbers = np.arange(len(storeys))
    turn = -90 if max(map(len, storeys)) > 2 else 0
    x = axis("found", grid=False, tickvals=numbers, ticktext=storeys, tickangle=turn)
    y = axis("true", grid=False, tickvals=numbers, ticktext=storeys, autorange="reversed")
    panels = []
    for model, matrix in counts.items():
        share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        bar = {"title": {"text": "share of the true floor's scans"}}
        look = {"colorscale": "Blues", "zmin": 0, "zmax": 1, "colorbar": bar}
        panels.append(Chart([cells("", numbers, numbers, share, "", **look), *_shares(share, matrix)], x, y, model))
    return printed(panels, min(3, len(counts)), aspect=0.9, extra_in=0.3)


def _shares(share: FloatArray, matrix: FloatArray) -> list[Trace]:
    """Percentages in the cells with scans."""
    layers = []
    for dark, colour in ((True, "#ffffff"), (False, "#000000")):
        here = (
            np.argwhere((matrix > 0) & ((share > 0.5) == dark)) if len(share) <= _MANY_FLOORS else np.empty((0, 2), int)
        )
        text = [f"{100 * share[row, column]:.1f}" for row, column in here]
        layers.append(written(here[:, ::-1], text, colour=colour))
    return layers


def calibration(predictions: Mapping[str, pl.DataFrame]) -> Figure:
    """Draw by model how many true positions are within the predicted radii, and whether errors grow with the radius.

    Left: the shares within both radii, and the ranges that count as calibrated. Right: scans in groups of
    similar radius: the 68 % quantile of the errors against the mean predicted 68 % radius.
    """
    rows = (-0.5, len(predictions) - 0.5)
    shares = [
        area("", [(low, rows[0]), (high, rows[0]), (high, rows[1]), (low, rows[1])], GREY, 0.2)
        for low, high in GOOD.values()
    ]
    shares += [line("", [(share, rows[0]), (share, rows[1])], GREY, 1.5) for share in GOOD]
    curves, ends = [], [1.0]
    for number, (model, table) in enumerate(predictions.items()):
        stated = table.drop_nulls(["error_m", "radius_68_m", "radius_95_m"])
        if stated.is_empty():
            continue
        look = _line(number)
        for column, symbol in (("radius_68_m", "circle"), ("radius_95_m", "square")):
            share = float((stated["error_m"] <= stated[column]).mean())  # type: ignore[arg-type]
            shares.append(dots("", [(share, number)], look["color"], 9, symbol))
        groups = _by_radius(stated)
        curves.append(scatter("lines+markers", model, groups, line=look, marker={"size": 5}))
        ends += [float(groups.min()), float(groups.max())]
    least, greatest = max(min(ends), _LEAST_SHOWN_M) / 1.2, 1.2 * max(ends)
    equal = line("", [(least, least), (greatest, greatest)], GREY, 1.5)
    span = np.log10([least, greatest]).tolist()
    y = axis("", rows, grid=False, tickvals=list(range(len(predictions))), ticktext=list(predictions))
    least_share = min([0.4, *(layer["x"][0] - 0.03 for layer in shares[2 * len(GOOD) :])])
    x = axis("share of true positions within the predicted radius", (least_share, 1.01), grid=False)
    radius = axis("predicted 68 % radius / m", span, grid=False, type="log")
    error = axis("68 % quantile of the errors / m", span, grid=False, type="log")
    return printed(
        [
            Chart(shares, x, y | {"autorange": "reversed"}, "68 % (dots) and 95 % (squares)"),
            Chart([equal, *curves], radius, error, "by predicted radius"),
        ],
        aspect=0.7,
    )


def _by_radius(stated: pl.DataFrame) -> FloatArray:
    """Mean radius and 68 % quantile of the errors of scans in groups (at most BINS) of rising radius, (k, 2)."""
    ordered = stated.sort("radius_68_m")
    groups = [part for part in np.array_split(np.arange(ordered.height), BINS) if len(part)]
    radius_m, error_m = ordered["radius_68_m"].to_numpy(), ordered["error_m"].to_numpy()
    return np.array(
        [
            (radius_m[part].mean(), max(float(np.quantile(error_m[part], SIXTY_EIGHT)), _LEAST_SHOWN_M))
            for part in groups
        ]
    )
