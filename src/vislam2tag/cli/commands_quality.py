"""Commands that measure the accuracy of labels: ``check`` and ``evaluate``."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    ConfigFile,
    FollowLinks,
    Jobs,
    LandmarkFile,
    SessionOptions,
    SurveyFolder,
    setting,
    settings_from,
)
from vislam2tag.cli.progress import SessionBar, interrupted_with, outputs_of_interrupted, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.tables import metres, print_table, print_warnings, red
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.plugins import STRATEGIES

if TYPE_CHECKING:
    from rich.text import Text

    from vislam2tag.quality.evaluation.record import ErrorRow, FigureWithInterval
    from vislam2tag.quality.self_check_record import BadLandmark, FloorCheck
    from vislam2tag.site.walkable.walked import WalkedFloor


_MOST_ROOMS = 8
"""Number of rooms printed; the page and check.json list all."""


@dataclass(frozen=True, kw_only=True)
class CheckOptions:
    """Arguments and options of ``vislam2tag check``."""

    survey: SurveyFolder
    out: Path | None = option(None, "Folder for check.json and check.html with maps.", metavar="FOLDER")
    landmarks: LandmarkFile = None
    sessions: SessionOptions
    follow_links: FollowLinks = False
    jobs: Jobs = ALL_CORES
    json: AsJson = False
    config: ConfigFile = None
    max_sigma_m: float | None = setting("labels.max_sigma_m")
    use_planned: bool | None = setting("survey.use_planned")


@command
def check_command(given: CheckOptions) -> None:
    """Estimate the accuracy of labels without ground truth, and find bad landmarks.

    Each surveyed landmark in turn is left out of a session and predicted from the others. The prediction errors give
    the mean error of the session's labels (docs/explanation/truth.md). The command names landmarks whose predictions
    have the same error in all sessions, and the three places on each floor where another landmark would help most. It
    also shows which part of the walkable space was walked, which rooms were not entered, and a walk to cover the rest.
    Of walks that only the floor's plan places, it reports the error that sigma predicts. Files are only written with
    --out.

    Exit code: 0 nothing is wrong, 1 a landmark or known position is wrong, or a session cannot be read or mapped, 2
    wrong usage or not a survey, 3 no session could be judged, 130 interrupted.

    \b
    Examples:
      vislam2tag check survey
      vislam2tag check survey --out checked --floor 1
      vislam2tag check survey --landmarks completed.csv --max-sigma-m inf
    """
    from vislam2tag.pipeline.labels.check import CHECK_FILE, PAGE_FILE

    settings = settings_from(given, given.survey)
    written = () if given.out is None else (given.out / CHECK_FILE, given.out / PAGE_FILE)
    with outputs_of_interrupted(*written), session_bar("sessions") as bar:
        found = api.check(
            given.survey,
            settings,
            out=given.out,
            landmarks=given.landmarks,
            selection=given.sessions.selection,
            jobs=given.jobs,
            walkable=settings.walkable,
            follow_links=given.follow_links,
            progress=lambda session, total: bar.advance(total, session.error),
            tell=print_warnings,
        )
    after = _after(found)
    answer(
        found, given.json, lambda: _print_check(found, given, after), failed=after != "check", nothing=not found.checked
    )


def _after(found: api.SurveyCheck) -> str:
    """Name of the next step."""
    from vislam2tag.common.findings import Answer

    if found.failed or not found.checked:
        return "check, failed"
    return "process, faults" if found.judgement.answer is Answer.WRONG else "check"


def _print_check(found: api.SurveyCheck, given: CheckOptions, after: str) -> None:
    from vislam2tag.pipeline.labels.check import PAGE_FILE

    _print_sessions(found)
    if any(session.stated_m is not None and not session.well_founded for session in found.sessions):
        say("(in brackets: based on fewer than three left-out landmarks, so hardly better than the stated sigma)")
    if found.bad_landmarks:
        _print_bad(found.bad_landmarks)
    say(f"landmarks and known positions: {found.judgement.sentence}")
    if any(session.doubtful_fixes for session in found.sessions):
        _print_doubtful(found.sessions)
    if found.floors:
        _print_places(found.floors)
    if found.walked:
        _print_walked(found.walked)
    if any(floor.areas for floor in found.walked):
        _print_areas(found.walked)
    for floor in found.walked:
        for line in _walked_lines(floor):
            say(line)
    say(f"sessions: {len(found.sessions)} ({found.failed} failed)")
    if given.out is not None:
        say(f"page: {given.out / PAGE_FILE}")
    next_step(after, survey=given.survey)


def _print_sessions(found: api.SurveyCheck) -> None:
    title = f"Mean error of the labels (sigma at most {found.max_sigma_m} m)"
    errors = ("left out", "their median error", "labelled", "stated", "estimated", "90 % interval")
    rows = [(str(each.floor), each.device, each.session, *_session_cells(each)) for each in found.sessions]
    print_table(title, ("floor", "device", "session"), ("landmarks or fixes", *errors), rows)
    if estimates := [one.estimated_m for one in found.sessions if one.estimated_m is not None]:
        say(f"Labels: estimated mean error {metres(median(estimates))} (the median of the sessions)")


def _session_cells(session: api.SessionCheck) -> tuple[str | Text, ...]:
    from vislam2tag.views.quality_pages import median_left_out_m

    if session.error is not None:
        return (red("failed"),)
    share = f"{100 * session.labelled / session.frames:.0f} %" if session.frames else "-"
    left_out = (str(len(session.left_out)), metres(median_left_out_m(session)))
    counted = (str(session.landmarks or session.fixes), *left_out, share)
    if session.estimated_m is None:
        return (*counted, "-", "-", "-")
    estimated = metres(session.estimated_m)
    shown = estimated if session.well_founded else f"({estimated})"
    return (*counted, metres(session.stated_m), shown, f"{session.low_m:.2f} to {session.high_m:.2f} m")


def _print_bad(found: list[BadLandmark]) -> None:
    from vislam2tag.views.quality_pages import FAULTS

    rows = []
    for bad in found:
        name = f"{bad.landmark} ({bad.room})" if bad.room else bad.landmark
        sizes = (metres(bad.size_m), metres(bad.sigma_m), str(bad.sessions))
        rows.append((str(bad.floor), name, FAULTS[bad.fault], *sizes))
    heads = ("error", "sigma", "sessions")
    print_table("Bad landmarks", ("floor", "landmark", "possible cause"), heads, rows)


def _print_doubtful(sessions: list[api.SessionCheck]) -> None:
    rows = (
        (str(session.floor), session.device, session.session, fix.name, metres(fix.size_m), metres(fix.sigma_m))
        for session in sessions
        for fix in session.doubtful_fixes
    )
    title = "Known positions that contradict the others of their walk"
    print_table(title, ("floor", "device", "session", "position"), ("error", "sigma"), rows)


def _print_places(floors: list[FloorCheck]) -> None:
    rows = []
    for floor in floors:
        for place in floor.places:
            where = (f"{place.x_m:.1f} m", f"{place.y_m:.1f} m")
            then = floor.expected_m - place.gain_m
            rows.append((str(floor.number), place.near, *where, f"{floor.expected_m:.3f} m", f"{then:.3f} m"))
    print_table("Best places for another landmark", ("floor", "near"), ("x", "y", "mean error now", "with it"), rows)


def _print_walked(floors: list[WalkedFloor]) -> None:
    rows: list[tuple[str, ...]] = []
    for floor in floors:
        if floor.walkable_m2 is None:
            rows.append((str(floor.number), "-", "-", "-", "-", "-"))
            continue
        rooms = f"{len(floor.rooms) - len(floor.never_entered)} of {len(floor.rooms)}"
        fill = "-" if floor.walk is None else f"{floor.walk.length_m:.0f} m, {floor.walk.minutes:.0f} min"
        shares = (f"{100 * (share or 0.0):.0f} %" for share in (floor.walked, floor.scanned))
        rows.append((str(floor.number), f"{floor.walkable_m2:.0f} m²", *shares, rooms, fill))
    title = "Share of the walkable space that was walked (within 2 m)"
    heads = ("walkable", "walked", "scanned", "rooms entered", "walk to cover the rest")
    print_table(title, ("floor",), heads, rows)


def _print_areas(floors: list[WalkedFloor]) -> None:
    """Print the rooms and corridors of each floor with the largest unwalked area; the page lists all."""
    rows = []
    for floor in floors:
        for area in sorted(floor.areas, key=lambda area: -area.area_m2 * (1 - area.walked))[:_MOST_ROOMS]:
            shares = (f"{100 * share:.0f} %" for share in (area.walked, area.scanned))
            rows.append((str(floor.number), area.name, f"{area.area_m2:.0f} m²", *shares))
    title = "Rooms and corridors with the largest unwalked area"
    print_table(title, ("floor", "room or corridor"), ("area", "walked", "scanned"), rows)


def _walked_lines(floor: WalkedFloor) -> list[str]:
    """The rooms that no walk entered, or why this is unknown."""
    if floor.note:
        return [f"floor {floor.number}: {floor.note}"]
    odd = [f"{one.file}: {one.message}" for one in floor.findings]
    missed = [area.name for area in floor.never_entered]
    more = f" and {len(missed) - _MOST_ROOMS} more" if len(missed) > _MOST_ROOMS else ""
    rooms = [f"floor {floor.number}, never entered: {', '.join(missed[:_MOST_ROOMS])}{more}"] if missed else []
    return odd + rooms


_PIPE_WIDTH = 160
"""Width of the tables if the output is not a terminal."""


_NOTHING_COMPARED = "no session could be compared with ground truth"


@dataclass(frozen=True, kw_only=True)
class EvaluateOptions:
    """Arguments and options of ``vislam2tag evaluate``."""

    survey: SurveyFolder
    out: Path = option(..., "Output folder: new, empty or from an earlier evaluation.")
    strategy: tuple[str, ...] = option((), f"Only this strategy; repeatable: {', '.join(STRATEGIES.names())}.")
    landmarks: LandmarkFile = None
    truth: Path | None = option(
        None,
        "Read true trajectories from FOLDER/SLUG.csv, .tum, .euroc or .kitti instead of the sessions.",
        metavar="FOLDER",
    )
    clock_drift: bool = option(False, "Estimate a drift between the clocks of total station and phone.", hidden=True)
    sessions: SessionOptions
    jobs: Jobs = ALL_CORES
    json: AsJson = False
    config: ConfigFile = None
    max_sigma_m: float | None = setting("labels.max_sigma_m")
    max_step_m: float | None = setting("mapping.max_step_m", hidden=True)
    use_planned: bool | None = setting("survey.use_planned")


@command
def evaluate_command(given: EvaluateOptions) -> None:
    """Measure the accuracy of labels against ground truth.

    Each strategy maps every session. Its labels are compared with all available truth: button presses at control
    points, the track of a total station, and true trajectories (truth.csv, .tum, .euroc or .kitti in the session's
    folder, or --truth). Truth is never used for mapping. Writes OUT/errors.csv, errors.tex, sessions.csv, dense.csv,
    evaluation.json, report.html and OUT/trajectories (TUM files, which evo reads). docs/how-to/evaluate.md explains the
    figures.

    Exit code: 0 compared (outliers among control points are named), 1 a session cannot be read or mapped, 2 wrong
    usage, not a survey, or no truth, 3 no session could be compared, 130 interrupted.

    \b
    Examples:
      vislam2tag evaluate survey --out evaluated
      vislam2tag evaluate survey --out evaluated --strategy smoother \\
          --strategy local --floor 1
      vislam2tag evaluate survey --out evaluated --truth mocap --max-sigma-m inf
    """
    settings = settings_from(given, given.survey)
    with interrupted_with(lambda: _there(given.out)), session_bar("walks") as bar:
        found = api.evaluate(
            given.survey,
            given.out,
            settings,
            strategies=given.strategy,
            landmarks=given.landmarks,
            truth=given.truth,
            clock_drift=given.clock_drift,
            selection=given.sessions.selection,
            jobs=given.jobs,
            progress=lambda session, total: _advance(bar, session, total),
            tell=print_warnings,
        )
    if given.json and not found.rows:
        say(_NOTHING_COMPARED, err=True)
    answer(found, given.json, lambda: _print_evaluate(found, given), failed=bool(found.failed), nothing=not found.rows)


def _there(out: Path) -> str:
    from vislam2tag.pipeline.labels.evaluate import RECORD_FILE

    return f"{out} contains {'an' if (out / RECORD_FILE).is_file() else 'no'} evaluation"


def _advance(bar: SessionBar, session: api.SessionEvaluation, total: int) -> None:
    bar.advance(total, session.error)
    for reason in session.missing:
        bar.print_line("no truth", "yellow", f"floor {session.floor} / {session.device} / {session.session}: {reason}")


def _print_evaluate(found: api.SurveyEvaluation, given: EvaluateOptions) -> None:
    from vislam2tag.labeling.settings import ProcessSettings
    from vislam2tag.pipeline.labels.evaluate import PAGE_FILE
    from vislam2tag.quality.evaluation.metrics import ALL, ALL_WALKS, OVER_WALKS, truth_name

    usual = ProcessSettings().strategy

    shown = [row for row in found.rows if row.group == ALL and row.over == OVER_WALKS]
    for (truth, method), rows in groupby(shown, key=lambda row: (row.truth, row.method)):
        of_truth = list(rows)
        _print_errors(truth_name(truth, method), of_truth)
        for row in of_truth:
            if row.selection == ALL_WALKS and row.strategy == usual and row.mean_m.value is not None:
                say(f"Labels of {row.strategy}: mean error {metres(row.mean_m.value)}")
    _print_strategies(found)
    say("the files and the page also have errors over points, by floor, by device and by session")
    say(f"sessions: {len(found.sessions)} ({found.failed} failed)")
    for odd in found.odd_points:
        say(f"outlier: {odd.summary}")
    say(f"control points: {found.judgement.sentence}")
    say(f"page: {given.out / PAGE_FILE}")
    next_step("evaluate, failed" if found.failed or not found.rows else "evaluate", survey=given.survey)
    if not found.rows:
        say(_NOTHING_COMPARED, err=True)


def _print_errors(title: str, rows: list[ErrorRow]) -> None:
    from vislam2tag.quality.evaluation.metrics import HEADS

    cells: list[tuple[str, ...] | None] = []
    for _, same in groupby(sorted(rows, key=lambda row: row.selection), key=lambda row: row.selection):
        for row in same:
            share = "-" if row.labelled.value is None else f"{100 * row.labelled.value:.0f} %"
            figures = (_cell(getattr(row, name), with_interval=name == "mean_m") for name in HEADS)
            cells.append((row.selection, row.strategy, str(row.walks), share, *figures))
        cells.append(None)
    heads = ("walks", "labelled", *HEADS.values())
    title = f"Error at {title}, over walks, metres"
    print_table(title, ("trajectories", "strategy"), heads, cells, pipe_width=_PIPE_WIDTH)


def _cell(figure: FigureWithInterval, *, with_interval: bool) -> str:
    """Format a figure. Only some have their interval, because terminals are narrow."""
    from vislam2tag.quality.evaluation.metrics import figure_text
    from vislam2tag.quality.evaluation.record import FigureWithInterval

    return figure_text(figure if with_interval else FigureWithInterval(value=figure.value))


def _print_strategies(found: api.SurveyEvaluation) -> None:
    """Print the share that each strategy keeps, and with dense truth the growth of its error."""
    heads = ["labelled, relative to local", *(["error growth since the last landmark"] if found.drift else [])]
    rows = []
    for name in found.strategies:
        kept, slope = found.retention[name], found.drift.get(name)
        cells = ["-" if kept is None else f"{100 * kept:.0f} %", "-" if slope is None else f"{100 * slope:.2f} cm/m"]
        rows.append((name, *cells[: len(heads)]))
    print_table("Strategies", ("strategy",), heads, rows, pipe_width=_PIPE_WIDTH)
