"""``vislam2tag demo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, Jobs
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.settings import Settings

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.quality.evaluation.metrics import ErrorSummary


@command
def demo_command(
    *,
    out: Path = argument("New folder, or that of an earlier demonstration.", Path("vislam2tag-demo")),
    seed: int = option(1, "Another seed, another building and other walks."),
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
) -> None:
    """Simulate a survey, label it with each strategy, score the labels against the truth.

    Leaves OUT/survey (raw files as a phone writes them), OUT/STRATEGY (labels and report.html of each strategy) and
    OUT/scores.csv.

    \b
    Examples:
      vislam2tag demo
      vislam2tag demo somewhere --seed 7
    """
    from vislam2tag.pipeline.demo import run_demo

    scores = run_demo(out, jobs=jobs, seed=seed, say=lambda line: say(line, err=json))
    answer(scores, json, lambda: _print(scores, out))


def _print(scores: dict[str, ErrorSummary], out: Path) -> None:
    from vislam2tag.pipeline.demo import SURVEY

    visible_console().print(_table(scores))
    say(f"survey as a phone writes it: {out / SURVEY}")
    say(f"report of every walk, to open in a browser: {out / Settings().strategy / 'report.html'}")
    next_step("demo", survey=out / SURVEY)


def _table(scores: dict[str, ErrorSummary]) -> Table:
    from rich.table import Table

    table = Table(title="Label error at every camera frame (each walk counts once)")
    table.add_column("strategy")
    for column in ("mean", "median", "p75", "p95", "max"):
        table.add_column(f"{column} [m]", justify="right")
    table.add_column("labelled", justify="right")
    for strategy, errors in scores.items():
        figures = (errors.mean_m, errors.median_m, errors.p75_m, errors.p95_m, errors.max_m)
        table.add_row(strategy, *(f"{figure:.2f}" for figure in figures), f"{100 * errors.labelled_share:.0f} %")
    return table
