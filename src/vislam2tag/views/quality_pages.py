"""The pages of ``check`` (without ground truth) and ``evaluate`` (with ground truth).

The check page shows left-out errors and the gain of one more landmark on each floor's plan. The evaluation page shows
tables, and errors as curves, against landmark movement and against distance.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import compress, cycle, groupby
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.core.cell_grid import around_most
from vislam2tag.quality.evaluation.dense import SINCE_LANDMARK
from vislam2tag.quality.evaluation.metrics import (
    ALL,
    ALL_WALKS,
    HEADS,
    OVER_POINTS,
    OVER_WALKS,
    ErrorCurve,
    error_curve,
    figure_text,
    truth_name,
)
from vislam2tag.quality.evaluation.record import ErrorRow, SessionEvaluation, StrategyErrors, SurveyEvaluation
from vislam2tag.quality.evaluation.truth import TruthKind
from vislam2tag.quality.landmark_gain import CELL_M, Cell, GainMap
from vislam2tag.quality.self_check_record import BadLandmark, Fault, FloorCheck, LeftOutMark, SessionCheck, SurveyCheck
from vislam2tag.site.model import Survey
from vislam2tag.site.walkable.walked import WalkedSpace
from vislam2tag.views.floor_map import drawn_plan, site_figure, walk_to_fill
from vislam2tag.views.layers import (
    BLUE,
    GREEN,
    ORANGE,
    RED,
    Trace,
    area,
    arrows,
    axis,
    cells,
    chart,
    colour_bar,
    figure_json,
    one_colour,
    plotly_text,
    scatter,
)
from vislam2tag.views.page import survey_title, write_page

FAULTS = {
    Fault.OFFSET: "all walks observe it at the same other position: measure it again",
    Fault.DOUBT: "the only walk that observes it contradicts the survey: measure it again (or the tracker slipped)",
    Fault.SCATTER: "the walks disagree on its position: check whether it was moved or two sheets have this id",
}
"""Possible cause and remedy of each fault."""
_SHADED_STEPS = 2
"""Places of the walkable space per side of a shaded square."""


def write_check_page(
    out_file: Path, survey: Survey, check: SurveyCheck, gains: GainMap, spaces: Mapping[int, WalkedSpace | None]
) -> None:
    """Write the page ``out_file`` about a check of a survey; equal input gives equal bytes.

    ``spaces`` are the walked spaces of the floors, for their maps.
    It is written beside ``out_file`` and renamed when complete. Raises OutputError if it cannot be written.
    """
    context = {
        "title": survey_title(survey.root),
        "check": check,
        "expected_m": _expected_m(check),
        "median_m": median_left_out_m,
        "rooms": sum(len(floor.rooms) for floor in check.walked),
        "never_entered": sum(len(floor.never_entered) for floor in check.walked),
        "faults": FAULTS,
        "doubtful": [(session, fix) for session in check.sessions for fix in session.doubtful_fixes],
        "floors": (
            _checked_floor(survey, check, floor, gains.mean_gain_m(floor.number), spaces.get(floor.number))
            for floor in check.floors
        ),
    }
    write_page(out_file, "check.html.j2", context)


def _expected_m(check: SurveyCheck) -> float | None:
    """Expected mean error over all frames of all floors, metres; None without any."""
    frames = sum(floor.frames for floor in check.floors)
    return sum(floor.frames * floor.expected_m for floor in check.floors) / frames if frames else None


def median_left_out_m(session: SessionCheck) -> float | None:
    """Median length of a session's left-out errors, metres; None if nothing could be left out."""
    sizes = [float(np.hypot(*mark.offset_m)) for mark in session.left_out]
    return float(np.median(sizes)) if sizes else None


def _checked_floor(
    survey: Survey, check: SurveyCheck, floor: FloorCheck, gains: dict[Cell, float], space: WalkedSpace | None
) -> dict[str, Any]:
    """A floor's map and findings; ``note`` says why there is no plan, ``walked`` is None if not asked for."""
    site = survey.site.floor(floor.number)
    plan, note = drawn_plan(site)
    bad = [found for found in check.bad_landmarks if found.floor == floor.number]
    walked = next((one for one in check.walked if one.number == floor.number), None)
    unwalked = [] if space is None else [_unwalked(space)]
    above = [
        *_room_names(space),
        *walk_to_fill(walked),
        _left_out(check.sessions, floor.number),
        _bad(bad),
        _best(floor),
    ]
    figure = site_figure(site, survey.site.landmarks, plan, [_gain_map(gains), *unwalked], above)
    return {"floor": site, "check": floor, "figure": figure, "note": note, "walked": walked}


def _unwalked(space: WalkedSpace) -> Trace:
    """Shade the walkable space that no walk covered."""
    step_m = _SHADED_STEPS * space.distances.step_m
    missing = space.places_m[~space.walked]
    shaded = np.unique(np.floor(missing / step_m).astype(np.int64), axis=0).reshape(-1, 2)
    name = "walkable, but not walked"
    values = dict.fromkeys(((column, row) for column, row in shaded.tolist()), 1)
    look = one_colour(ORANGE) | {"opacity": 0.45, "showlegend": len(shaded) > 0}
    return _squares(name, values, step_m, name, **look)


def _squares(name: str, values: Mapping[Cell, float], side_m: float, hover: str, **look: Any) -> Trace:
    """Squares of a grid from the origin by column and row, each with its value; others are transparent."""
    columns, rows = np.array(list(values), dtype=np.int64).reshape(-1, 2).T
    x = np.arange(columns.min(), columns.max() + 1) if values else np.empty(0, dtype=np.int64)
    y = np.arange(rows.min(), rows.max() + 1) if values else np.empty(0, dtype=np.int64)
    squares: list[list[float | None]] = [[None] * len(x) for _ in y]
    for (column, row), value in values.items():
        squares[row - y[0]][column - x[0]] = value
    return cells(name, ((x + 0.5) * side_m).round(3), ((y + 0.5) * side_m).round(3), squares, hover, **look)


def _room_names(space: WalkedSpace | None) -> list[Trace]:
    """The names of named areas, at the point with most space around it."""
    named = [] if space is None else [area for area, name in enumerate(space.areas.names) if name]
    if space is None or not named:
        return []
    text = [plotly_text(space.areas.names[area]) for area in named]
    look: dict[str, Any] = {"text": text, "textfont": {"size": 11}, "showlegend": False, "hoverinfo": "skip"}
    return [scatter("text", "rooms", space.areas.middle_m[named].round(2), **look)]


def _gain_map(gains: dict[Cell, float]) -> Trace:
    """Colour each possible square for a landmark by the gain there, centimetres."""
    near = around_most(np.array(list(gains), dtype=np.int64).reshape(-1, 2))
    return _squares(
        "gain of one more landmark",
        {cell: round(100 * gain, 3) for cell, gain in compress(gains.items(), near)},
        CELL_M,
        "one more landmark here: mean error decreases by %{z:.1f} cm",
        zmin=0,
        colorscale="YlGnBu",
        opacity=0.75,
        showlegend=True,
        colorbar=colour_bar("gain / cm"),
    )


def _left_out(sessions: Iterable[SessionCheck], number: int) -> Trace:
    """One arrow for each left-out landmark of each session, from the surveyed to the predicted position."""
    drawn = (
        (mark.surveyed_m, mark.offset_m, _sentence(session, mark), "")
        for session in sessions
        for mark in session.left_out
        if mark.floor == number
    )
    return arrows("left-out error", BLUE, 1.2, drawn)


def _bad(found: Sequence[BadLandmark]) -> Trace:
    drawn = (
        (
            bad.surveyed_m,
            bad.offset_m,
            f"landmark {bad.landmark}: {bad.size_m:.2f} m ({bad.sessions} sessions); {FAULTS[bad.fault]}",
            "",
        )
        for bad in found
    )
    return arrows("bad landmark", RED, 3.0, drawn)


def _sentence(session: SessionCheck, mark: LeftOutMark) -> str:
    size_m, what = float(np.hypot(*mark.offset_m)), "fix" if session.fixes else "landmark"
    return f"{session.device} / {session.session}: {what} {mark.landmark} predicted with an error of {size_m:.2f} m"


def _best(floor: FloorCheck) -> Trace:
    return scatter(
        "markers+text",
        "one more landmark",
        [(place.x_m, place.y_m) for place in floor.places],
        "one more landmark at x %{x:.1f} m, y %{y:.1f} m: %{hovertext}",
        text=[str(rank + 1) for rank in range(len(floor.places))],
        textposition="middle center",
        textfont={"size": 12, "color": "white"},
        marker={"symbol": "circle", "size": 20, "color": GREEN, "line": {"width": 2, "color": "white"}},
        hovertext=[f"mean error decreases by {100 * place.gain_m:.1f} cm" for place in floor.places],
    )


MEANINGS = {
    TruthKind.DENSE: "The true position at every frame, from a truth file (a simulation or another tracking system).",
    TruthKind.TOTAL_STATION: "A total station tracked a prism on the walker at its own rate, wherever it was visible.",
    TruthKind.CONTROL_POINTS: "The walker pressed a button at a few surveyed points of each walk. "
    "The errors include the distance of the hand from the point.",
}
"""Origin of each kind of ground truth."""
_BEST_FIRST = tuple(MEANINGS)
_COMPLETE = 0.9
"""The best strategy must label at least this share of the points that the most complete one labels."""


def write_evaluation_page(out_file: Path, title: str, evaluation: SurveyEvaluation) -> None:
    """Write the page ``out_file`` about an evaluation; equal input gives equal bytes.

    It is written beside ``out_file`` and renamed when complete. Raises OutputError if it cannot be written.
    """
    ranked = ranking(evaluation.rows)
    context = {
        "title": title,
        "evaluation": evaluation,
        "truths": list(_truths(evaluation)),
        "heads": HEADS,
        "figure_text": figure_text,
        "best": ranked[0] if ranked else None,
        "second": ranked[1] if len(ranked) > 1 else None,
        "lines": lambda session: list(_lines(session, evaluation.strategies)),
        "drift_figure": drift_figure(evaluation),
    }
    write_page(out_file, "evaluation.html.j2", context)


def ranking(rows: Sequence[ErrorRow]) -> list[ErrorRow]:
    """Strategies over all walks, the best first, against the most reliable truth; see :data:`_COMPLETE`."""
    whole = [row for row in rows if (row.group, row.selection, row.over) == (ALL, ALL_WALKS, OVER_WALKS)]
    if not whole:
        return []
    telling = min((row.truth for row in whole), key=_BEST_FIRST.index)
    first = next(row for row in whole if row.truth == telling)
    here = [row for row in whole if (row.truth, row.method) == (first.truth, first.method)]
    errors = {row.strategy: row.mean_m.value for row in here if row.mean_m.value is not None}
    shares = {row.strategy: row.labelled.value or 0.0 for row in here}
    least = _COMPLETE * max(shares.values())
    known = [row for row in here if row.strategy in errors]
    return sorted(known, key=lambda row: (shares[row.strategy] < least, errors[row.strategy]))


def _name(truth: TruthKind, method: str) -> str:
    return "the whole true path" if truth is TruthKind.DENSE else truth_name(truth, method)


def _truths(evaluation: SurveyEvaluation) -> Iterator[dict[str, Any]]:
    """Each truth by one method: rows over all walks, over their points and of each floor and device, and figures."""
    for (truth, method), group in groupby(evaluation.rows, key=lambda row: (row.truth, row.method)):
        rows = list(group)
        measured = [one for session in evaluation.sessions for one in session.measured]
        yield {
            "name": _name(truth, method),
            "meaning": MEANINGS[truth],
            "sigma_m": truth_sigma_m(measured, truth, method),
            "walks": [row for row in rows if row.group == ALL and row.over == OVER_WALKS],
            "points": [row for row in rows if row.group == ALL and row.over == OVER_POINTS],
            "groups": [row for row in rows if row.group != ALL and row.over == OVER_WALKS],
            "curves": cdf_figure(evaluation, truth, method),
            "movement": movement_figure(evaluation, truth, method),
        }


def truth_sigma_m(measured: Sequence[StrategyErrors], truth: TruthKind, method: str) -> float | None:
    """Root mean square of a truth's own sigma over the walks compared with it; None if unknown."""
    here = [one.truth_sigma_m for one in measured if (one.truth, one.method) == (truth, method)]
    known = [value for value in here if value is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known else None


def _lines(session: SessionEvaluation, strategies: Sequence[str]) -> Iterator[tuple[str, list[StrategyErrors | None]]]:
    """Yield a session's truths by name, each with the errors of every strategy."""
    for truth, method in dict.fromkeys((one.truth, one.method) for one in session.measured):
        here = {one.strategy: one for one in session.measured if (one.truth, one.method) == (truth, method)}
        yield _name(truth, method), [here.get(strategy) for strategy in strategies]


COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#4d4d4d")
"""Okabe and Ito's, one for each strategy in turn."""
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def cdf_figure(evaluation: SurveyEvaluation, truth: TruthKind, method: str) -> str:
    """Return, as JSON, each strategy's share of points with an error up to a length, with bands."""
    traces: list[Trace] = []
    for strategy, colour, dash in _looks(evaluation):
        walks = [one for _, one in _measured(evaluation, truth, method, strategy)]
        curve = error_curve(walks) if walks else None
        if curve is not None:
            traces += curve_layers(curve, plotly_text(strategy), colour, dash)
    return _chart(traces, axis("error / m", type="log"), axis("share of all points", [0.0, 1.0], tickformat=".0%"))


def curve_layers(curve: ErrorCurve, name: str, colour: str, dash: str = "solid") -> Iterator[Trace]:
    """The share of points with an error up to a length, with its bounds."""
    if curve.low is not None and curve.high is not None:
        band = np.column_stack((np.r_[curve.error_m, curve.error_m[::-1]], np.r_[curve.high, curve.low[::-1]]))
        yield area("", band.round(5), colour, 0.15, showlegend=False, legendgroup=name)
    yield scatter(
        "lines",
        name,
        np.column_stack((curve.error_m, curve.share)).round(5),
        hovertemplate="%{y:.1%} within %{x:.2f} m",
        legendgroup=name,
        line={"color": colour, "width": 2.2, "dash": dash},
    )


def movement_figure(evaluation: SurveyEvaluation, truth: TruthKind, method: str) -> str | None:
    """Return, as JSON, each walk's mean error against the movement of its landmarks; None without such walks."""
    traces = []
    for number, (strategy, colour, _) in enumerate(_looks(evaluation)):
        pairs = [
            (session, one.mean_m)
            for session, one in _measured(evaluation, truth, method, strategy)
            if one.mean_m is not None and session.movement_m is not None
        ]
        if pairs:
            texts = [plotly_text(f"floor {s.floor} / {s.device} / {s.session}") for s, _ in pairs]
            points = [(session.movement_m, mean) for session, mean in pairs]
            traces.append(movement_layer(points, plotly_text(strategy), colour, number, texts))
    x = axis("mean displacement of landmarks / m", rangemode="tozero")
    return _chart(traces, x, axis("mean error of the walk / m", rangemode="tozero")) if traces else None


def movement_layer(points: Any, name: str, colour: str, symbol: int, texts: Sequence[str] = ()) -> Trace:
    """Mean errors of walks against the movement of their landmarks (n, 2), metres."""
    look = {"color": colour, "size": 8, "symbol": symbol, "opacity": 0.8}
    hover = "%{text}<br>moved %{x:.2f} m, error %{y:.2f} m"
    return scatter("markers", name, points, text=list(texts), marker=look, hovertemplate=hover)


def drift_figure(evaluation: SurveyEvaluation) -> str | None:
    """Return, as JSON, the mean error by the distance walked since the last landmark; None without dense truth."""
    traces = []
    for strategy, colour, dash in _looks(evaluation):
        rows = [row for row in evaluation.dense if (row.strategy, row.what) == (strategy, SINCE_LANDMARK)]
        if rows:
            traces.append(
                scatter(
                    "lines+markers",
                    plotly_text(strategy),
                    x=[f"{row.low:g} to {row.high:g}" if row.high is not None else f"over {row.low:g}" for row in rows],
                    y=[row.mean_m for row in rows],
                    line={"color": colour, "dash": dash},
                    hovertemplate="%{x} m: %{y:.2f} m",
                )
            )
    x = axis("distance walked since the last landmark / m", grid=False, type="category")
    return _chart(traces, x, axis("mean error / m", rangemode="tozero")) if traces else None


def _looks(evaluation: SurveyEvaluation) -> Iterator[tuple[str, str, str]]:
    """Each strategy with its colour and dash."""
    yield from zip(evaluation.strategies, cycle(COLOURS), cycle(DASHES), strict=False)


def _measured(
    evaluation: SurveyEvaluation, truth: TruthKind, method: str, strategy: str
) -> list[tuple[SessionEvaluation, StrategyErrors]]:
    return [
        (session, one)
        for session in evaluation.sessions
        for one in session.measured
        if (one.truth, one.method, one.strategy) == (truth, method, strategy)
    ]


def _chart(traces: Sequence[Trace], x: Trace, y: Trace) -> str:
    return figure_json(chart(traces, x, y, hovermode="closest", dragmode="zoom"))
