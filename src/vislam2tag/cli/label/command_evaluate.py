"""``vislam2tag evaluate``."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.interrupted import interrupted_with
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Devices,
    Floors,
    Jobs,
    LandmarkFile,
    SurveyFolder,
    selection_of,
)
from vislam2tag.cli.progress import SessionBar, session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json, visible_console
from vislam2tag.common.plugins import STRATEGIES

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.evaluation.record import ErrorRow, FigureWithInterval, SessionEvaluation, SurveyEvaluation

_PIPE_WIDTH = 160
"""Columns of the tables where the output is no terminal."""
HELP = """
Evaluate: how good are the labels, against every kind of truth?

Every session is mapped by each strategy and compared with what there is: presses at control points, a total station's
track, a truth of the whole walk (truth.csv, .tum, .euroc or .kitti in the session's folder, or --truth). Writes
OUT/errors.csv, errors.tex, sessions.csv, dense.csv, evaluation.json, report.html and OUT/trajectories (TUM files, which
evo reads). docs/how-to/evaluate.md tells what each figure is. Truth is never used to map.

Exit code: 0 all right (odd control points are named and no failure), 1 at least one session cannot be read or mapped,
or none compared, 2 wrong usage, not a survey, no truth, or OUT cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag evaluate survey --out evaluated
  vislam2tag evaluate survey --out evaluated --strategy smoother \\
      --strategy local --floor 1
  vislam2tag evaluate survey --out evaluated --truth mocap --max-sigma-m inf
"""


def _there(out: Path) -> str:
    from vislam2tag.pipeline.labels.evaluate import RECORD_FILE

    return f"{out} contains {'an' if (out / RECORD_FILE).is_file() else 'no'} evaluation"


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("evaluate", help=HELP)(_evaluate)


def _evaluate(
    survey: SurveyFolder,
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier evaluation.")],
    strategy: Annotated[
        list[str] | None,
        typer.Option(help=f"Only this strategy; repeatable. There are: {', '.join(STRATEGIES.names())}."),
    ] = None,
    landmarks: LandmarkFile = None,
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Take truth of the whole walk from FOLDER/SLUG.csv, .tum, .euroc or .kitti, not from the sessions.",
        ),
    ] = None,
    clock_drift: Annotated[
        bool, typer.Option("--clock-drift", help="Let a total station's clock run at another rate than the phone's.")
    ] = False,
    floor: Floors = None,
    device: Devices = None,
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
    max_sigma_m: Annotated[float | None, setting("labels.max_sigma_m")] = None,
    max_step_m: Annotated[float | None, setting("mapping.max_step_m")] = None,
    use_planned: Annotated[bool | None, setting("survey.use_planned")] = None,
) -> None:
    from vislam2tag.pipeline.labels.evaluate import PAGE_FILE, evaluate

    given = {
        "labels.max_sigma_m": max_sigma_m,
        "mapping.max_step_m": max_step_m,
        "survey.use_planned": use_planned,
    }
    settings = settings_of(config, given, survey)
    with interrupted_with(lambda: _there(out)), session_bar("walks") as bar:
        found = evaluate(
            survey,
            out,
            settings,
            strategies=strategy or (),
            landmarks=landmarks,
            truth=truth,
            clock_drift=clock_drift,
            selection=selection_of(floor, device),
            jobs=jobs,
            progress=lambda session, total: _advance(bar, session, total),
            tell=print_warnings,
        )
    if json:
        say_json(found)
    else:
        _print(found)
        for odd in found.odd_points:
            say(f"odd one out: {odd.summary}")
        say(f"control points: {found.judgement.sentence}")
        say(f"page: {out / PAGE_FILE}")
        next_step("evaluate, failed" if found.failed or not found.rows else "evaluate", survey=survey)
    if not found.rows:
        say("no session could be compared with any truth", err=True)
    raise typer.Exit(1 if found.failed or not found.rows else 0)


def _advance(bar: SessionBar, session: SessionEvaluation, total: int) -> None:
    bar.advance(total, session.error)
    for reason in session.missing:
        bar.print_line("no truth", "yellow", f"floor {session.floor} / {session.device} / {session.session}: {reason}")


def _print(found: SurveyEvaluation) -> None:

    from vislam2tag.evaluation.pooling import ALL, OVER_WALKS
    from vislam2tag.evaluation.text import truth_name

    console = visible_console(highlight=False)
    if not console.is_terminal:
        console = visible_console(highlight=False, width=_PIPE_WIDTH)
    shown = [row for row in found.rows if row.group == ALL and row.over == OVER_WALKS]
    for (truth, method), rows in groupby(shown, key=lambda row: (row.truth, row.method)):
        console.print(_error_table(truth_name(truth, method), list(rows)))
    console.print(_strategy_table(found))
    console.print("over points, by floor and device, and each session: in the files and the page")
    console.print(f"sessions: {len(found.sessions)} ({found.failed} failed)")


def _error_table(title: str, rows: list[ErrorRow]) -> Table:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    from vislam2tag.evaluation.text import HEADS

    table = Table(title=f"Error at {title}, over walks, metres", title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("trajectories", "strategy"):
        table.add_column(name)
    for name in ("walks", "labelled", *HEADS.values()):
        table.add_column(name, justify="right")
    for _, same in groupby(sorted(rows, key=lambda row: row.selection), key=lambda row: row.selection):
        for row in same:
            share = "-" if row.labelled.value is None else f"{100 * row.labelled.value:.0f} %"
            figures = (_cell(getattr(row, name), with_interval=name == "mean_m") for name in HEADS)
            table.add_row(row.selection, escape(row.strategy), str(row.walks), share, *figures)
        table.add_section()
    return table


def _cell(figure: FigureWithInterval, *, with_interval: bool) -> str:
    """Write a figure, its interval only where asked: a terminal is narrow, the files have them all."""
    from rich.markup import escape

    from vislam2tag.evaluation.record import FigureWithInterval
    from vislam2tag.evaluation.text import figure_text

    return escape(figure_text(figure if with_interval else FigureWithInterval(value=figure.value)))


def _strategy_table(found: SurveyEvaluation) -> Table:
    """What each strategy keeps, and, with dense truth, how its error grows with the distance walked."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="Strategies", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("strategy")
    table.add_column("kept of what local labels", justify="right")
    if found.drift:
        table.add_column("error grows since the last landmark", justify="right")
    for name in found.strategies:
        kept, slope = found.retention[name], found.drift.get(name)
        cells = ["-" if kept is None else f"{100 * kept:.0f} %"]
        if found.drift:
            cells.append("-" if slope is None else f"{100 * slope:.2f} cm/m")
        table.add_row(escape(name), *cells)
    return table
