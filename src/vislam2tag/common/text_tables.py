"""Tables as text: CSV, Markdown and LaTeX, the one way in which this program writes them.

People open CSV files in a spreadsheet, which takes ``=HYPERLINK(...)`` for a formula. An apostrophe before it makes it
text; reading takes it off again. A text that begins with apostrophes and then as a formula gets one more in any case,
so that every text comes back as it was (OWASP, CSV injection).
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from typing import TypeVar

import polars as pl


def csv_rows(rows: Iterable[Sequence[object]], newline: str = "\n") -> str:
    """Write rows, a header among them where there is one: commas, quotes where needed (RFC 4180), ``newline``."""
    text = io.StringIO()
    csv.writer(text, lineterminator=newline).writerows(rows)
    return text.getvalue()


def markdown_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]], texts: int) -> str:
    """Write a table with its title; the first ``texts`` columns are text, the others numbers."""
    align = " | ".join(["---"] * texts + ["---:"] * (len(head) - texts))
    lines = [f"**{title}**", "", _markdown_row(head), f"| {align} |", *map(_markdown_row, rows)]
    return "\n".join(lines) + "\n"


def _markdown_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def latex_table(
    title: str, heads: Sequence[Sequence[str]], groups: Iterable[Iterable[Sequence[str]]], texts: int
) -> str:
    """Write a ``tabular`` (package booktabs) below its title as a comment; cells are LaTeX already.

    ``heads`` are one line or several, the last with a cell for each column. A rule precedes each group of rows.
    """
    columns = "l" * texts + "r" * (len(heads[-1]) - texts)
    lines = [f"% {title}", f"\\begin{{tabular}}{{{columns}}}", "\\toprule", *map(_latex_row, heads)]
    for group in groups:
        lines += ["\\midrule", *map(_latex_row, group)]
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}"]) + "\n"


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + " \\\\"


def latex_escaped(text: str) -> str:
    """Write text so that LaTeX prints it unchanged."""
    return "".join(f"\\{letter}" if letter in "&%$#_{}" else letter for letter in text)


_BEGINS_A_FORMULA = r"[=+\-@\t\r]"


_Table = TypeVar("_Table", pl.DataFrame, pl.LazyFrame)


def spreadsheet_escaped(table: _Table, *, formulas: bool = True) -> _Table:
    """Put an apostrophe before all texts of a table that a spreadsheet would take for a formula.

    ``formulas`` False: they stay as they are.
    """
    begins = f"^'{'*' if formulas else '+'}{_BEGINS_A_FORMULA}"
    texts = pl.col(pl.String)
    return table.with_columns(pl.when(texts.str.contains(begins)).then("'" + texts).otherwise(texts).name.keep())


def spreadsheet_unescaped(table: pl.DataFrame) -> pl.DataFrame:
    """Take off again what :func:`spreadsheet_escaped` put before texts."""
    return table.with_columns(pl.col(pl.String).str.replace(f"^'('*{_BEGINS_A_FORMULA})", "$1"))
