"""Commands that compare models and repeat the paper: ``benchmark`` and ``paper``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, Technology, value_of
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table, print_table_4
from vislam2tag.cli.terminal import answer, print_line, say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.plugins import MODELS

if TYPE_CHECKING:
    from vislam2tag.positioning.benchmark import BestModel
    from vislam2tag.views.result_pages import CollectionPart, PositioningPart, TablePart


_SHOWN = ("floor_hit", "mean_m", "median_m", "p75_m", "p95_m", "ipin_m", "inside_68", "inside_95")


@dataclass(frozen=True, kw_only=True)
class BenchmarkOptions:
    """Arguments and options of ``vislam2tag benchmark``."""

    folder: Path | None = argument("Data set; or give --dataset and --data.", None, metavar="[DS]")
    out: Path = option(..., "Output folder: new, empty or from an earlier benchmark.")
    model: tuple[str, ...] = option((), "Model to run; repeatable.")
    set_: tuple[str, ...] = option((), "A model's parameter; repeatable.", "--set", metavar="MODEL.PARAMETER=VALUE")
    split: tuple[str, ...] = option(
        (), "Split of the data set; repeatable. Default: official where there is one, else random."
    )
    seeds: int = option(5, "Runs of each model that draws random numbers.", least=1)
    technology: Technology = "wifi"
    paper: bool = option(
        False, "The paper's models, as published for this data set; of DS on the paper's splits, as its Table IV."
    )
    dataset: str | None = option(
        None, "A public data set: tampere, ujiindoorloc, utsindoorloc, wifine, uji-library.", metavar="NAME"
    )
    data: Path | None = option(None, "Folder or archive of --dataset.", metavar="FILES")
    json: AsJson = False


@command
def benchmark_command(given: BenchmarkOptions) -> None:
    """Benchmark positioning models on a data set: train, test, score, compare.

    Each model is trained on the training part of each fold, with each seed, and tested on the rest; everything is
    learned from the training part. Writes OUT/scores.csv, scores.tex, times.csv, benchmark.json, report.html, figures/
    (SVG, PDF) and runs/ with the record and the predictions of every run. docs/how-to/benchmark.md tells what each
    figure is. Stop it at any moment and give the same command again: runs that are done are not repeated.

    Models: {models}.

    Exit code: 0 all right, 1 at least one run failed, 2 wrong usage, no data set, files that are not of the public set,
    or OUT cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag benchmark fingerprints --model weighted-knn --model multi-cel \\
          --split random --split device --out compared
      vislam2tag benchmark fingerprints --model multi-cel \\
          --set multi-cel.cell_m=5 --seeds 3 --out fine_cells
      vislam2tag benchmark fingerprints --paper --out table_4
      vislam2tag benchmark --dataset tampere --data tampere-2017-08-21.tar.xz \\
          --model weighted-knn --out tampere
    """
    from vislam2tag.positioning.benchmark import published_choices
    from vislam2tag.positioning.benchmark_tables import TABLE_4_SPLITS

    chosen = list(published_choices(given.dataset)) if given.paper else []
    chosen = with_parameters(_with_models(chosen, given.model), given.set_)
    if not chosen:
        raise UsageError(f"--model: name at least one; there are: {', '.join(MODELS.names())}")
    table_wanted = given.paper and given.dataset is None
    splits = given.split or (TABLE_4_SPLITS if table_wanted else ())
    plan = api.BenchmarkPlan(chosen, splits, given.seeds, given.technology, table_wanted)
    with (
        interrupted_with(lambda: _there(given.out)),
        _opened(given) as opened,
        session_bar("reading", share=True) as bar,
    ):
        found = api.benchmark(opened, given.out, plan, bar.show)
    answer(found, given.json, lambda: _print_benchmark(found, given, table_wanted), failed=bool(found.failed))


def _there(out: Path) -> str:
    from vislam2tag.pipeline.positioning.benchmark import RUNS

    count = len(list(out.glob(f"{RUNS}/*.json")))
    return f"{out} contains {count} runs; the same command goes on" if count else f"no run was finished in {out}"


def _with_models(chosen: Sequence[api.ModelChoice], names: Sequence[str]) -> list[api.ModelChoice]:
    there = {one.name: one for one in chosen}
    return list((there | {name: api.ModelChoice(name) for name in names if name not in there}).values())


def with_parameters(chosen: Sequence[api.ModelChoice], texts: Sequence[str]) -> list[api.ModelChoice]:
    """Set ``MODEL.PARAMETER=VALUE``: numbers, true, false, null and lists as JSON has them, else text.

    Raises UsageError for what is not of this form, and for models that are not chosen.
    """
    parameters: dict[str, dict[str, Any]] = {one.name: dict(one.parameters) for one in chosen}
    for text in texts:
        place, equals, value = text.partition("=")
        name, dot, parameter = place.partition(".")
        if not (equals and dot and parameter):
            raise UsageError(f"--set {text}: give MODEL.PARAMETER=VALUE, such as weighted-knn.k=5")
        if name not in parameters:
            raise UsageError(f"--set {text}: '{name}' is none of the models to run: {', '.join(parameters)}")
        parameters[name][parameter] = value_of(value)
    return [api.ModelChoice(name, own) for name, own in parameters.items()]


@contextmanager
def _opened(given: BenchmarkOptions) -> Iterator[api.Dataset]:
    """Open DS, or the public data set from its files."""
    folder, dataset, data = given.folder, given.dataset, given.data
    if folder is not None and dataset is None and data is None:
        yield api.open_dataset(folder)
    elif folder is None and dataset is not None and data is not None:
        with api.public_dataset(dataset, data) as opened:
            yield opened
    else:
        raise UsageError("give either DS, or --dataset NAME with --data FILES")


def _tell_next(found: api.Benchmark, out: Path, folder: Path | None) -> None:
    """Go on with the model that the page recommends for the first split."""
    from vislam2tag.pipeline.positioning.benchmark import PAGE_FILE

    if found.failed or not found.best:
        next_step("benchmark, failed")
    elif folder is None:
        next_step("benchmark, public", page=out / PAGE_FILE)
    else:
        next_step("benchmark", dataset=folder, model=found.best[0].model)


def _said_of(best: BestModel) -> str:
    """Name the winner, and how far behind the next one is."""
    said = f"best on split {best.split}: {best.model}, {best.mean_m:.2f} m"
    if best.runner_up is None:
        return said
    said += f"; {best.runner_up} errs {best.behind_m:.2f} m more"
    if best.behind_interval_m is None:
        return f"{said} (too few walks for an interval)"
    low, high = best.behind_interval_m
    return f"{said} (95 % interval over walks: {low:.2f} to {high:.2f} m)"


def _print_benchmark(found: api.Benchmark, given: BenchmarkOptions, beside_paper: bool) -> None:
    from vislam2tag.pipeline.positioning.benchmark import PAGE_FILE
    from vislam2tag.positioning.benchmark_tables import HEADS, figure_text, fold_name, table_4

    for split, rows in groupby(found.rows, key=lambda row: row.split):
        cells = (
            (fold_name(row.fold), row.model, *(figure_text(name, row.figures[name]) for name in _SHOWN)) for row in rows
        )
        print_table(f"Split {split}", ("test", "model"), tuple(HEADS[name] for name in _SHOWN), cells)
    for best in found.best:
        say(_said_of(best))
    if beside_paper:
        print_table_4(table_4(found.rows))
    for one in found.failed:
        print_line("failed:", "red", f"{one.run}: {one.error}")
    say(f"page: {given.out / PAGE_FILE}")
    _tell_next(found, given.out, given.folder)


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
    with session_bar("walks") as bar:
        made = api.paper(data, out, progress=bar.show, model_seeds=seeds if models else None)
    answer(made, json, lambda: _print_paper(made, out), failed=bool(made.failed))


def _print_paper(made: api.ReproducedPaper, out: Path) -> None:
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
    from vislam2tag.quality.evaluation.paper import figures_in, heads_of

    if part.missing:
        say(f"{part.table.title}: {part.missing}")
        return
    heads = [head for cell in part.table.rows[0].cells for head in heads_of(cell, NAMES[cell.strategy])]
    rows = ((row.selection, row.metric, *figures_in(row)) for row in part.table.rows)
    print_table(part.table.title, ("trajectories", "metric"), heads, rows)
    say(f"labelled: {part.shares(NAMES)}")
