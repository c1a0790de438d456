"""The first page of a run: its figures, what to do next, what changed since the last run, and a map of each floor."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.records import Record
from vislam2tag.core.status import labelled_share
from vislam2tag.labeling.results import Summary
from vislam2tag.quality.self_check_record import SurveyCheck
from vislam2tag.site.model import Survey
from vislam2tag.site.walkable.walked import WalkedFloor
from vislam2tag.views.floor_map import drawn_plan, site_figure, walk_to_fill
from vislam2tag.views.layers import Trace, cells, colour_bar
from vislam2tag.views.page import distance, number, percent, survey_title, write_page
from vislam2tag.views.run_summary import problems

CELL_M = 1.0
"""Side of a square whose expected error is drawn."""
MOST_TASKS = 3
"""How many things to do next are listed."""
_MOST_M = 1.0
"""Expected errors from this on have one colour, so that floors can be compared."""
_FARTHEST_M = 500.0
"""Positions farther from the middle of a floor's are not drawn: they would make a map of any size."""
_LEAST_GAIN_M = 0.01
"""One more landmark is proposed from this decrease of the mean error on."""


class RunFigures(Record):
    """What two runs over a survey are compared by."""

    sessions: int
    failed: int
    labelled: float | None
    """Share of the camera frames."""
    expected_m: dict[int, float]
    """Expected mean error by floor."""
    walked: dict[int, float]
    """Share of the walkable space by floor."""
    faults: int

    @classmethod
    def of(cls, summary: Summary, check: SurveyCheck, faults: Sequence[str]) -> RunFigures:
        """Those of a run's results."""
        return cls(
            sessions=summary.sessions,
            failed=summary.failed,
            labelled=labelled_share(summary.frames),
            expected_m={floor.number: floor.expected_m for floor in check.floors},
            walked={floor.number: floor.walked for floor in check.walked if floor.walked is not None},
            faults=len(faults),
        )


@dataclass(frozen=True)
class Page:
    """Another page of the run."""

    href: str
    title: str
    about: str


@dataclass(frozen=True)
class Task:
    """Something to do, and how: a page that shows it, or a command."""

    what: str
    href: str = ""
    command: str = ""


def write_dashboard(
    out_file: Path,
    survey: Survey,
    labels: Path,
    results: tuple[Summary, SurveyCheck, Sequence[str]],
    before: RunFigures | None,
    pages: Mapping[str, Page],
) -> None:
    """Write the page ``out_file`` about a run; equal input gives equal bytes.

    ``labels`` is the folder of the run's labels. ``results`` are its totals, its check, and the faults found.
    ``before`` has the figures of the last run that differed. ``pages`` are the run's other pages: ``report``,
    ``conflicts``, ``check`` and ``dataset``. Raises OutputError if it cannot be written.
    """
    summary, check, faults = results
    figures = RunFigures.of(summary, check, faults)
    tasks = _tasks(survey, summary, check, faults, pages)
    context = {
        "title": survey_title(survey.root),
        "summary": summary,
        "figures": figures,
        "expected_m": _mean(figures.expected_m, {floor.number: floor.frames for floor in check.floors}),
        "walked": _mean(figures.walked, {floor.number: floor.walkable_m2 or 0.0 for floor in check.walked}),
        "tasks": list(islice(tasks, MOST_TASKS)),
        "changes": [] if before is None else list(changes(before, figures)),
        "pages": list(pages.values()),
        "floors": _floors(survey, labels, check),
    }
    write_page(out_file, "index.html.j2", context)


def _mean(values: Mapping[int, float], weights: Mapping[int, float]) -> float | None:
    total = sum(weights[key] for key in values)
    return sum(value * weights[key] for key, value in values.items()) / total if total else None


def _tasks(
    survey: Survey, summary: Summary, check: SurveyCheck, faults: Sequence[str], pages: Mapping[str, Page]
) -> Iterator[Task]:
    """What to do next, the most important first; it ends with what a complete survey is for."""
    report, checked = pages["report"].href, pages["check"].href
    name = survey.root.resolve().name
    if faults:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        told = f"Correct a fault: {faults[0]}{more}. In the folder that has the survey:"
        yield Task(told, command=f"vislam2tag studio {shlex.quote(name)}")
        summary = summary.model_copy(update={"contradictions": []})  # what faults explain
    for problem in problems(summary, survey.findings):
        yield Task(f"{_sentence(problem.what)} {_sentence(problem.todo)}".rstrip(), f"{report}#{problem.anchor}")
    for bad in () if faults else check.bad_landmarks:
        off = number(bad.size_m, 2, "m")
        yield Task(f"Measure landmark {bad.landmark} on floor {bad.floor} again: walks put it {off} away.", checked)
    for floor in check.walked:
        if floor.walk is not None:
            way = f"{distance(floor.walk.length_m)} on floor {floor.number}"
            yield Task(f"Walk {way} to cover the rest of it.", f"{checked}#floor-{floor.number}")
    for one in check.floors:
        if one.places and one.places[0].gain_m >= _LEAST_GAIN_M:
            gain = number(one.places[0].gain_m, 2, "m")
            what = f"Add a landmark on floor {one.number}: the expected error decreases by {gain}."
            yield Task(what, f"{checked}#floor-{one.number}")
    yield Task(
        "Train a positioning model. In the folder of this page:", command="vislam2tag train dataset --out building.v2t"
    )


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def changes(before: RunFigures, now: RunFigures) -> Iterator[tuple[str, str, str]]:
    """Each figure that differs: its name, before and now."""
    floors = sorted(before.expected_m.keys() | now.expected_m.keys() | before.walked.keys() | now.walked.keys())
    rows = [
        ("walks", str(before.sessions), str(now.sessions)),
        ("failed walks", str(before.failed), str(now.failed)),
        ("labelled camera frames", percent(before.labelled), percent(now.labelled)),
        ("faults", str(before.faults), str(now.faults)),
    ]
    for floor in floors:
        errors = [number(each.expected_m.get(floor), 2, "m") for each in (before, now)]
        walked = [percent(each.walked.get(floor)) for each in (before, now)]
        rows += [(f"expected error on floor {floor}", errors[0], errors[1])]
        rows += [(f"walked of floor {floor}", walked[0], walked[1])]
    return ((name, old, new) for name, old, new in rows if old != new)


def _floors(survey: Survey, labels: Path, check: SurveyCheck) -> Iterator[dict[str, Any]]:
    walked = {floor.number: floor for floor in check.walked}
    expected = {floor.number: floor.expected_m for floor in check.floors}
    files = (labels / "trajectory" / f"{ref.slug}.parquet" for ref in survey.sessions)
    errors = expected_errors([file for file in files if file.is_file()])
    for floor in survey.site.floors:
        plan, note = drawn_plan(floor)
        here = errors.filter(pl.col("floor") == floor.number)
        above = walk_to_fill(walked.get(floor.number))
        yield {
            "floor": floor,
            "expected_m": expected.get(floor.number),
            "walked": walked.get(floor.number) or WalkedFloor(number=floor.number, note="unknown"),
            "note": note,
            "figure": site_figure(floor, survey.site.landmarks, plan, [_error_map(here)], above),
        }


def expected_errors(files: Sequence[Path]) -> pl.DataFrame:
    """Mean expected error of the positions in each square: ``floor``, ``column``, ``row`` and ``error_m``.

    ``files`` are tables of labelled frames. The error is that of a circular normal distribution: sqrt(pi / 2) sigma.
    """
    columns = ("floor", "x", "y", "sigma")
    if not files:
        return pl.DataFrame(schema={"floor": pl.Int32, "column": pl.Int64, "row": pl.Int64, "error_m": pl.Float64})
    positions = scan_parquet(files).select(columns).filter(pl.all_horizontal(pl.col(columns).is_finite()))
    column, row = ((pl.col(axis) / CELL_M).floor().cast(pl.Int64) for axis in ("x", "y"))
    squares = positions.group_by("floor", column.alias("column"), row.alias("row"))
    grouped = squares.agg(error_m=pl.col("sigma").mean() * np.sqrt(np.pi / 2))
    return grouped.sort("floor", "row", "column").collect(engine="streaming")


def _error_map(errors: pl.DataFrame) -> Trace:
    away_m = [(pl.col(axis) - pl.col(axis).median()).abs() * CELL_M for axis in ("column", "row")]
    errors = errors.filter(pl.max_horizontal(away_m) <= _FARTHEST_M)
    x, y = errors["column"].to_numpy(), errors["row"].to_numpy()
    across = np.arange(x.min(), x.max() + 1) if len(x) else x
    up = np.arange(y.min(), y.max() + 1) if len(y) else y
    squares: list[list[float | None]] = [[None] * len(across) for _ in up]
    for column, row, error_m in errors.select("column", "row", "error_m").iter_rows():
        squares[row - y.min()][column - x.min()] = round(error_m, 3)
    return cells(
        "expected error",
        ((across + 0.5) * CELL_M).round(3),
        ((up + 0.5) * CELL_M).round(3),
        squares,
        "expected error %{z:.2f} m",
        zmin=0,
        zmax=_MOST_M,
        colorscale="Viridis",
        opacity=0.8,
        showlegend=True,
        colorbar=colour_bar(f"expected error / m ({_MOST_M:g} or more)"),
    )
