"""All figures of a data set, by the stems of their files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from matplotlib.figure import Figure

from vislam2tag.datasets.coverage import coverage, gap_walks
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import DatasetStatistics
from vislam2tag.figures.coverage_figures import CoveredFloor, coverage_map
from vislam2tag.figures.dataset_figures import (
    access_points_heard,
    fingerprints_by_device_and_floor,
    fingerprints_over_time,
    rssi_by_device,
    sigma_distribution,
)


def covered_floors(
    dataset: Dataset,
    technology: str,
    settings: CoverageSettings,
    starts: Mapping[Storey, tuple[float, float]],
) -> list[CoveredFloor]:
    """Count the cells of every floor and plan the walks that fill its gaps, from its place of ``starts`` if given."""
    return [
        CoveredFloor(
            title=_title(covered.storey),
            floor=dataset.site_floor(covered.storey),
            coverage=covered,
            walks=gap_walks(covered, settings.radius_m, starts.get(covered.storey)),
        )
        for covered in coverage(dataset, technology, settings)
    ]


def dataset_figures(statistics: DatasetStatistics, floors: Sequence[CoveredFloor]) -> Iterator[tuple[str, Figure]]:
    """Yield the figures that there is data for: of Wi-Fi, else of the technology with most fingerprints."""
    if floors:
        yield "coverage", coverage_map(floors)
    if statistics.main is None:
        return
    name, technology = statistics.main
    yield "fingerprints", fingerprints_by_device_and_floor(technology)
    yield "access_points", access_points_heard(technology.heard)
    if technology.rssi:
        yield "rssi", rssi_by_device(technology.rssi)
    if technology.sigma is not None:
        yield "sigma", sigma_distribution(technology.sigma)
    if any(walk.started for walk in statistics.sessions):
        yield "over_time", fingerprints_over_time(statistics.sessions, name)


def _title(storey: Storey) -> str:
    building, number = storey
    return f"{building}, floor {number}" if building else f"Floor {number}"
