"""Of which floor the sheets were that share an id, told by where a walk's other landmarks put them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.quality.diagnosis.made_walks import PLACES, made_walk
from vislam2tag.common.findings import FaultKind
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.id_faults import floors_of_passes

OTHERS = {name: PLACES[name] for name in "124578"}
SHEETS = {"3": {0: PLACES["3"], 1: PLACES["6"]}}


def walk_past(order: str) -> WalkPasses:
    """A walk of floor 0; where it passes 6, the sheet says 3."""
    walk = made_walk(tuple(order), PLACES, seed=4)
    return replace(walk, landmark=tuple("3" if name == "6" else name for name in walk.landmark))


@pytest.mark.parametrize(
    ("order", "spans"),
    [
        ("126745", [{}]),
        ("1236745", [{"from_s": 25.0}]),
        ("1267345", [{"to_s": 30.0}]),
        ("136234", [{"from_s": 15.0, "to_s": 30.0}]),
        ("1623645", [{"to_s": 20.0}, {"from_s": 35.0}]),
    ],
)
def test_passes_of_each_floors_sheet(order: str, spans: list[dict[str, float]]) -> None:
    (fault,) = floors_of_passes(walk_past(order), OTHERS, SHEETS)
    assert (fault.kind, fault.landmarks) == (FaultKind.TWO_FLOORS, ["3"])
    entries = [entry.values for entry in fault.corrections]
    assert [{key: values[key] for key in ("from_s", "to_s") if key in values} for values in entries] == spans
    assert {(values["id"], values["to"], values["session"]) for values in entries} == {("3", 1, "2022-01-10T09:00:00")}


def test_a_walk_that_passed_only_its_own_floors_sheet() -> None:
    (fault,) = floors_of_passes(walk_past("123745"), OTHERS, SHEETS)
    assert [entry.values["to"] for entry in fault.corrections] == [0]
    assert "landmark 3 of floor 0" in fault.summary


@pytest.mark.parametrize(
    ("order", "sheets"),
    [
        ("13", SHEETS),  # one other landmark
        ("123745", {"3": {0: PLACES["3"] + 0.1, 1: PLACES["3"] - 0.1}}),  # above each other
        ("123745", {"3": {0: PLACES["3"] + 5, 1: PLACES["6"]}}),  # neither hangs there
        ("123745", SHEETS | {"9": {0: 1 + 1j, 1: 9 + 9j}}),  # never passed
    ],
)
def test_what_cannot_be_told_is_not_named(order: str, sheets: dict[str, dict[int, complex]]) -> None:
    assert floors_of_passes(walk_past(order), OTHERS, sheets) == []
