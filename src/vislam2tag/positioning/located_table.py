"""Positions as the rows that users get (``vislam2tag locate``)."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.scans import TextArray

OK, UNKNOWN = "ok", "unknown"
LOCATED = {
    "scan_id": pl.String,
    "status": pl.String,
    "building": pl.String,
    "floor": pl.Int64,
    "x": pl.Float64,
    "y": pl.Float64,
    "z": pl.Float64,
    "radius_68_m": pl.Float64,
    "radius_95_m": pl.Float64,
    "floor_probability": pl.Float64,
}
"""Columns: BCS metres; null where the status is ``unknown``; ``z`` where no height was learned;
``building`` where it has no name."""
_DECIMALS = 3


def located_table(ids: TextArray, found: Positions) -> pl.DataFrame:
    """Make the rows of scans with these ids (n) and positions (n); numbers are rounded to millimetres."""
    storey = np.maximum(found.storey, 0)
    numbers = {
        "x": found.xy[:, 0],
        "y": found.xy[:, 1],
        "z": found.z,
        "radius_68_m": found.radius_68_m,
        "radius_95_m": found.radius_95_m,
        "floor_probability": np.take_along_axis(found.storey_probability, storey[:, None], axis=1)[:, 0],
    }
    columns = {
        "scan_id": ids.tolist(),
        "status": [OK if known else UNKNOWN for known in found.known.tolist()],
        "building": [found.storeys[index].building or None for index in storey.tolist()],
        "floor": found.floor,
    }
    unknown = pl.col("status") == UNKNOWN
    return pl.DataFrame(columns | numbers, schema=LOCATED).with_columns(
        pl.when(~unknown).then(pl.col("building", "floor")),
        pl.col(*numbers).round(_DECIMALS).fill_nan(None),
    )
