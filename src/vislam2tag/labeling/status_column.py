"""The column ``status`` of labelled tables: text in the tables, codes in arrays."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import StatusArray
from vislam2tag.core.status import STATUS_LABELS

STATUS_TYPE = pl.Enum(STATUS_LABELS)
"""Its physical values are the status codes."""
_LABELS = pl.Series(STATUS_LABELS, dtype=pl.String)


def status_text(status: StatusArray) -> pl.Series:
    """Turn status codes (n,) into the text column ``status``."""
    return _LABELS[status].rename("status")


def status_codes(table: pl.DataFrame) -> StatusArray:
    """Status code (n,) of each row of a labelled table, an array of its own."""
    return table["status"].cast(STATUS_TYPE).to_physical().to_numpy().astype(np.int8)
