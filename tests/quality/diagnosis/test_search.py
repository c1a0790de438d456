"""Each kind of fault that geometry shows is named, alone and beside others, and none where nothing is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.quality.diagnosis.made_walks import ORDERS, PLACES, STARTS, evidence, made_survey, made_walk
from vislam2tag.common.findings import Answer, FaultKind
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.search import found_faults, judgement_of


def named(walks: list[WalkPasses], table: dict[str, complex], other: dict[str, complex] | None = None) -> list[Fault]:
    return found_faults(evidence(walks, table, other))[0]


def with_places(**changed: complex) -> dict[str, complex]:
    return {**PLACES, **{name.removeprefix("at_"): place for name, place in changed.items()}}


def test_nothing_is_named_of_a_sound_survey() -> None:
    assert named(made_survey(), PLACES) == []


@pytest.mark.parametrize(("one", "other"), [("1", "2"), ("3", "7"), ("8", "6")])
def test_two_sheets_in_each_others_place(one: str, other: str) -> None:
    (fault,) = named(made_survey(), {**PLACES, one: PLACES[other], other: PLACES[one]})
    assert (fault.kind, sorted(fault.landmarks)) == (FaultKind.SWAPPED, sorted([one, other]))
    assert [entry.values["ids"] for entry in fault.corrections] == [fault.landmarks]


def test_three_sheets_in_a_circle_are_two_exchanges() -> None:
    """Logged 1 hangs where 4 should, 4 where 6 should, 6 where 1 should."""
    true = with_places(at_1=PLACES["4"], at_4=PLACES["6"], at_6=PLACES["1"])
    (fault,) = named(made_survey(true), PLACES)
    renamed = {name: name for name in PLACES}
    for entry in fault.corrections:
        first, second = entry.values["ids"]
        renamed = {logged: {first: second, second: first}.get(name, name) for logged, name in renamed.items()}
    assert {logged: PLACES[name] for logged, name in renamed.items()} == true


def test_a_mis_surveyed_landmark_and_where_it_is() -> None:
    (fault,) = named(made_survey(), with_places(at_5=PLACES["5"] + 1.5 - 1j))
    assert (fault.kind, fault.landmarks) == (FaultKind.MIS_SURVEYED, ["5"])
    values = fault.corrections[0].values
    assert abs(complex(values["x"], values["y"]) - PLACES["5"]) < 0.4


def test_a_landmark_moved_since_a_date() -> None:
    moved = with_places(at_2=PLACES["2"] + 6j)
    walks = [
        made_walk(tuple(order), moved if day else PLACES, day, start=start)
        for day, (order, start) in enumerate(zip(("21234252", *ORDERS[1:]), STARTS, strict=True))
    ]
    (fault,) = named(walks, PLACES)
    assert (fault.kind, fault.landmarks) == (FaultKind.MOVED, ["2"])
    assert fault.corrections[0].values["from"].isoformat() == STARTS[1]


def test_two_sheets_with_one_id() -> None:
    true = {**PLACES, "second 4": 22 + 12j}
    walks = [
        made_walk([name.replace("9", "second 4") for name in order], true, day, start=start)
        for day, (order, start) in enumerate(zip(("1294568", "8796541", "349567", "12948"), STARTS, strict=True))
    ]
    relabelled = [
        replace(walk, landmark=tuple(name.removeprefix("second ") for name in walk.landmark)) for walk in walks
    ]
    (fault,) = named(relabelled, PLACES)
    assert (fault.kind, fault.landmarks) == (FaultKind.TWO_PLACES, ["4"])
    assert [entry.table for entry in fault.corrections] == ["rename_landmark"] * 4
    assert {entry.values["session"] for entry in fault.corrections} == set(STARTS)


@pytest.mark.parametrize(("unit", "metres"), [("ft", 0.3048), ("cm", 0.01), ("mm", 0.001)])
def test_a_table_in_another_unit(unit: str, metres: float) -> None:
    (fault,) = named(made_survey(), {name: place / metres for name, place in PLACES.items()})
    assert fault.kind is FaultKind.UNITS
    assert fault.corrections[0].values["unit"] == unit


def test_a_mirrored_table() -> None:
    (fault,) = named(made_survey(), {name: complex(45 - place.real, place.imag) for name, place in PLACES.items()})
    assert fault.kind is FaultKind.MIRRORED
    assert fault.corrections[0].values["shift_m"] == [45.0, 0.0]


def test_exchanged_axes_of_a_table() -> None:
    (fault,) = named(made_survey(), {name: complex(place.imag, place.real) for name, place in PLACES.items()})
    values = fault.corrections[0].values
    assert (values["mirrored"], values["turn_deg"], values.get("shift_m")) == (True, -90.0, None)
    assert "x and y are exchanged" in fault.summary


def test_a_session_in_the_folder_of_another_floor() -> None:
    rng = np.random.default_rng(5)
    upstairs = {name: complex(*rng.uniform((0, 0), (45, 30))) for name in PLACES}
    walks = [*made_survey(), made_walk(tuple("16483257"), upstairs, 9, start="2022-01-20T09:00:00")]
    (fault,) = named(walks, PLACES, upstairs)
    assert (fault.kind, fault.sessions) == (FaultKind.WRONG_FLOOR, ["floor 0 / LG / 2022-01-20T09:00:00"])
    assert fault.corrections[0].values["to"] == 1


def test_two_faults_at_once() -> None:
    table = with_places(at_1=PLACES["2"], at_2=PLACES["1"], at_5=PLACES["5"] + 3)
    faults = named(made_survey(), table)
    assert sorted((fault.kind.value, sorted(fault.landmarks)) for fault in faults) == [
        ("mis_surveyed", ["5"]),
        ("swapped", ["1", "2"]),
    ]


def test_a_landmark_that_was_passed_twice_is_not_judged() -> None:
    walks = made_survey(orders=("12345678", "8765431", "345671", "1284653"))
    assert sum(name == "2" for walk in walks for name in walk.landmark) == 2
    assert named(walks, with_places(at_2=PLACES["2"] + 5)) == []


def test_a_tracker_that_slips_is_no_fault_of_the_survey() -> None:
    walks = made_survey()
    camera = walks[0].camera.copy()
    camera[4:] += 7 - 3j
    walks[0] = replace(walks[0], camera=camera)
    found = evidence(walks, PLACES)
    assert found.walks[0].alignment.cuts == (4,)
    assert found_faults(found)[0] == []


def test_a_table_turned_by_a_quarter_lies_beside_the_plan() -> None:
    (fault,) = named(made_survey(), {name: complex(place.imag, 45 - place.real) for name, place in PLACES.items()})
    assert fault.kind is FaultKind.TURNED
    assert fault.corrections[0].values == {
        "floor": 0,
        "turn_deg": 90.0,
        "shift_m": [45.0, 0.0],
        "reason": "vislam2tag diagnose",
    }


def test_places_are_called_as_people_call_them() -> None:
    """Rooms left and right of x = 20, of which one has a name."""
    table = with_places(at_1=PLACES["4"], at_4=PLACES["1"], at_5=PLACES["8"])
    found = evidence(made_survey(), table)
    rooms = replace(found.table, room_at=lambda floor, place: "room Lab" if place.real < 20 else "")
    faults, _ = found_faults(replace(found, table=rooms))
    swapped, moved = sorted((fault.summary for fault in faults), key=len)
    assert swapped == "landmarks 1 and 4 of floor 0 are interchanged (1 in room Lab)"
    assert moved.startswith("landmark 5 of floor 0 is at (3")
    assert moved.endswith("from its position in the table, room Lab")


def test_walks_past_surveyed_landmarks_judge_these() -> None:
    found = judgement_of(evidence(made_survey(), {**PLACES, "99": 0j}), sessions=5, failed=1, faults=0)
    assert found.answer is Answer.NOTHING_WRONG
    assert found.looked_at == "8 landmarks in 4 walks"
    assert found.why == (
        "1 landmark could not be judged, because no walk passes enough others there; 1 session cannot be read or mapped"
    )


def test_two_surveyed_landmarks_do_not_judge_one_another() -> None:
    table = {name: PLACES[name] for name in "12"}
    found = judgement_of(evidence(made_survey(), table), sessions=4, failed=0, faults=0)
    assert (found.answer, found.looked_at) == (Answer.NOT_JUDGED, "")
    assert found.why.startswith("no walk passes 3 surveyed landmarks")


def test_known_positions_of_walks_without_poses_count() -> None:
    found = judgement_of(evidence([], PLACES), sessions=1, failed=0, faults=0, fixes=6)
    assert (found.answer, found.looked_at) == (Answer.NOTHING_WRONG, "6 known positions")


def test_no_session_and_none_that_can_be_read_differ() -> None:
    nothing = evidence([], PLACES)
    assert judgement_of(nothing, sessions=0, failed=0, faults=0).answer is Answer.NOT_LOOKED_AT
    assert judgement_of(nothing, sessions=2, failed=2, faults=0).why == ("none of 2 sessions can be read or mapped")
    assert judgement_of(nothing, sessions=1, failed=1, faults=0).why == "the session cannot be read or mapped"
