"""Writes the figures of a data set, Table III and the walks that would fill its gaps to a folder."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from vislam2tag import __version__
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.common.progress import Progress, silent
from vislam2tag.datasets.coverage import CoverageRecord, floor_record
from vislam2tag.datasets.folder import open_dataset_to_share
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import Table3, table_3_csv, table_3_latex, table_3_markdown
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.views.dataset_figures import covered_floors, dataset_figures
from vislam2tag.views.panels import rendered

PROGRAM = "vislam2tag figures"
COVERAGE_FILE, TABLE = "coverage.json", "table_3"
KINDS = ("svg", "pdf")


def make_dataset_figures(
    root: AnyPath,
    out: AnyPath,
    settings: CoverageSettings | None = None,
    starts: Mapping[Storey, tuple[float, float]] | None = None,
    progress: Progress[str] = silent,
    *,
    follow_links: bool = False,
) -> CoverageRecord:
    """Write a data set's figures (SVG, PDF), Table III (CSV, Markdown, LaTeX) and ``coverage.json`` into ``out``.

    ``starts`` are the start positions (BCS, metres) of the walks that fill gaps, by building and floor.

    Raises DatasetError if ``root`` is not a data set, or has links to files outside it without ``follow_links``,
    UsageError for a start on an unknown floor, OutputError if ``out`` cannot be written.
    """
    root, out = Path(root), Path(out)
    dataset = open_dataset_to_share(root, follow_links=follow_links)
    settings, starts = settings or CoverageSettings(), _in_only_building(dataset, starts or {})
    statistics = dataset_statistics(dataset)
    technology = statistics.main[0] if statistics.main else "wifi"
    floors = covered_floors(dataset, technology, settings, starts)
    _refuse_unknown(starts, {floor.coverage.storey for floor in floors})
    record = CoverageRecord(
        settings=settings,
        technology=technology,
        floors=[floor_record(floor.coverage, floor.walks) for floor in floors],
    )
    table = Table3.of(statistics.by_device, statistics.walks)
    texts = {"csv": table_3_csv(table), "md": table_3_markdown(table), "tex": table_3_latex(table)}
    run: dict[str, object] = {"version": __version__, "settings": settings.model_dump(mode="json")}
    own = OwnFiles.of((COVERAGE_FILE, *(f"{TABLE}.{suffix}" for suffix in texts)))
    with claim(out, run, PROGRAM, own) as folder:
        folder.put_text(COVERAGE_FILE, record.model_dump_json(indent=1) + "\n")
        for suffix, text in texts.items():
            folder.put_text(f"{TABLE}.{suffix}", text)
        figures = dict(dataset_figures(statistics, floors))
        folder.add_own(*(f"{stem}.{kind}" for stem in figures for kind in KINDS))
        for stem, figure in figures.items():
            for kind in KINDS:
                folder.write(f"{stem}.{kind}", partial(_write, figure, kind))
            progress(stem, len(figures))
    return record


def _in_only_building(
    dataset: Dataset, starts: Mapping[Storey, tuple[float, float]]
) -> dict[Storey, tuple[float, float]]:
    """Complete starts without a building, if the data set has one building."""
    buildings = {floor.building for floor in dataset.info.floors}
    only = buildings.pop() if len(buildings) == 1 else ""
    return {Storey(storey.building or only, storey.floor): place for storey, place in starts.items()}


def _refuse_unknown(starts: Mapping[Storey, tuple[float, float]], storeys: set[Storey]) -> None:
    for storey in starts:
        if storey not in storeys:
            there = ", ".join(storey_text(one) for one in sorted(storeys)) or "none"
            raise UsageError(f"--start {storey_text(storey)}: this floor has no labels; floors with labels: {there}")


def storey_text(storey: Storey) -> str:
    """``BUILDING/FLOOR``, or the floor's number alone."""
    building, number = storey
    return f"{building}/{number}" if building else str(number)


def _write(figure: Figure, kind: str, path: Path) -> None:
    write_file(path, rendered(figure, kind))
