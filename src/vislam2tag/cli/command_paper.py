"""``vislam2tag paper``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table, print_table_4
from vislam2tag.cli.terminal import answer, print_line, say

if TYPE_CHECKING:
    from vislam2tag.pipeline.paper.reproduce import ReproducedPaper
    from vislam2tag.views.result_pages import CollectionPart, PositioningPart, TablePart


@command
def paper_command(
    *,
    data: Path = argument("Folder with the published surveys, or one of them."),
    out: Path = option(..., "Output folder: new, empty or from an earlier run of this command."),
    models: bool = option(False, "Train the paper's networks, too, for Table IV."),
    seeds: int = option(5, "With --models: how often each network is trained.", least=1),
    json: AsJson = False,
) -> None:
    """Make the paper's tables and figures (VI-SLAM2tag, Laska et al., IPIN 2022) from its data, beside the paper's
    figures.

    DATA holds the published surveys in their layout (evaluation_data, giaIndoorLoc_raw), or is one of them. Made are
    Tables I to III (CSV, LaTeX, Markdown), Figures 1 to 9 (SVG, PDF), some that the paper does not have, walks.csv with
    every walk's errors, and index.html with everything. What DATA lacks is named there. With --models the paper's
    networks are trained on the walks that collect, and Table IV is made (needs PyTorch; takes far longer than all
    else).

    Exit code: 0 all right (parts may be missing for want of data), 1 at least one session cannot be evaluated, 2 wrong
    usage, no survey, or OUT cannot be written.

    \b
    Examples:
      vislam2tag paper evaluation_data --out reproduced
      vislam2tag paper published --out reproduced --models --seeds 3
      vislam2tag simulate copy --like paper && vislam2tag paper copy \\
          --out reproduced
    """
    from vislam2tag.pipeline.paper.reproduce import reproduce

    with session_bar("walks") as bar:
        made = reproduce(data, out, progress=bar.show, model_seeds=seeds if models else None)
    answer(made, json, lambda: _print(made, out), failed=bool(made.failed))


def _print(made: ReproducedPaper, out: Path) -> None:
    from vislam2tag.pipeline.paper.reproduce import PAGE_FILE

    for part in made.tables:
        _print_table(part)
    _print_collection(made.collection)
    _print_positioning(made.positioning)
    for figure in made.figures:
        if figure.missing:
            say(f"not drawn: {figure.title}: {figure.missing}")
    for sentence in made.failed:
        print_line("left out:", "red", sentence)
    drawn = sum(not figure.missing for figure in made.figures)
    say(f"{drawn} of {len(made.figures)} figures drawn")
    say(f"page: {out / PAGE_FILE}")
    next_step("paper", page=out / PAGE_FILE)


def _print_collection(part: CollectionPart) -> None:
    from vislam2tag.datasets.statistics_record import TABLE_3_TITLE

    if part.table is None:
        say(f"{TABLE_3_TITLE}: {part.missing}")
        return
    rows = ((device, *texts) for device, texts in part.table.texts())
    print_table(TABLE_3_TITLE, ("device",), part.table.heads, rows)
    say(part.sentence)


def _print_positioning(part: PositioningPart) -> None:
    from vislam2tag.positioning.benchmark_tables import TABLE_4_TITLE

    if part.table is None:
        say(f"{TABLE_4_TITLE}: {part.missing}")
    else:
        print_table_4(part.table)


def _print_table(part: TablePart) -> None:
    from vislam2tag.pipeline.paper.reproduce import NAMES
    from vislam2tag.quality.evaluation.paper import figures_of, heads_of

    if part.missing:
        say(f"{part.table.title}: {part.missing}")
        return
    heads = [head for cell in part.table.rows[0].cells for head in heads_of(cell, NAMES[cell.strategy])]
    rows = (
        (row.selection, row.metric, *(figure for cell in row.cells for figure in figures_of(cell)))
        for row in part.table.rows
    )
    print_table(part.table.title, ("trajectories", "metric"), heads, rows)
    say(f"labelled: {part.shares(NAMES)}")
