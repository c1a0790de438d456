"""Which model a benchmark recommends, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vislam2tag.positioning.benchmark.record import BenchmarkRow
from vislam2tag.positioning.benchmark.rows import ALL

COMPLETE = 0.9
"""A model that answers less than this share of what the most complete one answers is not recommended ..."""
FLOORS_OFF = 0.05
"""... nor one that finds the floor so much less often than the one that finds it most (shares 0 to 1)."""
ALIKE = 0.05
"""Means that differ by less than this share of the smaller one are called alike."""


@dataclass(frozen=True)
class BestModel:
    """The model with the smallest mean error on a split, of those that answer and find floors about as often as any."""

    split: str
    model: str
    mean_m: float
    floor_hit: float | None
    runner_up: str | None
    """The next one; None where there is no other."""
    behind_m: float
    """By how much that one's mean error is larger."""

    @property
    def alike(self) -> bool:
        """Whether the runner-up is as good for any use."""
        return self.runner_up is not None and self.behind_m < ALIKE * self.mean_m


def best_models(rows: Sequence[BenchmarkRow]) -> list[BestModel]:
    """The best model of each split, over all its folds; splits without any error are left out."""
    found = (
        _best(split, [row for row in rows if row.split == split]) for split in dict.fromkeys(r.split for r in rows)
    )
    return [one for one in found if one is not None]


def _best(split: str, rows: Sequence[BenchmarkRow]) -> BestModel | None:
    whole = [row for row in rows if row.fold == ALL] or rows
    answered, floors = (_greatest(whole, name) for name in ("answered", "floor_hit"))
    fit = {
        row.model: row.figures["mean_m"].value
        for row in whole
        if _of(row, "answered") >= COMPLETE * answered and _of(row, "floor_hit") >= floors - FLOORS_OFF
    }
    ranked = sorted((mean, model) for model, mean in fit.items() if mean is not None)
    if not ranked:
        return None
    (mean_m, model), *others = ranked
    floor_hit = next(row.figures["floor_hit"].value for row in whole if row.model == model)
    runner_up, behind_m = (others[0][1], others[0][0] - mean_m) if others else (None, 0.0)
    return BestModel(split, model, mean_m, floor_hit, runner_up, behind_m)


def _greatest(rows: Sequence[BenchmarkRow], name: str) -> float:
    return max((_of(row, name) for row in rows), default=0.0)


def _of(row: BenchmarkRow, name: str) -> float:
    return row.figures[name].value or 0.0
