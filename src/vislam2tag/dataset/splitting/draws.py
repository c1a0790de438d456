"""Draws that depend on a seed and on names alone: no order of rows and no generator's version enters them."""

from __future__ import annotations

import hashlib

import polars as pl


def draw_order(names: pl.Series, seed: int) -> pl.Series:
    """Give each name its SHA-256 (hexadecimal) under a seed; sorting by it is a random order."""
    return pl.Series("draw", [hashlib.sha256(f"{seed}/{name}".encode()).hexdigest() for name in names], dtype=pl.String)


def drawn(table: pl.DataFrame, name: str, strata: tuple[str, ...], share: float, seed: int) -> pl.Series:
    """Draw a share of the rows of each stratum, by the unique names in column ``name``: a mask (n,).

    Exactly ``round(share * rows)`` of each stratum (halves up). A row added to a stratum changes the part of at most
    one other, and of none outside the stratum.
    """
    place = pl.col("draw").rank("ordinal").over(strata)
    wanted = (pl.len().over(strata) * share + 0.5).floor()
    return table.with_columns(draw_order(table[name], seed)).select(drawn=place <= wanted)["drawn"]


def dealt(table: pl.DataFrame, name: str, strata: tuple[str, ...], hands: int, seed: int) -> pl.Series:
    """Deal the rows to hands 0 to ``hands - 1``, stratum after stratum, so that each gets as many as it can: (n,)."""
    ordered = table.with_row_index("row").with_columns(draw_order(table[name], seed)).sort(*strata, "draw")
    return ordered.with_columns(hand=pl.int_range(pl.len()) % hands).sort("row")["hand"]
