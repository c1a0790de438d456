"""``vislam2tag paper``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.tables import print_table_4, table, table_console
from vislam2tag.cli.terminal import say_json, visible_console

if TYPE_CHECKING:
    from vislam2tag.common.progress import Stage
    from vislam2tag.pipeline.paper.reproduce import ReproducedPaper
    from vislam2tag.views.result_pages import CollectionPart, PositioningPart, TablePart

HELP = """
Make the paper's tables and figures (VI-SLAM2tag, Laska et al., IPIN 2022) from its data, beside the paper's figures.

DATA holds the published surveys in their layout (evaluation_data, giaIndoorLoc_raw), or is one of them. Made are
Tables I to III (CSV, LaTeX, Markdown), Figures 1 to 9 (SVG, PDF), some that the paper does not have, walks.csv
with every walk's errors, and index.html with everything. What DATA lacks is named there. With --models the paper's
networks are trained on the walks that collect, and Table IV is made (needs PyTorch; takes far longer than all else).

Exit code: 0 all right (parts may be missing for want of data), 1 at least one session cannot be evaluated, 2 wrong
usage, no survey, or OUT cannot be written.

\b
Examples:
  vislam2tag paper evaluation_data --out reproduced
  vislam2tag paper published --out reproduced --models --seeds 3
  vislam2tag simulate copy --like paper && vislam2tag paper copy \\
      --out reproduced
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("paper", help=HELP)(_paper)


def _paper(
    data: Annotated[Path, typer.Argument(help="Folder with the published surveys, or one of them.")],
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run of this command.")],
    models: Annotated[bool, typer.Option("--models", help="Train the paper's networks, too, for Table IV.")] = False,
    seeds: Annotated[int, typer.Option(min=1, help="With --models: how often each network is trained.")] = 5,
    json: AsJson = False,
) -> None:
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from vislam2tag.pipeline.paper.reproduce import PAGE_FILE, reproduce

    console = visible_console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("walks", total=None)

        def advance(stage: Stage, total: int) -> None:
            bar.update(task, description=escape(stage.name), completed=stage.done, total=total)

        made = reproduce(data, out, progress=advance, model_seeds=seeds if models else None)
    if json:
        say_json(made)
    else:
        _print(made, out)
        next_step("paper", page=out / PAGE_FILE)
    raise typer.Exit(1 if made.failed else 0)


def _print(made: ReproducedPaper, out: Path) -> None:
    from rich.markup import escape

    from vislam2tag.pipeline.paper.reproduce import PAGE_FILE

    console = table_console()
    for part in made.tables:
        _print_table(part)
    _print_collection(made.collection)
    _print_positioning(made.positioning)
    for figure in made.figures:
        if figure.missing:
            console.print(f"not drawn: {escape(figure.title)}: {escape(figure.missing)}", soft_wrap=True)
    for sentence in made.failed:
        console.print(f"[red]left out:[/] {escape(sentence)}", soft_wrap=True)
    drawn = sum(not figure.missing for figure in made.figures)
    console.print(f"{drawn} of {len(made.figures)} figures drawn")
    console.print(f"page: {escape(str(out / PAGE_FILE))}", soft_wrap=True)


def _print_collection(part: CollectionPart) -> None:
    from rich.markup import escape

    from vislam2tag.dataset.statistics_record import TABLE_3_TITLE

    console = table_console()
    if part.table is None:
        console.print(f"{TABLE_3_TITLE}: {part.missing}", soft_wrap=True)
        return
    shown = table(TABLE_3_TITLE, ("device",), part.table.heads)
    for device, texts in part.table.texts():
        shown.add_row(escape(device), *texts)
    console.print(shown)
    console.print(part.sentence, soft_wrap=True)


def _print_positioning(part: PositioningPart) -> None:
    from vislam2tag.positioning.benchmark_tables import TABLE_4_TITLE as TITLE_4

    if part.table is None:
        table_console().print(f"{TITLE_4}: {part.missing}", soft_wrap=True)
    else:
        print_table_4(part.table)


def _print_table(part: TablePart) -> None:
    from vislam2tag.evaluation.paper.table_text import figures_of, heads_of
    from vislam2tag.pipeline.paper.reproduce import NAMES

    console = table_console()
    if part.missing:
        console.print(f"{part.table.title}: {part.missing}", soft_wrap=True)
        return
    heads = [head for cell in part.table.rows[0].cells for head in heads_of(cell, NAMES[cell.strategy])]
    shown = table(part.table.title, ("trajectories", "metric"), tuple(heads))
    for row in part.table.rows:
        shown.add_row(row.selection, row.metric, *(figure for cell in row.cells for figure in figures_of(cell)))
    console.print(shown)
    console.print(f"labelled: {part.shares(NAMES)}", soft_wrap=True)
