"""Which model a benchmark recommends, why, and how sure it is that the next one errs more."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import polars as pl

from vislam2tag.common.bootstrap import mean_interval
from vislam2tag.positioning.benchmark.record import BenchmarkRow, BestModel
from vislam2tag.positioning.benchmark.rows import ALL

COMPLETE = 0.9
"""A model that answers less than this share of what the most complete one answers is not recommended ..."""
FLOORS_OFF = 0.05
"""... nor one that finds the floor so much less often than the one that finds it most (shares 0 to 1)."""
_DIGITS = 6
"""Of intervals, in metres."""
Behind = Callable[[str, str, str], tuple[float, float] | None]
"""From a split, its best model and the runner-up to the 95 % interval of how much more this one errs, metres."""


def _unknown(split: str, model: str, runner_up: str) -> None:
    del split, model, runner_up


def best_models(rows: Sequence[BenchmarkRow], behind: Behind = _unknown) -> list[BestModel]:
    """The best model of each split, over all its folds; splits without any error are left out."""
    splits = dict.fromkeys(row.split for row in rows)
    found = (_best(split, [row for row in rows if row.split == split], behind) for split in splits)
    return [one for one in found if one is not None]


def _best(split: str, rows: Sequence[BenchmarkRow], behind: Behind) -> BestModel | None:
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
    return BestModel(
        split=split,
        model=model,
        mean_m=mean_m,
        floor_hit=floor_hit,
        runner_up=runner_up,
        behind_m=behind_m,
        behind_interval_m=None if runner_up is None else behind(split, model, runner_up),
    )


def paired_interval(one: pl.DataFrame, other: pl.DataFrame) -> tuple[float, float] | None:
    """Return the 95 % interval of by how much ``other`` errs more, over walks drawn again; None for few walks.

    Both have columns fold, scan_id, walk and error_m (null: not answered), a row for each seed; scans that both
    answered count, and each fold the same.
    """
    keys = ("fold", "scan_id", "walk")
    means = [table.group_by(keys).agg(pl.col("error_m").mean()) for table in (one, other)]
    both = means[0].join(means[1], on=keys, suffix="_other", nulls_equal=True).drop_nulls(["error_m", "error_m_other"])
    both = both.with_columns(weight=1 / pl.len().over("fold")).sort("fold", "scan_id")
    walk = both["walk"].fill_null("").to_numpy().astype(np.str_)
    found = mean_interval((both["error_m_other"] - both["error_m"]).to_numpy(), walk, both["weight"].to_numpy())
    return found and (round(found[0], _DIGITS), round(found[1], _DIGITS))


def _greatest(rows: Sequence[BenchmarkRow], name: str) -> float:
    return max((_of(row, name) for row in rows), default=0.0)


def _of(row: BenchmarkRow, name: str) -> float:
    return row.figures[name].value or 0.0
