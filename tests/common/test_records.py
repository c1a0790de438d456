"""Records are checked when they are made, and never change."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from vislam2tag.common.records import FiniteRecord, Record


class Length(Record):
    metres: float


class FiniteLength(FiniteRecord):
    metres: float


def test_records_never_change_and_refuse_what_they_do_not_know() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Length(metres=1.0).metres = 2.0
    with pytest.raises(ValidationError, match="Extra inputs"):
        Length.model_validate({"metres": 1.0, "feet": 3.3})


def test_finite_records_refuse_infinity() -> None:
    assert Length(metres=math.inf).metres == math.inf
    with pytest.raises(ValidationError, match="finite"):
        FiniteLength(metres=math.inf)
