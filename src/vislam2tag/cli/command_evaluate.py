"""``vislam2tag evaluate``."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Jobs,
    LandmarkFile,
    SessionOptions,
    SurveyFolder,
)
from vislam2tag.cli.progress import SessionBar, interrupted_with, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_from
from vislam2tag.cli.tables import print_table, print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.plugins import STRATEGIES

if TYPE_CHECKING:
    from vislam2tag.quality.evaluation.record import ErrorRow, FigureWithInterval, SessionEvaluation, SurveyEvaluation


_PIPE_WIDTH = 160
"""Columns of the tables where the output is no terminal."""


_NOTHING_COMPARED = "no session could be compared with any truth"


@dataclass(frozen=True, kw_only=True)
class EvaluateOptions:
    """Arguments and options of ``vislam2tag evaluate``."""

    survey: SurveyFolder
    out: Path = option(..., "Output folder: new, empty or from an earlier evaluation.")
    strategy: tuple[str, ...] = option(
        (), f"Only this strategy; repeatable. There are: {', '.join(STRATEGIES.names())}."
    )
    landmarks: LandmarkFile = None
    truth: Path | None = option(
        None,
        "Take truth of the whole walk from FOLDER/SLUG.csv, .tum, .euroc or .kitti, not from the sessions.",
        metavar="FOLDER",
    )
    clock_drift: bool = option(False, "Let a total station's clock run at another rate than the phone's.", hidden=True)
    sessions: SessionOptions
    jobs: Jobs = ALL_CORES
    json: AsJson = False
    config: ConfigFile = None
    max_sigma_m: float | None = setting("labels.max_sigma_m")
    max_step_m: float | None = setting("mapping.max_step_m")
    use_planned: bool | None = setting("survey.use_planned")


@command
def evaluate_command(given: EvaluateOptions) -> None:
    """Evaluate: how good are the labels, against every kind of truth?

    Every session is mapped by each strategy and compared with what there is: presses at control points, a total
    station's track, a truth of the whole walk (truth.csv, .tum, .euroc or .kitti in the session's folder, or --truth).
    Writes OUT/errors.csv, errors.tex, sessions.csv, dense.csv, evaluation.json, report.html and OUT/trajectories (TUM
    files, which evo reads). docs/how-to/evaluate.md tells what each figure is. Truth is never used to map.

    Exit code: 0 all right (odd control points are named and no failure), 1 at least one session cannot be read or
    mapped, or none compared, 2 wrong usage, not a survey, no truth, or OUT cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag evaluate survey --out evaluated
      vislam2tag evaluate survey --out evaluated --strategy smoother \\
          --strategy local --floor 1
      vislam2tag evaluate survey --out evaluated --truth mocap --max-sigma-m inf
    """
    from vislam2tag.pipeline.labels.evaluate import evaluate

    settings = settings_from(given, given.survey)
    with interrupted_with(lambda: _there(given.out)), session_bar("walks") as bar:
        found = evaluate(
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
    answer(found, given.json, lambda: _print(found, given), failed=bool(found.failed or not found.rows))


def _there(out: Path) -> str:
    from vislam2tag.pipeline.labels.evaluate import RECORD_FILE

    return f"{out} contains {'an' if (out / RECORD_FILE).is_file() else 'no'} evaluation"


def _advance(bar: SessionBar, session: SessionEvaluation, total: int) -> None:
    bar.advance(total, session.error)
    for reason in session.missing:
        bar.print_line("no truth", "yellow", f"floor {session.floor} / {session.device} / {session.session}: {reason}")


def _print(found: SurveyEvaluation, given: EvaluateOptions) -> None:
    from vislam2tag.pipeline.labels.evaluate import PAGE_FILE
    from vislam2tag.quality.evaluation.metrics import ALL, OVER_WALKS
    from vislam2tag.quality.evaluation.text import truth_name

    shown = [row for row in found.rows if row.group == ALL and row.over == OVER_WALKS]
    for (truth, method), rows in groupby(shown, key=lambda row: (row.truth, row.method)):
        _print_errors(truth_name(truth, method), list(rows))
    _print_strategies(found)
    say("over points, by floor and device, and each session: in the files and the page")
    say(f"sessions: {len(found.sessions)} ({found.failed} failed)")
    for odd in found.odd_points:
        say(f"odd one out: {odd.summary}")
    say(f"control points: {found.judgement.sentence}")
    say(f"page: {given.out / PAGE_FILE}")
    next_step("evaluate, failed" if found.failed or not found.rows else "evaluate", survey=given.survey)
    if not found.rows:
        say(_NOTHING_COMPARED, err=True)


def _print_errors(title: str, rows: list[ErrorRow]) -> None:
    from vislam2tag.quality.evaluation.text import HEADS

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
    """Write a figure, its interval only where asked: a terminal is narrow, the files have them all."""
    from vislam2tag.quality.evaluation.record import FigureWithInterval
    from vislam2tag.quality.evaluation.text import figure_text

    return figure_text(figure if with_interval else FigureWithInterval(value=figure.value))


def _print_strategies(found: SurveyEvaluation) -> None:
    """What each strategy keeps, and, with dense truth, how its error grows with the distance walked."""
    heads = ["kept of what local labels", *(["error grows since the last landmark"] if found.drift else [])]
    rows = []
    for name in found.strategies:
        kept, slope = found.retention[name], found.drift.get(name)
        cells = ["-" if kept is None else f"{100 * kept:.0f} %", "-" if slope is None else f"{100 * slope:.2f} cm/m"]
        rows.append((name, *cells[: len(heads)]))
    print_table("Strategies", ("strategy",), heads, rows, pipe_width=_PIPE_WIDTH)
