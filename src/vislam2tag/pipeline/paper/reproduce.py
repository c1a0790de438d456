"""Reproduces the paper's tables and figures from data in the published layout."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from vislam2tag import __version__
from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.common.progress import Progress, Stage, silent
from vislam2tag.common.tabular import TabularResult
from vislam2tag.datasets.folder import is_dataset, open_dataset
from vislam2tag.datasets.statistics_record import (
    PAPER_FINGERPRINTS,
    DatasetStatistics,
    Table3,
    table_3_csv,
    table_3_latex,
    table_3_markdown,
)
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.paper.data import PaperWalks, open_paper_data, paper_collection, paper_walks
from vislam2tag.pipeline.paper.figures import FIGURES, NO_COLLECTION, PaperFigure, PaperResults
from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan, benchmark, write_table_4
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import refuse_among_sessions
from vislam2tag.positioning.benchmark import published_choices
from vislam2tag.positioning.benchmark_tables import TABLE_4_SPLITS, table_4
from vislam2tag.quality.evaluation.paper import (
    STRATEGIES,
    PaperTable,
    PaperWalk,
    WalkErrors,
    csv_text,
    labelled_shares,
    latex_text,
    markdown_text,
    table_1,
    table_2,
    walks_csv,
)
from vislam2tag.views.panels import name_of, rendered
from vislam2tag.views.result_pages import CollectionPart, FigurePart, PositioningPart, TablePart, write_paper_page

PROGRAM = "vislam2tag paper"
PAGE_FILE, WALKS_FILE, TABLE_3, TABLE_4 = "index.html", "walks.csv", "table_3", "table_4"
POSITIONING_FOLDER = "positioning"
"""Folder of the benchmark in the output; its runs are not repeated."""
_TEXTS, _PICTURES = ("csv", "tex", "md"), ("svg", "pdf")
_OWN = OwnFiles.of(
    (
        PAGE_FILE,
        WALKS_FILE,
        *(f"{table}.{kind}" for table in ("table_1", "table_2", TABLE_3, TABLE_4) for kind in _TEXTS),
        *(f"{figure.stem}.{kind}" for figure in FIGURES for kind in _PICTURES),
        f"{POSITIONING_FOLDER}/{OWN_FILES}",
    )
)
NAMES = {name: name_of(name) for name in STRATEGIES}


@dataclass(frozen=True, repr=False)
class ReproducedPaper(TabularResult):
    """Results of a reproduction, and its failures."""

    main_table: ClassVar[str] = "tables"

    tables: list[TablePart]
    collection: CollectionPart
    positioning: PositioningPart
    figures: list[FigurePart]
    failed: list[str]
    """One sentence for each session or phone that could not be evaluated."""


def reproduce(
    root: AnyPath,
    out: AnyPath,
    settings: ProcessSettings | None = None,
    progress: Progress[Stage] = silent,
    model_seeds: int | None = None,
) -> ReproducedPaper:
    """Write the paper's tables and figures from the surveys in ``root`` and below to ``out``.

    Writes each table as CSV, LaTeX and Markdown, each figure as SVG and PDF, every walk's errors (``walks.csv``), and
    ``index.html`` with everything, which also lists missing parts. With ``model_seeds`` the paper's networks are
    trained that often on the collecting walks for Table IV, which takes most of the time. Raises SurveyError if
    ``root`` contains no survey, UsageError for ``model_seeds`` without PyTorch, OutputError if ``out`` cannot be
    written.
    """
    root, out = Path(root), Path(out)
    refuse_without_networks(model_seeds)
    settings = settings or ProcessSettings()
    data = open_paper_data(root)
    for survey in data.surveys:
        refuse_among_sessions(survey, out)
    run: dict[str, object] = {"version": __version__, "settings": settings.of_labels()}
    with claim(out, run, PROGRAM, _OWN) as folder, scratch_folder() as scratch:
        fingerprints = None if model_seeds is None else scratch / "giaIndoorLoc"
        walks = paper_walks(data, settings, _of_stage(progress, "walks"))
        tables = _tables(walks)
        for part in tables:
            _write_table(folder, part)
        folder.put_text(WALKS_FILE, walks_csv([*walks.pressed, *walks.tracked]))
        collected = paper_collection(data, settings, _of_stage(progress, "fingerprints"), fingerprints)
        collection = _collection(folder, collected.statistics)
        positioning = paper_positioning(folder, fingerprints, model_seeds, progress)
        failed = [*walks.failed, *collected.failed, *positioning.failed]
        figures = _figures(folder, PaperResults(data, walks, settings, collected.statistics), progress)
        made = ReproducedPaper(tables, collection, positioning, figures, failed)
        folder.write(PAGE_FILE, lambda path: _write_page(path, root.resolve().name, made))
    return made


def _of_stage(progress: Progress[Stage], name: str) -> Progress[int]:
    return lambda done, total: progress(Stage(name, done), total)


def _write_page(path: Path, title: str, made: ReproducedPaper) -> None:
    tables = made.tables, made.collection, made.positioning
    write_paper_page(path, title, NAMES, *tables, made.figures, made.failed)


def _tables(walks: PaperWalks) -> list[TablePart]:
    return [
        _table("table_1", table_1, walks.pressed, "over control points"),
        _table("table_2", table_2, walks.tracked, "before a total station"),
    ]


def _table(
    stem: str, tabulate: Callable[[Sequence[WalkErrors], Sequence[str]], PaperTable], walks: list[PaperWalk], which: str
) -> TablePart:
    table = tabulate([walk.errors for walk in walks], STRATEGIES)
    return TablePart(stem, table, labelled_shares(walks), "" if walks else f"The data contains no walk {which}.")


def _write_table(folder: OutputFolder, part: TablePart) -> None:
    texts = {"csv": csv_text(part.table), "tex": latex_text(part.table, NAMES), "md": markdown_text(part.table, NAMES)}
    for suffix, text in texts.items():
        if not part.missing:
            folder.put_text(f"{part.stem}.{suffix}", text)


def _collection(folder: OutputFolder, statistics: DatasetStatistics | None) -> CollectionPart:
    """Write Table III and a sentence about fingerprints per person-hour."""
    if statistics is None:
        return CollectionPart(TABLE_3, None, missing=f"{NO_COLLECTION.capitalize()}.")
    table = Table3.of(statistics.by_device, statistics.walks, beside_paper=True)
    for suffix, text_of in {"csv": table_3_csv, "tex": table_3_latex, "md": table_3_markdown}.items():
        folder.put_text(f"{TABLE_3}.{suffix}", text_of(table))
    wifi = statistics.technologies["wifi"]
    cost = wifi.labelled_per_person_hour
    rate = "" if cost is None else f", {cost:.0f} per hour of walking"
    sentence = (
        f"{wifi.labels.labelled} labelled fingerprints{rate}. The paper's set has {PAPER_FINGERPRINTS}, from two "
        "people in less than two hours including setup, which is over 512 per person-hour. Velocity is distance over "
        "duration; the paper's velocities exceed its own distance over duration, which is 0.64 to 0.80 m/s."
    )
    return CollectionPart(TABLE_3, table, sentence)


def _figures(folder: OutputFolder, results: PaperResults, progress: Progress[Stage]) -> list[FigurePart]:
    figures = []
    for number, figure in enumerate(FIGURES, 1):
        figures.append(_figure(folder, figure, results))
        progress(Stage("figures", number), len(FIGURES))
    return figures


def _figure(folder: OutputFolder, figure: PaperFigure, results: PaperResults) -> FigurePart:
    try:
        drawn = figure.draw(results)
    except Vislam2tagError as error:
        return FigurePart(figure.stem, figure.title, figure.about, missing=str(error))
    files = {kind: rendered(drawn, kind) for kind in _PICTURES}
    for kind, content in files.items():
        folder.write(f"{figure.stem}.{kind}", partial(write_file, content=content))
    return FigurePart(figure.stem, figure.title, figure.about, svg=files["svg"], width_in=drawn.get_figwidth())


def refuse_without_networks(seeds: int | None) -> None:
    """Raise UsageError before the work if networks are requested and PyTorch is not installed."""
    if seeds is not None:
        for choice in published_choices():
            choice.made(None)


def paper_positioning(
    folder: OutputFolder, fingerprints: Path | None, seeds: int | None, progress: Progress[Stage]
) -> PositioningPart:
    """Train and test on the data set in ``fingerprints``, and write Table IV (without ``seeds``: how to get it)."""
    if fingerprints is None or seeds is None:
        return PositioningPart(TABLE_4, None, "Use --models to train the paper's networks.")
    if not is_dataset(fingerprints):
        return PositioningPart(TABLE_4, None, "The data contains no walk for collecting fingerprints.")
    dataset = open_dataset(fingerprints)
    splits = [name for name in TABLE_4_SPLITS if name in dataset.splits]
    if not splits:
        return PositioningPart(TABLE_4, None, "There are too few fingerprints for a test set.")
    plan = BenchmarkPlan(list(published_choices()), splits, seeds, beside_paper=True)
    found = benchmark(dataset, folder.root / POSITIONING_FOLDER, plan, progress)
    table = table_4(found.rows)
    write_table_4(folder, table)
    failed = tuple(f"{one.run}: {one.error}" for one in found.failed)
    return PositioningPart(TABLE_4, table, failed=failed)
