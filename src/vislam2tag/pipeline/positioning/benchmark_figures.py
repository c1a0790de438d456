"""The figures of a benchmark, drawn from the predictions that its runs kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from vislam2tag.common.files.table_files import read_parquet
from vislam2tag.core.arrays import FloatArray
from vislam2tag.dataset.model import Dataset, Storey
from vislam2tag.figures.positioning_figures import (
    ErrorFloor,
    calibration,
    error_distributions_by_model,
    error_map,
    floor_confusion,
)
from vislam2tag.figures.style import rendered
from vislam2tag.positioning.benchmark_protocol import with_errors
from vislam2tag.positioning.benchmark_record import RunRecord
from vislam2tag.report.pages.paper_page import FigurePart
from vislam2tag.survey.names import unique_slugs

Drawn = tuple[FigurePart, dict[str, bytes]]
Predictions = Mapping[Path, RunRecord]
"""The file of each run's predictions."""
_ERRORS = "All scans that test, of all folds and seeds. A curve ends at the share that the model answered."
_CONFUSION = "In rows the true floor, in columns the found one; percent of the true floor's scans, all folds and seeds."
_CALIBRATION = (
    "Left: shares of true places within the stated radii, grey where they count as calibrated. Right: do errors grow "
    "with the radius? On the line they do as stated, above it they are larger. All folds and seeds."
)
_MAP = "Each scan where it was taken, joined to where the model put it (all folds, first seed)."


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
                f"floors.{slug}", f"Floors confused, split {split}", _CONFUSION, floor_confusion(storeys, counts)
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
    """Names of the storeys (s), in order, and by model how many scans of each are found on each (s, s)."""
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
    return [_storey_name(building, floor) for building, floor in storeys], counts


def _floors(dataset: Dataset, table: pl.DataFrame) -> Sequence[ErrorFloor]:
    groups = table.partition_by("building", "floor", as_dict=True)
    return [
        ErrorFloor(_title(str(building), int(floor)), dataset.site_floor(Storey(str(building), int(floor))), part)
        for (building, floor), part in sorted(groups.items())
    ]


def _title(building: str, floor: int) -> str:
    return f"{building} floor {floor}".strip()


def _storey_name(building: str, floor: int) -> str:
    return f"{building} {floor}".strip()
