"""The first screen: accuracy from sigmas, and each problem with what to do."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.views.factory import make_result, make_results, make_survey, sigma_statistics
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.labeling.results import ContradictionMark, SessionResult, Summary
from vislam2tag.views.run_summary import (
    MOST_FINDINGS,
    TOGETHER,
    LandmarkTally,
    accuracy_sentence,
    counted_sessions,
    expected_error,
    joining_helps,
    problems,
    summarise,
)


@pytest.fixture
def results(tmp_path: Path) -> list[SessionResult]:
    return make_results(make_survey(tmp_path, plan=False))


def test_totals_are_the_sums_over_sessions(results: list[SessionResult]) -> None:
    summary = summarise(iter(results), "local", "1.2.3")
    assert (summary.version, summary.strategy, summary.sessions, summary.failed) == ("1.2.3", "local", 8, 1)
    assert (summary.unplaced, summary.mapped, counted_sessions(summary)) == (0, 7, "8 sessions (1 failed)")
    assert summary.duration_s == pytest.approx(sum(result.duration_s for result in results), abs=1e-3)
    assert summary.distance_m == pytest.approx(sum(result.distance_m for result in results), abs=1e-3)
    for status, count in summary.frames.items():
        assert count == sum(result.frames.get(status, 0) for result in results)
    assert sum(summary.frame_seconds.values()) == pytest.approx(summary.duration_s, abs=1e-2)
    assert summary.readings["wifi"]["ok"] == 7 * 1_800
    assert summary.findings["stale_wifi_rows"] == 8 * 140
    assert summary.failures == {results[-2].slug: results[-2].error}


def test_sessions_without_any_position_are_not_mapped(results: list[SessionResult]) -> None:
    results[0] = results[0].model_copy(update={"frames": {"too_short": 600}})
    summary = summarise(results, "smoother", "1")
    assert (summary.failed, summary.unplaced, summary.mapped) == (1, 1, 6)
    assert counted_sessions(summary) == "8 sessions (1 failed, 1 without a position)"


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


@pytest.fixture
def summary(tmp_path: Path) -> Summary:
    """One session whose landmark 3 contradicts the rest, with some time lost and some positions uncertain."""
    survey = make_survey(tmp_path, floors=1, sessions=1, plan=False)
    return summarise([make_result(survey.sessions[0])], "smoother", "1")


def test_the_expected_error_is_that_of_errors_drawn_with_the_sigmas() -> None:
    random = np.random.default_rng(3)
    sigma_m = random.lognormal(-1.8, 0.6, 20_000)
    drawn_m = np.linalg.norm(random.normal(size=(20_000, 2)) * sigma_m[:, None], axis=1)
    mean_m, p95_m = expected_error(sigma_statistics(sigma_m))
    assert mean_m == pytest.approx(drawn_m.mean(), rel=0.03)
    assert p95_m == pytest.approx(np.quantile(drawn_m, 0.95), rel=0.05)


def test_accuracy_is_told_as_expected_and_as_measured_and_hedged_by_contradictions(summary: Summary) -> None:
    told = accuracy_sentence(summary)
    assert told.startswith("The expected mean position error is 0.")
    assert "if the surveyed landmark positions are correct" in told
    assert "at 400 points with a known true position the mean error is 0." in told
    assert accuracy_sentence(summary.model_copy(update={"sigma": None, "errors": None})) == ""
    plain = accuracy_sentence(summary.model_copy(update={"contradictions": [], "errors": None}))
    assert "if landmarks" not in plain


def test_each_problem_names_its_place_and_what_to_do(summary: Summary) -> None:
    site = [
        Finding(kind="missing_plan", file="", count=1, message="only told", severity=Severity.INFO),
        Finding(kind="floor_without_size", file="floor_1/x.csv", count=1, message="no size; give width and height"),
    ]
    found = {problem.what: problem.todo for problem in problems(summary, site)}
    assert found["floor_1/x.csv: no size"] == "give width and height"
    assert not any("only told" in what for what in found)
    [landmark] = [what for what in found if what.startswith("landmark 3 on floor 1: 1 of ")]
    assert "2.00 m from its surveyed position" in landmark
    named = [one.model_copy(update={"room": "room 2.114"}) for one in summary.contradictions]
    whats = [one.what for one in problems(summary.model_copy(update={"contradictions": named}), site)]
    assert any(what.startswith("landmark 3 on floor 1 (room 2.114): 1 of ") for what in whats)
    assert found[landmark].startswith("measure it again")
    assert any("without a position: tracking lost" in what for what in found)
    assert any("are uncertain" in what for what in found)


def test_walks_that_were_mapped_each_alone_may_tell_one_another_where_they_were(summary: Summary) -> None:
    def todo(changed: Summary) -> str:
        [found] = [problem.todo for problem in problems(changed, ()) if "are uncertain" in problem.what]
        return found

    several = summary.model_copy(update={"sessions": 3})
    assert todo(several).startswith(f"{TOGETHER}, or add a landmark nearby")
    joined = several.model_copy(update={"findings": {**several.findings, "told_by_others": 1}})
    for other in (summary, joined, several.model_copy(update={"strategy": "local"})):
        assert todo(other).startswith("add a landmark nearby")
    unmapped = several.model_copy(update={"frame_seconds": {"ok": 50.0, "no_mapping": 60.0}})
    [advice] = [one.todo for one in problems(unmapped, ()) if "without a position" in one.what]
    assert advice == f"{TOGETHER}, or pass at least two landmarks on each walk"


def test_joining_helps_where_much_is_unsure(summary: Summary) -> None:
    several = summary.model_copy(update={"sessions": 3, "frames": {"ok": 80, "uncertain": 15, "no_mapping": 5}})
    assert joining_helps(several)
    assert not joining_helps(several.model_copy(update={"frames": {"ok": 92, "uncertain": 8}}))
    assert not joining_helps(several.model_copy(update={"frames": {"ok": 50, "tracking_lost": 50}}))
    assert not joining_helps(several.model_copy(update={"sessions": 1}))
    assert not joining_helps(several.model_copy(update={"frames": {"no_mapping": 100}})), "no walk has a landmark"
    assert joining_helps(several.model_copy(update={"frames": {"no_mapping": 90, "ambiguous": 10}})), "there is a plan"


def test_failures_come_first_and_long_lists_end(summary: Summary) -> None:
    site = [Finding(kind="encoding", file="f", count=1, message=str(number)) for number in range(MOST_FINDINGS + 2)]
    found = problems(summary.model_copy(update={"failed": 1}), site)
    assert found[0].what == "1 of 1 sessions could not be read or mapped"
    assert [one.what for one in found if "more findings" in one.what] == ["2 more findings about the site"]
