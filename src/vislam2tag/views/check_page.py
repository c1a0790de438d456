"""The page of a check without ground truth: left-out errors and the gain of one more landmark on each floor's plan."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.core.cell_grid import around_most
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
    arrows,
    cells,
    colour_bar,
    one_colour,
    plotly_text,
    scatter,
)
from vislam2tag.views.page import write_page

FAULTS = {
    Fault.OFFSET: "the walks put it elsewhere, all at one place: measure it again",
    Fault.DOUBT: "the only walk that tells puts it elsewhere: measure it again, or the tracker slipped there",
    Fault.SCATTER: "the walks do not agree on where it is: did it move, or do two sheets have this id?",
}
"""What a reader should make of each fault."""
_SHADED_STEPS = 2
"""Places of the walkable space to the side of a shaded square: finer than anybody walks."""


def write_check_page(
    out_file: Path, survey: Survey, check: SurveyCheck, gains: GainMap, spaces: Mapping[int, WalkedSpace | None]
) -> None:
    """Write the page ``out_file`` about a check of a survey; equal input gives equal bytes.

    ``spaces`` are what was walked of each floor, for its map.
    It is written beside ``out_file`` and renamed when whole. Raises OutputError where it cannot be.
    """
    context = {
        "title": survey.root.resolve().name,
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
    """Mean error to expect over all frames of all floors, metres; None without any."""
    frames = sum(floor.frames for floor in check.floors)
    return sum(floor.frames * floor.expected_m for floor in check.floors) / frames if frames else None


def median_left_out_m(session: SessionCheck) -> float | None:
    """Median length of a session's left-out errors, metres; None where nothing could be left out."""
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
    """Shade the walkable space that no walk came near."""
    step_m = _SHADED_STEPS * space.distances.step_m
    missing = space.places_m[~space.walked]
    shaded = np.unique(np.floor(missing / step_m).astype(np.int64), axis=0).reshape(-1, 2)
    name = "walkable, but not walked"
    values = dict.fromkeys(((column, row) for column, row in shaded.tolist()), 1)
    look = one_colour(ORANGE) | {"opacity": 0.45, "showlegend": len(shaded) > 0}
    return _squares(name, values, step_m, name, **look)


def _squares(name: str, values: Mapping[Cell, float], side_m: float, hover: str, **look: Any) -> Trace:
    """Squares of a grid from the origin by column and row, each with its value; the others stay clear."""
    columns, rows = np.array(list(values), dtype=np.int64).reshape(-1, 2).T
    x = np.arange(columns.min(), columns.max() + 1) if values else np.empty(0, dtype=np.int64)
    y = np.arange(rows.min(), rows.max() + 1) if values else np.empty(0, dtype=np.int64)
    squares: list[list[float | None]] = [[None] * len(x) for _ in y]
    for (column, row), value in values.items():
        squares[row - y[0]][column - x[0]] = value
    return cells(name, ((x + 0.5) * side_m).round(3), ((y + 0.5) * side_m).round(3), squares, hover, **look)


def _room_names(space: WalkedSpace | None) -> list[Trace]:
    """The names of the areas that have one, where most room is around them."""
    named = [] if space is None else [area for area, name in enumerate(space.areas.names) if name]
    if space is None or not named:
        return []
    text = [plotly_text(space.areas.names[area]) for area in named]
    look: dict[str, Any] = {"text": text, "textfont": {"size": 11}, "showlegend": False, "hoverinfo": "skip"}
    return [scatter("text", "rooms", space.areas.middle_m[named].round(2), **look)]


def _gain_map(gains: dict[Cell, float]) -> Trace:
    """Colour each square that a landmark could stand in by the gain there, centimetres."""
    near = around_most(np.array(list(gains), dtype=np.int64).reshape(-1, 2))
    return _squares(
        "gain of one more landmark",
        {cell: round(100 * gain, 3) for cell, gain in compress(gains.items(), near)},
        CELL_M,
        "one more landmark here: mean error falls by %{z:.1f} cm",
        zmin=0,
        colorscale="YlGnBu",
        opacity=0.75,
        showlegend=True,
        colorbar=colour_bar("gain / cm"),
    )


def _left_out(sessions: Iterable[SessionCheck], number: int) -> Trace:
    """One arrow for each left-out landmark of each session, from the surveyed place to the predicted one."""
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
    return f"{session.device} / {session.session}: {what} {mark.landmark} predicted {size_m:.2f} m off"


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
        hovertext=[f"mean error falls by {100 * place.gain_m:.1f} cm" for place in floor.places],
    )
