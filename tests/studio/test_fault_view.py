"""Corrections that the studio offers for a fault without a certain one, and those that affect a session."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from vislam2tag.common.findings import FaultKind
from vislam2tag.quality.diagnosis.record import Fault, PlaceByWalks, proposed
from vislam2tag.site.corrections.edits import corrections_of
from vislam2tag.site.model import SessionKey
from vislam2tag.studio.fault_view import alternatives
from vislam2tag.studio.used_corrections import used_corrections

SESSION = "floor 1 / LG / 2021-12-20T10:00:00"


def odd(**values: Any) -> list[tuple[str, dict[str, Any]]]:
    fault = Fault(kind=FaultKind.ODD_REFERENCE, summary="", evidence="", **values)
    return [(entry.table, entry.values) for entry in alternatives(fault)]


def test_a_landmark_can_be_put_where_walks_have_it_or_excluded() -> None:
    mark = {"id": "3", "floor": 1}
    place = PlaceByWalks(x_m=17.75, y_m=16.57, sigma_m=0.03)
    exclusion = ("exclude_landmark", mark)
    assert odd(floor=1, landmarks=["3"], by_walks=place) == [
        ("move_landmark", mark | {"x": 17.75, "y": 16.57, "sigma_m": 0.03}),
        exclusion,
    ]
    assert odd(floor=1, landmarks=["3"]) == [exclusion]
    session = {"device": "LG", "session": "2021-12-20T10:00:00"}
    assert odd(floor=1, landmarks=["3"], sessions=[SESSION]) == [("exclude_landmark", mark | session)]
    assert odd(floor=1, landmarks=["3"], corrections=[proposed("exclude_landmark", id="3")]) == []


def test_a_walk_can_be_excluded_and_of_several_none_is_chosen() -> None:
    walk = {"floor": 1, "device": "LG", "session": "2021-12-20T10:00:00"}
    assert odd(floor=1, sessions=[SESSION]) == [("exclude_session", walk)]
    assert odd(floor=1, sessions=[SESSION, SESSION.replace("LG", "Pixel")]) == []
    assert odd(floor=1, landmarks=["3", "4"]) == []


def used(text: str, **values: Any) -> list[str]:
    """Tables of the entries that affect a session of floor 1, which also saw floor 2."""
    seen = {"landmarks_logged": ["3"], "visits": [], "corrections": [], "floor": 1, "elsewhere": {2: None}} | values
    key = SessionKey(1, "LG", "2021-12-20T10:00:00")
    folder = SessionKey(4, "LG", "2021-12-20T10:00:00")
    result: Any = SimpleNamespace(**seen)
    return [entry.table for entry in used_corrections(corrections_of(text), folder, key, result)]


def test_corrections_of_the_site_affect_the_sessions_that_use_them() -> None:
    landmark = '[[exclude_landmark]]\nid = "3"\nfloor = {}\n'
    assert used(landmark.format(2)) == ["exclude_landmark"]
    assert used(landmark.format(3)) == []
    assert used(landmark.format(1), landmarks_logged=["4"]) == []
    assert used(landmark.format(1), landmarks_logged=["4"], corrections=["Landmark 3 is excluded (gone)."]) == [
        "exclude_landmark"
    ]
    assert used('[[swap_landmarks]]\nids = ["3", "5"]\nfloor = 1\n') == ["swap_landmarks"]
    assert used('[[swap_landmarks]]\nids = ["4", "5"]\n') == []
    assert used("[[set_floor]]\nfloor = 4\nto = 1\n") == ["set_floor"]
    assert used('[[landmark_units]]\nfloor = 2\nunit = "ft"\n') == ["landmark_units"]
    assert used('[[move_control_point]]\nfloor = 1\nid = "0"\nx = 1\ny = 2\n') == ["move_control_point"]
    assert used('[[ignore_fault]]\nkind = "moved"\nreason = "known"\n') == []
    assert used('[[shift_clock]]\ndevice = "Pixel"\ntable = "wifi"\noffset_s = 1\n') == []
