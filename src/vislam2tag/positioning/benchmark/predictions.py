"""Every scan of a test part with its true and its found place, as a table (``runs/*.parquet``)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.scans.places import Positions, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import TextArray

PREDICTIONS = {
    "scan_id": pl.String,
    "building": pl.String,
    "floor": pl.Int64,
    "x": pl.Float64,
    "y": pl.Float64,
    "z": pl.Float64,
    "found_building": pl.String,
    "found_floor": pl.Int64,
    "found_x": pl.Float64,
    "found_y": pl.Float64,
    "found_z": pl.Float64,
    "radius_68_m": pl.Float64,
    "radius_95_m": pl.Float64,
}
"""Columns: BCS metres; what the model did not say is null."""


def predictions_table(ids: TextArray, truth: ScanPlaces, found: Positions) -> pl.DataFrame:
    """Put truth (n,) and positions (n,) of the scans with these ids (n,) side by side; columns :data:`PREDICTIONS`."""
    building, floor = _storeys(truth.storeys, truth.storey)
    found_building, found_floor = _storeys(found.storeys, found.storey)
    numbers = {
        "x": truth.xy[:, 0],
        "y": truth.xy[:, 1],
        "z": truth.z,
        "found_x": found.xy[:, 0],
        "found_y": found.xy[:, 1],
        "found_z": found.z,
        "radius_68_m": found.radius_68_m,
        "radius_95_m": found.radius_95_m,
    }
    places = {"building": building, "floor": floor, "found_building": found_building, "found_floor": found_floor}
    columns = {"scan_id": ids.tolist()} | places | {name: _nullable(values) for name, values in numbers.items()}
    return pl.DataFrame({name: columns[name] for name in PREDICTIONS}, schema=PREDICTIONS)


def with_errors(predictions: pl.DataFrame) -> pl.DataFrame:
    """Add ``error_m`` in the plane (null: unknown) and ``on_floor``: whether building and floor are right."""
    error_m = ((pl.col("found_x") - pl.col("x")).pow(2) + (pl.col("found_y") - pl.col("y")).pow(2)).sqrt()
    same = [pl.col(name) == pl.col(f"found_{name}") for name in ("building", "floor")]
    return predictions.with_columns(error_m=error_m, on_floor=pl.all_horizontal(same).fill_null(value=False))


def _storeys(storeys: Sequence[Storey], storey: IntArray) -> tuple[list[str | None], list[int | None]]:
    """Building and floor of each index (n,); None where it is -1."""
    named = [storeys[index] if index >= 0 else None for index in storey.tolist()]
    return [one.building if one else None for one in named], [one.floor if one else None for one in named]


def _nullable(values: FloatArray) -> pl.Series:
    """Values (n,) with null for NaN."""
    return pl.Series(np.asarray(values, dtype=np.float64)).fill_nan(None)
