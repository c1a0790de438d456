"""The figures of a data set as files, and the paper's Table III beside them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure

from vislam2tag.dataset.coverage import coverage
from vislam2tag.dataset.floor_plan import floor_of
from vislam2tag.dataset.gap_walk import gap_walks
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.statistics_record import DatasetStatistics
from vislam2tag.dataset.table_3 import Table3, csv_text, latex_text, markdown_text
from vislam2tag.figures.coverage_figures import CoveredFloor, coverage_map
from vislam2tag.figures.dataset_figures import (
    access_points_heard,
    fingerprints_by_device_and_floor,
    fingerprints_over_time,
    rssi_by_device,
    sigma_distribution,
)
from vislam2tag.figures.style import rendered

KINDS = ("svg", "pdf")
TABLE = "table_3"


def write_dataset_figures(dataset: Dataset, statistics: DatasetStatistics, folder: Path) -> None:
    """Write each figure that the set has data for (SVG, PDF) and Table III (CSV, Markdown, LaTeX) into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    table = Table3.of(statistics.by_device, statistics.walks)
    texts = {"csv": csv_text(table), "md": markdown_text(table), "tex": latex_text(table)}
    for suffix, text in texts.items():
        (folder / f"{TABLE}.{suffix}").write_text(text, encoding="utf-8", newline="\n")
    for stem, figure in dataset_figures(dataset, statistics):
        for kind in KINDS:
            (folder / f"{stem}.{kind}").write_bytes(rendered(figure, kind))


def dataset_figures(dataset: Dataset, statistics: DatasetStatistics) -> Iterator[tuple[str, Figure]]:
    """Yield the figures by the stem of their files; those of Wi-Fi, else of the technology with most fingerprints."""
    if statistics.main is None:
        return
    name, technology = statistics.main
    yield "fingerprints", fingerprints_by_device_and_floor(technology)
    floors = [
        CoveredFloor(_title(covered.place), floor_of(dataset, *covered.place), covered, gap_walks(covered))
        for covered in coverage(dataset, name)
    ]
    if floors:
        yield "coverage", coverage_map(floors)
    yield "access_points", access_points_heard(technology.heard)
    if technology.rssi:
        yield "rssi", rssi_by_device(technology.rssi)
    if technology.sigma is not None:
        yield "sigma", sigma_distribution(technology.sigma)
    if any(walk.started for walk in statistics.sessions):
        yield "over_time", fingerprints_over_time(statistics.sessions, name)


def _title(place: tuple[str, int]) -> str:
    building, number = place
    return f"{building}, floor {number}" if building else f"Floor {number}"
