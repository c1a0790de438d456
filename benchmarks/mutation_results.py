"""Results of commands as tables, and how two of them differ."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

MOVED_M, CHANGED = 0.05, 1e-3
"""Positions may move by this on average, and other values may change by this."""
SAME_SHARE = 0.99


@dataclass(frozen=True)
class Table:
    """A table of a command's result: its files, and how two of them are compared."""

    files: str
    """Pattern below the output folder; tables of several files are joined."""
    keys: tuple[str, ...]
    positions: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    where: pl.Expr | None = None

    @property
    def name(self) -> str:
        """Name of the table in messages."""
        return self.files.split("/")[-2 if "*" in self.files else -1]

    def read(self, out: Path) -> pl.DataFrame | None:
        """The table of an output folder; None if there is none."""
        files = sorted(out.glob(self.files))
        if not files:
            return None
        whole = pl.concat(map(_frame, files), how="diagonal_relaxed")
        whole = whole.with_row_index("row") if "row" in self.keys and "row" not in whole.columns else whole
        whole = whole if self.where is None else whole.filter(self.where)
        return whole.select(pl.col(*self.keys).cast(pl.String), *self.positions, *self.values).unique(self.keys)

    def difference(self, clean: pl.DataFrame | None, changed: pl.DataFrame | None) -> str:
        """How two tables of results differ; empty if they do not."""
        if clean is None or changed is None:
            return "" if clean is changed else f"{self.name}: {'no' if changed is None else 'a new'} table"
        both = clean.join(changed, on=self.keys, suffix="_new")
        if len(both) < SAME_SHARE * max(len(clean), len(changed)):
            return f"{self.name}: {len(clean)} rows, {len(changed)} changed, {len(both)} in common"
        return self._moved(both) or self._changed(both)

    def _moved(self, both: pl.DataFrame) -> str:
        placed = both.drop_nulls(self.positions) if self.positions else both.clear()
        if placed.is_empty():
            return ""
        old, new = (
            placed.select(pl.col(f"{name}{end}").cast(pl.Float64, strict=False) for name in self.positions).to_numpy()
            for end in ("", "_new")
        )
        moved = np.linalg.norm(new - old, axis=1)
        known = np.isfinite(moved)
        if known.mean() < SAME_SHARE:
            return f"{self.name}: {known.mean():.0%} have both positions"
        mean_m = moved[known].mean()
        return f"{self.name}: positions moved by {mean_m:.2f} m on average" if mean_m > MOVED_M else ""

    def _changed(self, both: pl.DataFrame) -> str:
        same = {name: _same(both[name], both[f"{name}_new"]) for name in self.values}
        changed = [f"{share:.0%} of {name} are the same" for name, share in same.items() if share < SAME_SHARE]
        return f"{self.name}: {', '.join(changed)}" if changed else ""


def _frame(file: Path) -> pl.DataFrame:
    if file.suffix == ".json":
        return pl.DataFrame(json.loads(file.read_text(encoding="utf-8"))["floors"], infer_schema_length=None)
    return pl.read_csv(file, infer_schema_length=None) if file.suffix == ".csv" else pl.read_parquet(file)


def _same(old: pl.Series, new: pl.Series) -> float:
    """Share of equal values."""
    pair = pl.DataFrame({"old": old, "new": new})
    equal = pl.col("old").cast(pl.String).eq_missing(pl.col("new").cast(pl.String))
    if old.dtype.is_float():
        new_value = pl.col("new").cast(pl.Float64, strict=False)
        equal |= ((new_value - pl.col("old")).abs() <= CHANGED * pl.col("old").abs().clip(1.0)).fill_null(value=False)
    return 1.0 if pair.is_empty() else pair.select(equal).to_series().to_numpy().mean().item()
