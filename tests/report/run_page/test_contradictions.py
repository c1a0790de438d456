from __future__ import annotations

from pathlib import Path

import pytest

from tests.report.factory import make_result, make_survey
from vislam2tag.labeling.results import ContradictionMark, SessionResult
from vislam2tag.report.run_page.summary import LandmarkTally


def mark(landmark: str, offset_m: tuple[float, float], size_m: float, floor: int = 1) -> ContradictionMark:
    return ContradictionMark(
        floor=floor, landmark=landmark, size_m=size_m, sigma_m=0.1, passes=2, surveyed_m=(5.0, 6.0), offset_m=offset_m
    )


def session(tmp_path: Path, marks: list[ContradictionMark], seen: list[str]) -> SessionResult:
    result = make_result(make_survey(tmp_path, floors=1, sessions=1, plan=False).sessions[0])
    return result.model_copy(update={"contradictions": marks, "landmarks_logged": seen})


def test_sessions_are_counted_and_offsets_averaged(tmp_path: Path) -> None:
    tally = LandmarkTally()
    for offset in ((1.0, 0.0), (3.0, 0.5), (2.0, 1.0)):
        tally.add(session(tmp_path, [mark("7", offset, offset[0])], ["7", "8"]))
    tally.add(session(tmp_path, [mark("8", (0.0, 9.0), 9.0)], ["7", "8"]))
    tally.add(session(tmp_path, [], ["7"]))
    seven, eight = tally.all()
    assert (seven.landmark, seven.sessions, seven.seen, seven.greatest_m) == ("7", 3, 5, 3.0)
    assert seven.offset_m == pytest.approx((2.0, 0.5), abs=1e-3)
    assert seven.surveyed_m == (5.0, 6.0)
    assert (eight.landmark, eight.sessions, eight.seen, eight.offset_m) == ("8", 1, 4, (0.0, 9.0))


def test_one_id_on_two_floors_is_two_landmarks(tmp_path: Path) -> None:
    tally = LandmarkTally()
    tally.add(session(tmp_path, [mark("7", (1.0, 0.0), 1.0, floor=2)], ["7"]))
    tally.add(session(tmp_path, [mark("7", (0.0, 1.0), 1.0, floor=1)], ["7"]))
    assert [(found.floor, found.sessions, found.seen) for found in tally.all()] == [(1, 1, 1), (2, 1, 1)]


def test_nothing_contradicts(tmp_path: Path) -> None:
    tally = LandmarkTally()
    tally.add(session(tmp_path, [], ["7"]))
    assert tally.all() == []
