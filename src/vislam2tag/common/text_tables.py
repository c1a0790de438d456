"""Rows as CSV text, the one way in which this program writes it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence


def csv_rows(rows: Iterable[Sequence[object]], newline: str = "\n") -> str:
    """Write rows, a header among them where there is one: commas, quotes where needed (RFC 4180), ``newline``."""
    text = io.StringIO()
    csv.writer(text, lineterminator=newline).writerows(rows)
    return text.getvalue()
