"""A quantity keeps what can be true and reports the rest with cause and cure."""

from __future__ import annotations

import polars as pl

from vislam2tag.intake.quantity import Quantity

WALKING_SPEED = Quantity(
    name="walking speeds",
    unit="m/s",
    least=0.0,
    greatest=3.0,
    kind="unknown_unit",
    cause="lengths are in millimetres",
    cure="Convert the file.",
)


def test_bounds_belong_to_the_range_and_numbers_must_be_finite() -> None:
    values = pl.Series([-0.1, 0.0, 3.0, 3.1, float("nan"), float("inf"), None])
    kept = pl.select(WALKING_SPEED.contains(pl.lit(values))).to_series().to_list()
    assert kept == [False, True, True, False, False, False, None]


def test_a_finding_names_range_cause_and_cure() -> None:
    assert WALKING_SPEED.outside("poses.csv", [], "they are not used") == []
    (finding,) = WALKING_SPEED.outside("poses.csv", [3, 9], "they are not used")
    assert (finding.kind, finding.file, finding.count, finding.lines) == ("unknown_unit", "poses.csv", 2, (3, 9))
    assert finding.message == (
        "walking speeds must be from 0 to 3 m/s; they are not used. Possible cause: lengths are in millimetres. "
        "Convert the file."
    )
