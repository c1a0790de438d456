"""Commands that compare models and reproduce the paper: ``benchmark`` and ``paper``."""

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

    folder: Path | None = argument("Data set. Or pass --dataset and --data.", None, metavar="[DS]")
    out: Path = option(..., "Output folder: new, empty or from an earlier benchmark.")
    model: tuple[str, ...] = option((), "Model to run; repeatable.")
    set_: tuple[str, ...] = option((), "Parameter of a model; repeatable.", "--set", metavar="MODEL.PARAMETER=VALUE")
    split: tuple[str, ...] = option(
        (), "Split of the data set; repeatable.  [default: official if it exists, else random]"
    )
    seeds: int = option(5, "Number of runs of each model with random numbers.", least=1)
    technology: Technology = None
    paper: bool = option(False, "Also run the paper's models for this data set, for DS on the splits of its Table IV.")
    dataset: str | None = option(
        None, "Public data set: tampere, ujiindoorloc, utsindoorloc, wifine, uji-library.", metavar="NAME"
    )
    data: Path | None = option(None, "Folder or archive of --dataset.", metavar="FILES")
    json: AsJson = False


@command
def benchmark_command(given: BenchmarkOptions) -> None:
    """Train, test and compare positioning models on a data set.

    Trains each model on the training part of each fold with each seed, and tests it on the test part. Writes
    OUT/scores.csv, scores.tex, times.csv, benchmark.json, report.html, figures/ (SVG, PDF) and runs/ with all
    predictions. docs/how-to/benchmark.md explains the figures. You can stop at any time: run the same command again to
    continue.

    Models: {models}.

    Exit code: 0 all runs finished, 1 a run failed, 2 wrong usage, no data set, or other files than those of the public
    set, 130 interrupted.

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
        raise UsageError(f"--model: pass at least one of {', '.join(MODELS.names())}")
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
    return (
        f"{out} contains {count} runs; run the same command again to continue"
        if count
        else f"no run was finished in {out}"
    )


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
            raise UsageError(f"--set {text}: expected MODEL.PARAMETER=VALUE, such as weighted-knn.k=5")
        if name not in parameters:
            raise UsageError(f"--set {text}: '{name}' is not among the models to run: {', '.join(parameters)}")
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
        raise UsageError("pass either DS, or --dataset NAME with --data FILES")


def _print_next(found: api.Benchmark, out: Path, folder: Path | None) -> None:
    """Print the next step, with the best model of the first split."""
    from vislam2tag.pipeline.positioning.benchmark import PAGE_FILE

    if found.failed or not found.best:
        next_step("benchmark, failed")
    elif folder is None:
        next_step("benchmark, public", page=out / PAGE_FILE)
    else:
        next_step("benchmark", dataset=folder, model=found.best[0].model)


def _said_of(best: BestModel) -> str:
    """Name the best model and its lead."""
    said = f"best on split {best.split}: {best.model}, {best.mean_m:.2f} m"
    if best.runner_up is None:
        return said
    said += f"; the error of {best.runner_up} is {best.behind_m:.2f} m greater"
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
    _print_next(found, given.out, given.folder)


@command
def paper_command(
    *,
    data: Path = argument("Folder with the published surveys, or one survey."),
    out: Path = option(..., "Output folder: new, empty or from an earlier run of this command."),
    models: bool = option(False, "Also train the paper's networks, for Table IV."),
    seeds: int = option(5, "With --models: number of runs of each network.", least=1),
    json: AsJson = False,
) -> None:
    """Reproduce the tables and figures of the VI-SLAM2tag paper (Laska et al., IPIN 2022) from its data.

    DATA contains the published surveys (evaluation_data, giaIndoorLoc_raw), or is one of them. Writes Tables I to III
    (CSV, LaTeX, Markdown), Figures 1 to 9 (SVG, PDF), further figures, walks.csv with the errors of every walk, and
    index.html with the paper's values beside ours. The page names missing data. With --models the paper's networks are
    trained for Table IV. This needs PyTorch and takes far longer than the rest.

    Exit code: 0 written (parts without data are missing), 1 a session cannot be evaluated, 2 wrong usage or no survey,
    130 interrupted.

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
        print_line("skipped:", "red", sentence)
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
