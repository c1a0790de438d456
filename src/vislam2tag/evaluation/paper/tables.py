"""The paper's Tables I and II: one error a walk and strategy, then statistics over the walks, beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.site.model import SessionKey

PAPER_TABLE_1 = {
    "local": (0.91, 0.63, 4.51),
    "local-corrected": (0.53, 0.49, 0.87),
    "global-affine": (2.80, 0.54, 20.78),
}
"""Mean, median and maximum over all walks at control points, metres (the paper's global is an affine map here)."""
PAPER_TABLE_1_NON_FAULTY = {"local": (0.51, 0.49, 0.72), "global-affine": (0.43, 0.40, 0.72)}
PAPER_TABLE_2 = {"local": (0.73, 0.23, 2.68), "local-corrected": (0.18, 0.18, 0.31)}
"""Mean, median and maximum over the walks in the total station's view, metres."""
PUBLISHED = tuple(PAPER_TABLE_1)
"""Strategies that the paper evaluates."""
METRICS = ("mean", "median", "maximum")

_Published = dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class WalkErrors:
    """Mean error of one walk by strategy, metres; NaN where the strategy labels nothing."""

    key: SessionKey
    error_m: dict[str, float]
    faulty: bool


@dataclass(frozen=True)
class WalkSummary:
    """Statistics over walks, metres."""

    walks: int
    mean_m: float
    median_m: float
    max_m: float


def summarise_walks(walks: Sequence[WalkErrors], strategy: str, only_non_faulty: bool = False) -> WalkSummary:
    """Reduce the walks that this strategy labels (at least in part) to mean, median and maximum."""
    errors = np.array([w.error_m[strategy] for w in walks if not (only_non_faulty and w.faulty)])
    errors = errors[np.isfinite(errors)]
    if not errors.size:
        return WalkSummary(0, float("nan"), float("nan"), float("nan"))
    return WalkSummary(len(errors), float(errors.mean()), float(np.median(errors)), float(errors.max()))


@dataclass(frozen=True)
class Cell:
    """One statistic of one strategy, metres: ours (NaN where no walk is labelled) and the paper's, where it has one."""

    strategy: str
    here_m: float
    paper_m: float | None
    walks: int


@dataclass(frozen=True)
class TableRow:
    """One statistic over a selection of the walks, a cell for each strategy."""

    selection: str
    metric: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper: rows of the same strategies."""

    title: str
    rows: tuple[TableRow, ...]


def table_1(walks: Sequence[WalkErrors], strategies: Sequence[str]) -> PaperTable:
    """Errors at control points, over all walks and over those without faults."""
    rows = (
        *_rows("all trajectories", walks, strategies, PAPER_TABLE_1, only_non_faulty=False),
        *_rows("non-faulty trajectories", walks, strategies, PAPER_TABLE_1_NON_FAULTY, only_non_faulty=True),
    )
    return PaperTable("Table I: error at control points, over walks (metres)", rows)


def table_2(walks: Sequence[WalkErrors], strategies: Sequence[str]) -> PaperTable:
    """Errors against the total station, over all walks."""
    rows = _rows("all trajectories", walks, strategies, PAPER_TABLE_2, only_non_faulty=False)
    return PaperTable("Table II: error against the total station, over walks (metres)", rows)


def _rows(
    selection: str,
    walks: Sequence[WalkErrors],
    strategies: Sequence[str],
    published: _Published,
    *,
    only_non_faulty: bool,
) -> tuple[TableRow, ...]:
    ours = {name: summarise_walks(walks, name, only_non_faulty) for name in strategies}
    return tuple(
        TableRow(selection, metric, tuple(_cell(name, ours[name], published, number) for name in strategies))
        for number, metric in enumerate(METRICS)
    )


def _cell(strategy: str, ours: WalkSummary, published: _Published, number: int) -> Cell:
    here_m = (ours.mean_m, ours.median_m, ours.max_m)[number]
    return Cell(strategy, here_m, published[strategy][number] if strategy in published else None, ours.walks)
