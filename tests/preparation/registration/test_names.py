from __future__ import annotations

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.registration.names import NameRules, Role, point_label, role_of


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
    with pytest.raises(UsageError, match=r"--landmark-names '.*': one \* must stand for the id"):
        NameRules(landmarks=pattern)
