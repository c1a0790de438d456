"""Text in CSV files that people open in a spreadsheet, which takes ``=HYPERLINK(...)`` for a formula.

An apostrophe before it makes it text; reading takes it off again. A text that begins with apostrophes and then as a
formula gets one more in any case, so that every text comes back as it was (OWASP, CSV injection).
"""

from __future__ import annotations

import polars as pl

_BEGINS_A_FORMULA = r"[=+\-@\t\r]"


def escaped(table: pl.DataFrame, *, formulas: bool = True) -> pl.DataFrame:
    """Put an apostrophe before all texts of a table that a spreadsheet would take for a formula.

    ``formulas`` False: they stay as they are.
    """
    begins = f"^'{'*' if formulas else '+'}{_BEGINS_A_FORMULA}"
    texts = pl.col(pl.String)
    return table.with_columns(pl.when(texts.str.contains(begins)).then("'" + texts).otherwise(texts).name.keep())


def unescaped(table: pl.DataFrame) -> pl.DataFrame:
    """Take off again what :func:`escaped` put before texts."""
    return table.with_columns(pl.col(pl.String).str.replace(f"^'('*{_BEGINS_A_FORMULA})", "$1"))
