"""The page of a data set: what it holds, where, how sure, how its splits leak, and what was odd about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import cycle
from types import MappingProxyType
from typing import Any

import polars as pl
from plotly.colors import qualitative

from vislam2tag import __version__
from vislam2tag.dataset.coverage import coverage
from vislam2tag.dataset.leakage import ALL_FOLDS, FoldLeakage, SplitLeakage, leakage
from vislam2tag.dataset.model import Dataset, Storey
from vislam2tag.dataset.settings import CoverageSettings
from vislam2tag.dataset.statistics_record import DatasetStatistics, Table3
from vislam2tag.figures.dataset_figures import PALETTE, colours_of
from vislam2tag.views.page import page_text
from vislam2tag.views.pages.dataset_charts import charts
from vislam2tag.views.pages.dataset_map import floor_map
from vislam2tag.walkable.walked.walked_record import WalkedFloor

MOST_SESSIONS = 300
"""Walks listed at most; all are in sessions.parquet."""


@dataclass(frozen=True)
class SplitView:
    """One split, as far as it concerns the fingerprints of one technology."""

    split: SplitLeakage
    technology: str

    @property
    def folds(self) -> list[FoldLeakage]:
        """Its folds."""
        return [fold for fold in self.split.folds if fold.of == self.technology and fold.fold != ALL_FOLDS]

    @property
    def whole(self) -> FoldLeakage | None:
        """All folds together; None where nothing tests."""
        together = [fold for fold in self.split.folds if fold.of == self.technology and fold.fold == ALL_FOLDS]
        return next(iter(together or self.folds), None)


def dataset_page(
    dataset: Dataset, statistics: DatasetStatistics, walked: Mapping[Storey, WalkedFloor] = MappingProxyType({})
) -> str:
    """Return the page as HTML that needs nothing else; equal input gives equal text.

    ``walked`` tells what of the plans was walked, of the floors where that is known.

    However large the set, the page grows only with its floors, devices and (to :data:`MOST_SESSIONS`) walks.
    """
    main = statistics.main
    name, technology = main or ("wifi", None)
    colours = _colours(sorted(technology.by_device)) if technology else {}
    context = {
        "title": dataset.info.title or dataset.info.name,
        "info": dataset.info,
        "version": __version__,
        "statistics": statistics,
        "technology": technology,
        "names": {"wifi": "Wi-Fi", "ble": "BLE"},
        "table": Table3.of(statistics.by_device, statistics.walks),
        "floors": [
            floor_map(dataset, name, covered, colours, walked.get(covered.storey))
            for covered in coverage(dataset, name)
        ],
        "charts": charts(technology, statistics.sessions, name, colours) if technology else [],
        "transmitters": _transmitters(dataset),
        "radius_m": CoverageSettings().radius_m,
        "splits": [SplitView(split, name) for split in leakage(dataset, dataset.splits)],
        "sessions": statistics.sessions[:MOST_SESSIONS],
        "main": name,
    }
    return page_text("dataset.html.j2", context)


def _transmitters(dataset: Dataset) -> list[dict[str, Any]]:
    """Count the transmitters of each technology; flags are None where no identifier is an address."""
    flag = {name: pl.when(pl.col(name).count() > 0).then(pl.col(name).sum()) for name in ("randomised", "mobile")}
    counted = dataset.access_points.group_by("technology").agg(
        heard=pl.len(), once=(pl.col("readings") == 1).sum(), strongest=pl.col("strongest_dbm").max(), **flag
    )
    return counted.sort("technology").collect().to_dicts()


def _colours(devices: list[str]) -> dict[str, str]:
    """The colours of the printed figures where they suffice; on the screen hovering tells more of them apart."""
    if len(devices) <= len(PALETTE):
        return colours_of(devices)
    return dict(zip(devices, cycle(qualitative.Dark24), strict=False))
