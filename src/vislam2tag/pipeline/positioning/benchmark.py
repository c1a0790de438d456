"""Benchmark of positioning models on a data set: runs, tables, figures and a page.

Results of finished runs are kept; figures are drawn from their predictions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
from matplotlib.figure import Figure
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, read_bytes
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.files.table_files import read_parquet, scan_parquet, write_parquet
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.common.progress import Progress, Stage, silent
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.model import Dataset, Split, Storey
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS
from vislam2tag.datasets.technologies import main_technology
from vislam2tag.pipeline.datasets.import_export import ImportOptions, import_format
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.keys import code_key
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.positioning.benchmark import (
    Benchmark,
    BenchmarkRun,
    FailedRun,
    ModelChoice,
    RunRecord,
    RunTime,
    benchmark_rows,
    execute,
    planned,
    predictions_table,
    with_errors,
)
from vislam2tag.positioning.benchmark_tables import (
    Table4,
    best_models,
    latex_text,
    model_times,
    paired_interval,
    rows_csv,
    table_4,
    times_csv,
)
from vislam2tag.positioning.learning_data import LearningData, learning_data
from vislam2tag.positioning.registry import model_modules
from vislam2tag.site.model import unique_slugs
from vislam2tag.views.panels import rendered
from vislam2tag.views.positioning_figures import (
    ErrorFloor,
    calibration,
    error_distributions_by_model,
    error_map,
    floor_confusion,
)
from vislam2tag.views.result_pages import FigurePart, write_benchmark_page

Drawn = tuple[FigurePart, dict[str, bytes]]
Predictions = Mapping[Path, RunRecord]
"""The file of each run's predictions."""
_ERRORS = "All test scans of all folds and seeds. A curve ends at the share that the model answered."
_CONFUSION = (
    "Rows: true floor; columns: predicted floor; percentages of the true floor's scans over all folds and seeds."
)
_CALIBRATION = (
    "Left: shares of true positions within the predicted radii; shares in the grey ranges count as calibrated. Right: "
    "errors by predicted radius; above the line they are larger than predicted. All folds and seeds."
)
_MAP = "Each scan at its true position, with a line to the predicted one (all folds, first seed)."


def benchmark_figures(dataset: Dataset, runs: Predictions) -> Iterator[Drawn]:
    """Draw for each split errors, calibration and confusion of floors by model, and each model's errors on the plan."""
    splits = list(dict.fromkeys(run.split for run in runs.values()))
    for split, slug in zip(splits, unique_slugs(splits), strict=True):
        here = {path: run for path, run in runs.items() if run.split == split}
        tables = {name: _read(here, name) for name in dict.fromkeys(run.model for run in here.values())}
        errors = {name: table["error_m"].fill_null(np.nan).to_numpy() for name, table in tables.items()}
        yield _part(f"errors.{slug}", f"Errors, split {split}", _ERRORS, error_distributions_by_model(errors))
        if any(table["radius_68_m"].count() for table in tables.values()):
            yield _part(f"calibration.{slug}", f"Calibration, split {split}", _CALIBRATION, calibration(tables))
        storeys, counts = _confusion(tables)
        if len(storeys) > 1:
            yield _part(
                f"floors.{slug}", f"Confused floors, split {split}", _CONFUSION, floor_confusion(storeys, counts)
            )
        for name, stem in zip(tables, unique_slugs(list(tables)), strict=True):
            floors = _floors(dataset, _read(here, name, first_seed=True))
            yield _part(f"map.{slug}.{stem}", f"Errors on the plan, split {split}, {name}", _MAP, error_map(floors))


def _read(runs: Predictions, model: str, *, first_seed: bool = False) -> pl.DataFrame:
    own = {path: run for path, run in runs.items() if run.model == model}
    first = next(iter(own.values())).seed
    paths = [path for path, run in own.items() if not first_seed or run.seed == first]
    return with_errors(pl.concat([read_parquet(path) for path in paths]))


def _part(stem: str, title: str, about: str, figure: Figure) -> Drawn:
    files = {kind: rendered(figure, kind) for kind in ("svg", "pdf")}
    return FigurePart(stem, title, about, svg=files["svg"], width_in=figure.get_figwidth()), files


def _confusion(tables: Mapping[str, pl.DataFrame]) -> tuple[list[str], dict[str, FloatArray]]:
    """Names of the storeys (s), in order, and by model the number of scans by true and predicted storey (s, s)."""
    pairs: dict[str, pl.DataFrame] = {}
    for name, table in tables.items():
        known = table.filter(pl.col("found_floor").is_not_null())
        pairs[name] = known.group_by("building", "floor", "found_building", "found_floor").len()
    storeys = sorted({place for pair in pairs.values() for row in pair.iter_rows() for place in (row[:2], row[2:4])})
    number = {storey: index for index, storey in enumerate(storeys)}
    counts = {name: np.zeros((len(storeys), len(storeys))) for name in pairs}
    for name, pair in pairs.items():
        for building, floor, found_building, found_floor, count in pair.iter_rows():
            counts[name][number[building, floor], number[found_building, found_floor]] = count
    return [f"{building} {floor}".strip() for building, floor in storeys], counts


def _floors(dataset: Dataset, table: pl.DataFrame) -> Sequence[ErrorFloor]:
    groups = table.partition_by("building", "floor", as_dict=True)
    return [
        ErrorFloor(f"{building} floor {floor}".strip(), dataset.site_floor(Storey(str(building), int(floor))), part)
        for (building, floor), part in sorted(groups.items())
    ]


PROGRAM = "vislam2tag benchmark"
RECORD_FILE, PAGE_FILE = "benchmark.json", "report.html"
SCORES_FILE, LATEX_FILE, TIMES_FILE, TABLE_4 = "scores.csv", "scores.tex", "times.csv", "table_4"
RUNS, TIMES, FIGURES = "runs", "times", "figures"
_TABLE_4_FILES = tuple(f"{TABLE_4}.{kind}" for kind in ("csv", "tex", "md"))
_OF_RUN = (RECORD_FILE, SCORES_FILE, LATEX_FILE, TIMES_FILE, *_TABLE_4_FILES)
PUBLIC = {
    "tampere": "tampere",
    "ujiindoorloc": "uji",
    "utsindoorloc": "uts",
    "wifine": "wifine",
    "uji-library": "uji-library",
}
"""Public data sets by name, and the formats that read them."""
_KEY_LETTERS = 12


@dataclass(frozen=True)
class BenchmarkPlan:
    """Models and options of a benchmark."""

    models: Sequence[ModelChoice]
    splits: Sequence[str] = ()
    """Names of the data set's splits; none: the official one, or otherwise ``random``."""
    seeds: int = 5
    technology: str | None = None
    """None: that of :func:`~vislam2tag.datasets.technologies.main_technology`."""
    beside_paper: bool = False
    """Whether to write the paper's Table IV."""


@contextmanager
def public_dataset(name: str, data: AnyPath) -> Iterator[Dataset]:
    """Open a public data set from its files, imported into a temporary folder.

    Raises UsageError for an unknown name, DatasetError for files that are missing, incomplete or of something else.
    """
    data = Path(data)
    if name not in PUBLIC:
        raise UsageError(f"--dataset {name}: unknown data set; choose one of {', '.join(PUBLIC)}")
    if not data.exists():
        raise DatasetError(
            f"{data}: no such file or folder; --data must be the folder with the published files of {name}"
        )
    with scratch_folder() as scratch:
        dataset = import_format(data, scratch / name, ImportOptions(format_name=PUBLIC[name]))
        split = _official(dataset)
        if split is None or any(part.is_empty() for fold in split.info.folds for part in split.train_test_ids(fold)):
            raise DatasetError(
                f"{data}: the folder contains only a part of {name}; put its training and test files together"
            )
        yield dataset


def benchmark(dataset: Dataset, out: AnyPath, plan: BenchmarkPlan, progress: Progress[Stage] = silent) -> Benchmark:
    """Do all runs that ``out`` does not contain yet, and write tables, figures, page and ``benchmark.json``.

    ``dataset`` is in a folder (:func:`~vislam2tag.datasets.folder.open_dataset`). Raises UsageError for a model,
    parameter or split that there is not, DatasetError if nothing is labelled, OutputError if ``out`` cannot be
    written; failed runs are in ``Benchmark.failed``.
    """
    out = Path(out)
    plan = replace(plan, technology=plan.technology or main_technology(dataset))
    splits = [split_named(dataset, name) for name in plan.splits or [_usual_split(dataset)]]
    runs = list(planned(plan.models, splits, plan.seeds))
    data = learning_data(dataset, plan.technology)
    with claim(out, _run_record(dataset, plan, splits), PROGRAM, OwnFiles.of((*_OF_RUN, PAGE_FILE))) as folder:
        folder.discard(*_OF_RUN, folders=(FIGURES,))  # summary files of an earlier benchmark; its runs stay
        made: dict[str, tuple[RunRecord, RunTime]] = {}
        failed: list[FailedRun] = []
        for number, run in enumerate(runs):
            progress(Stage(str(run), number), len(runs))
            try:
                stem, made_now = _made(folder, dataset, data, run, _within(run, number, len(runs), progress))
                made[stem] = made_now
            except (DatasetError, UsageError) as error:
                failed.append(FailedRun(run=str(run), error=str(error)))
        progress(Stage("figures", len(runs)), len(runs))
        predictions = {folder.root / RUNS / f"{stem}.parquet": record for stem, (record, _) in made.items()}
        found = _summed(dataset, plan, predictions, failed)
        table = table_4(found.rows) if plan.beside_paper else None
        if table is not None:
            write_table_4(folder, table)
        folder.put_text(SCORES_FILE, rows_csv(found.rows))
        folder.put_text(LATEX_FILE, latex_text(found.rows))
        folder.put_text(TIMES_FILE, times_csv(model_times(list(made.values()))))
        figures = list(_drawn(folder, dataset, predictions))
        folder.write(PAGE_FILE, lambda path: write_benchmark_page(path, found, figures, table))
        folder.put_text(RECORD_FILE, found.model_dump_json(indent=1) + "\n")  # last, as the mark of a complete output
    return found


def _within(run: BenchmarkRun, number: int, runs: int, progress: Progress[Stage]) -> Progress[float]:
    """Report a run's own steps as a part of one of all ``runs``."""
    return lambda done, steps: progress(Stage(str(run), number + min(done / steps, 1.0)), runs)


def split_named(dataset: Dataset, name: str) -> Split:
    """Return a split of the data set; raises UsageError if it has none of this name."""
    if name not in dataset.splits:
        there = ", ".join(dataset.splits) or "none"
        raise UsageError(
            f"--split {name}: {dataset.info.name} has no such split; it has: {there}. Create one with vislam2tag split"
        )
    return dataset.splits[name]


def _usual_split(dataset: Dataset) -> str:
    official = _official(dataset)
    return official.info.name if official else "random"


def _official(dataset: Dataset) -> Split | None:
    """Return the split that came with the data."""
    return next((split for split in dataset.splits.values() if split.info.kind == "official"), None)


def _run_record(dataset: Dataset, plan: BenchmarkPlan, splits: Sequence[Split]) -> dict[str, object]:
    return {
        "version": __version__,
        "dataset": dataset.info.name,
        "models": {model.name: dict(model.parameters) for model in plan.models},
        "splits": [split.info.name for split in splits],
        "seeds": plan.seeds,
        "technology": plan.technology,
    }


def _made(
    folder: OutputFolder, dataset: Dataset, data: LearningData, run: BenchmarkRun, progress: Progress[float]
) -> tuple[str, tuple[RunRecord, RunTime]]:
    """Return a run's name, record and time: the kept ones, or new ones, which are kept with the record last."""
    key = run.key(
        dataset, code_key(BenchmarkRun.__module__, predictions_table.__module__, *model_modules(run.model.name))
    )
    seed = "once" if run.seed is None else f"seed_{run.seed}"
    name = ".".join((run.model.name, run.split.info.name, run.fold, seed, key[:_KEY_LETTERS]))
    stem = unique_slugs([name])[0]
    kept = _kept(folder.root, stem, key)
    if kept is not None:
        return stem, kept
    record, time, table = execute(run, data, key, progress)
    folder.add_own(f"{TIMES}/{stem}.json", f"{RUNS}/{stem}.parquet", f"{RUNS}/{stem}.json")
    folder.put_text(f"{TIMES}/{stem}.json", time.model_dump_json(indent=1) + "\n")
    folder.write(
        f"{RUNS}/{stem}.parquet",
        lambda path: write_parquet(table, Folder.at(path.parent), path.name, compression="zstd"),
    )
    folder.put_text(f"{RUNS}/{stem}.json", record.model_dump_json(indent=1) + "\n")
    return stem, (record, time)


def _kept(root: Path, stem: str, key: str) -> tuple[RunRecord, RunTime] | None:
    try:
        record = RunRecord.model_validate_json(read_bytes(root / RUNS / f"{stem}.json"))
        time = RunTime.model_validate_json(read_bytes(root / TIMES / f"{stem}.json"))
        scan_parquet(root / RUNS / f"{stem}.parquet").collect_schema()
    except (OSError, ValidationError, pl.exceptions.PolarsError):
        return None
    return (record, time) if record.key == key else None


def _summed(dataset: Dataset, plan: BenchmarkPlan, made: Predictions, failed: Sequence[FailedRun]) -> Benchmark:
    runs = list(made.values())
    rows = benchmark_rows(runs)
    walks = dataset.fingerprints.select("scan_id", walk="session").collect()

    def errors(split: str, model: str) -> pl.DataFrame:
        own = {path: run for path, run in made.items() if (run.split, run.model) == (split, model)}
        tables = (with_errors(read_parquet(path)).with_columns(fold=pl.lit(run.fold)) for path, run in own.items())
        return pl.concat(tables).select("fold", "scan_id", "error_m").join(walks, on="scan_id", how="left")

    def behind(split: str, model: str, runner_up: str) -> tuple[float, float] | None:
        return paired_interval(errors(split, model), errors(split, runner_up))

    return Benchmark(
        version=__version__,
        dataset=dataset.info.name,
        data_sha256={name: dataset.info.tables[name].sha256 for name in (FINGERPRINTS, READINGS)},
        seeds=plan.seeds,
        rows=rows,
        runs=runs,
        failed=list(failed),
        best=best_models(rows, behind),
    )


def _drawn(folder: OutputFolder, dataset: Dataset, predictions: Predictions) -> Iterator[FigurePart]:
    """Write each figure, and yield it."""
    for figure, files in benchmark_figures(dataset, predictions):
        folder.add_own(*(f"{FIGURES}/{figure.stem}.{kind}" for kind in files))
        for kind, content in files.items():
            folder.write(f"{FIGURES}/{figure.stem}.{kind}", partial(write_file, content=content))
        yield figure


def write_table_4(folder: OutputFolder, table: Table4) -> None:
    """Write the paper's Table IV as CSV, LaTeX and Markdown."""
    for kind, text in table.texts().items():
        folder.put_text(f"{TABLE_4}.{kind}", text)
