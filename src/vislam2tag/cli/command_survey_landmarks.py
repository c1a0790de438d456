"""``vislam2tag survey-landmarks``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, Jobs, SurveyFolder
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import show_table
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.pipeline.labels.landmark_results import LandmarkRow, LandmarkSurvey


@command
def survey_landmarks_command(
    *,
    survey: SurveyFolder,
    out: Path = option(..., "Landmark file to write, or to write anew.", metavar="FILE"),
    floor: tuple[int, ...] = option((), "Only walks that start on this floor; repeatable. FILE holds all floors."),
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: bool | None = setting("survey.use_planned"),
    report: Path | None = option(None, "Write everything found out about landmarks and walks as JSON.", metavar="FILE"),
) -> None:
    """Give landmarks without a position one, from all walks together.

    Measure three or more landmarks well apart, leave x and y of the others empty in marker_dict.csv (or the others out
    of it), walk past all of them: each gets a position, a heading and their standard deviations. FILE holds all
    landmarks of all floors, the surveyed ones as they are; beside it stands what errors they share (FILE with the
    ending .covariance.parquet). `process --landmarks FILE` reads both. The survey stays as it is.

    Exit code: 0 all right, 1 all sessions are excluded, at least one session cannot be read or is not tied to the
    survey, 2 wrong usage, not a survey, or FILE cannot be written, 130 interrupted (nothing is written).

    \b
    Examples:
      vislam2tag survey-landmarks survey --out completed.csv
      vislam2tag survey-landmarks survey --out completed.csv \\
          --report landmarks.json --floor 1
      vislam2tag process survey --out labels --landmarks completed.csv
    """
    from vislam2tag.pipeline.labels.landmark_results import (
        check_targets,
        landmark_survey,
        shared_errors,
        write_completed,
    )
    from vislam2tag.pipeline.labels.landmark_survey import survey_landmarks

    check_targets(survey, out, *([] if report is None else [report]))
    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with session_bar("sessions") as bar:
        advance = lambda session, total: bar.advance(total, session.error)
        joint = survey_landmarks(survey, settings, floors=floor, jobs=jobs, progress=advance)
    result = landmark_survey(joint)
    write_completed(result, out, report, shared_errors(joint))
    all_used = bool(result.sessions) and all(session.used for session in result.sessions)
    answer(result, json, lambda: _print(result, survey, out), failed=not all_used)


def _print(result: LandmarkSurvey, survey: Path, out: Path) -> None:
    show_table(_table(result))
    for session in result.sessions:
        if session.note:
            say(f"floor {session.floor} / {session.device} / {session.session}: {session.note}")
    for odd in result.references.odd:
        say(f"odd one out: {odd.summary}")
    surveyed = sum(row.surveyed for row in result.landmarks)
    placed = sum(row.x_m is not None for row in result.landmarks) - surveyed
    used = sum(session.used for session in result.sessions)
    say(
        f"{len(result.landmarks)} landmarks: {surveyed} surveyed, {placed} estimated, "
        f"{len(result.landmarks) - surveyed - placed} without a position; "
        f"{used} of {len(result.sessions)} sessions used"
    )
    say(f"landmarks: {out}")
    next_step("survey-landmarks" if used else "process, failed", survey=survey, landmarks=out)


def _table(result: LandmarkSurvey) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title="Landmarks (metres)", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("landmark", overflow="fold")
    for name in ("floor", "x", "y", "sigma", "sessions", "passes"):
        table.add_column(name, justify="right")
    table.add_column("position")
    table.add_column("off by", justify="right")
    table.add_column("note", overflow="fold")
    for row in result.landmarks:
        table.add_row(*_cells(row))
    return table


def _cells(row: LandmarkRow) -> tuple[str, ...]:
    from rich.markup import escape

    numbers = tuple("-" if number is None else f"{number:.2f}" for number in (row.x_m, row.y_m, row.sigma_m))
    source = "surveyed" if row.surveyed else "estimated" if row.x_m is not None else "[red]none[/]"
    off = "-"
    if row.discrepancy_m is not None and row.discrepancy_sigma_m is not None:
        off = f"{row.discrepancy_m:.2f} ± {row.discrepancy_sigma_m:.2f}"
    counts = (str(row.sessions), str(row.passes))
    return (escape(row.landmark), str(row.floor), *numbers, *counts, source, off, escape(row.note))
