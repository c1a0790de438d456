from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.views.factory import make_result, make_results, make_survey
from vislam2tag.labeling.results import ContradictionMark, SessionResult, Summary
from vislam2tag.views.run_summary import LandmarkTally, summarise


@pytest.fixture
def results(tmp_path: Path) -> list[SessionResult]:
    return make_results(make_survey(tmp_path, plan=False))


def test_totals_are_the_sums_over_sessions(results: list[SessionResult]) -> None:
    summary = summarise(iter(results), "local", "1.2.3")
    assert (summary.version, summary.strategy, summary.sessions, summary.failed) == ("1.2.3", "local", 8, 1)
    assert summary.duration_s == pytest.approx(sum(result.duration_s for result in results), abs=1e-3)
    assert summary.distance_m == pytest.approx(sum(result.distance_m for result in results), abs=1e-3)
    for status, count in summary.frames.items():
        assert count == sum(result.frames.get(status, 0) for result in results)
    assert sum(summary.frame_seconds.values()) == pytest.approx(summary.duration_s, abs=1e-2)
    assert summary.readings["wifi"]["ok"] == 7 * 1_800
    assert summary.findings["stale_wifi_rows"] == 8 * 140
    assert summary.failures == {results[-2].slug: results[-2].error}


def test_groups_add_up_to_the_whole(results: list[SessionResult]) -> None:
    summary = summarise(results, "local", "1")
    for groups in (summary.per_floor, summary.per_device):
        for name in ("sessions", "failed", "duration_s", "distance_m", "frames", "frames_ok"):
            whole = sum(group[name] for group in groups.values())
            expected = {"frames": sum(summary.frames.values()), "frames_ok": summary.frames["ok"]}
            assert whole == pytest.approx(expected.get(name, getattr(summary, name, None)), abs=0.01)
    assert set(summary.per_floor) == {"1", "2"}


def test_results_are_taken_one_at_a_time(results: list[SessionResult]) -> None:
    alive: list[SessionResult] = []

    def one_by_one() -> Iterator[SessionResult]:
        for result in results:
            alive.append(result)
            yield result
            alive.remove(result)
            assert not alive

    assert summarise(one_by_one(), "local", "1").sessions == len(results)


def test_empty_run_has_a_summary_that_survives_json() -> None:
    summary = summarise([], "global", "1")
    assert summary.sessions == 0
    assert Summary.model_validate_json(summary.model_dump_json()) == summary


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
