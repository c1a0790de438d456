"""Names in a station's file that are not those of the landmark table."""

from __future__ import annotations

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.registration.names import LandmarkTable, NameRules, Role, id_findings, point_label, role_of


@pytest.mark.parametrize(
    ("name", "key", "role", "identity"),
    [
        ("7", "7", Role.LANDMARK, "7"),
        ("007", "7", Role.LANDMARK, "7"),
        ("7_l", "7_L", Role.LEFT, "7"),
        ("door_R", "door_R", Role.RIGHT, "door"),
        ("_L", "_L", Role.LEFT, ""),
        ("CP03", "control point 3", Role.CONTROL, "3"),
        ("CPx", "CPx", Role.LANDMARK, "CPx"),
        ("tp12", "tie tp12", Role.TIE, "tp12"),
    ],
)
def test_usual_names(name: str, key: str, role: Role, identity: str) -> None:
    assert NameRules().key(name) == key
    if name != "_L":
        assert role_of(key) == (role, identity)


def test_what_matches_no_pattern_is_a_tie() -> None:
    rules = NameRules(landmarks="LM*")
    assert rules.key("LM07") == rules.key("lm7") == "7"
    assert rules.key("7") == "tie 7"
    assert point_label("tie 7") == "7"


@pytest.mark.parametrize("pattern", ["LM", "L*M*", ""])
def test_a_pattern_needs_one_star(pattern: str) -> None:
    with pytest.raises(UsageError, match=r"--landmark-names '.*': the pattern must contain one \* in place of the id"):
        NameRules(landmarks=pattern)


PLACES = {str(number): complex(3 * number, number % 3) for number in range(1, 8)}
TABLE = LandmarkTable(1, tuple(PLACES), tuple(PLACES))
MEASURED = LandmarkTable(1, tuple(PLACES))


def kinds(table: LandmarkTable, placed: dict[str, complex], ties: tuple[str, ...] = ()) -> list[str]:
    return [finding.kind for finding in id_findings(table, placed, ties, PLACES)]


def test_a_prefix_is_named_with_the_option_that_takes_it_away() -> None:
    (finding,) = id_findings(TABLE, {f"LM{name}": at for name, at in PLACES.items()}, (), PLACES)
    assert finding.kind == "other_ids"
    assert "the landmark table of floor 1 has 7 ids (1, 2, 3, 4, 5, ...)" in finding.message
    assert "the measurement has 7 ids (LM1, LM2, LM3, LM4, LM5, ...)" in finding.message
    assert "landmarks of the table that stay planned and are not used: 7" in finding.message
    assert "--landmark-names 'LM*'" in finding.message


def test_names_that_match_no_pattern_count_where_nothing_else_was_placed() -> None:
    assert kinds(TABLE, {}, tuple(f"P-{name}" for name in PLACES)) == ["other_ids"]


@pytest.mark.parametrize("shift", [-1, 1])
def test_positions_show_that_names_are_shifted(shift: int) -> None:
    placed = {str(int(name) + shift): at + 0.2 for name, at in PLACES.items()}
    (finding,) = id_findings(MEASURED, placed, (), PLACES)
    assert finding.kind == "shifted_ids"
    assert f"next {'lower' if shift > 0 else 'higher'} id" in finding.message


def test_right_names_and_further_landmarks_are_usual() -> None:
    assert kinds(TABLE, {name: at + 0.3 for name, at in PLACES.items()}) == []
    assert kinds(MEASURED, {"1": PLACES["1"], "9": 90 + 0j}) == []
    assert kinds(MEASURED, {str(number): complex(number, 40) for number in range(10, 18)}) == [], "the next batch"
    assert kinds(LandmarkTable(1), {"1": 0j, "2": 1j}) == []
    assert kinds(MEASURED, {}) == []
