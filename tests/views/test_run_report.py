from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import escape

from tests.views.browser import own_part, tags_in_figures
from tests.views.factory import (
    START_NS,
    failed_result,
    make_result,
    make_results,
    make_survey,
    sigma_statistics,
    unplaced,
)
from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import UNFINISHED
from vislam2tag.common.findings import Finding
from vislam2tag.common.palette import EVENT_STYLES, STATUS_STYLES
from vislam2tag.core.status import STATUS_LABELS
from vislam2tag.labeling.results import Drawing, SessionResult, Stretch
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.quality.evaluation.reliability import CoverageCurve, ReliabilityCurve, reduce_errors
from vislam2tag.quality.evaluation.truth import CONTROL_POINTS
from vislam2tag.settings import Settings
from vislam2tag.site.model import Floor, SessionKey, Survey
from vislam2tag.views.run_report import floor_view, write_report
from vislam2tag.views.run_summary import summarise
from vislam2tag.views.uncertainty import coverage_figure, reliability_figure

EVIL = "</script><script>alert(1)</script><!--\"'&amp;"
"""Text that must stay text wherever it lands."""


def written(folder: Path, survey: Survey, results: list[SessionResult], settings: Settings | None = None) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    out_file = folder / "report.html"
    summary = summarise(results, "local-corrected", "0.1.0")
    write_report(out_file, survey, settings or Settings(), iter(results), summary)
    assert [path.name for path in folder.iterdir()] == ["report.html"]
    return out_file.read_text(encoding="utf-8")


def page_of_one(folder: Path, settings: Settings | None = None, **changes: object) -> str:
    """The own part of a page about one session, changed."""
    survey = make_survey(folder, floors=1, sessions=1, plan=False)
    result = make_result(survey.sessions[0]).model_copy(update=changes)
    return own_part(written(folder / "out", survey, [result], settings))


def test_page_names_every_session_landmark_visit_and_cause(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "Town hall")
    page = written(tmp_path / "out", survey, make_results(survey))
    assert page.startswith("<!DOCTYPE html>")
    assert page.rstrip().endswith("</html>")
    assert "<title>Survey report: Town hall</title>" in page
    for ref in survey.sessions:
        assert f'<tbody id="session-{ref.slug}"' in page
    assert "7 of 8 sessions could be mapped" in page
    assert page.count('class="failed"') == 1
    assert "poses.csv: empty; expected one pose a line" in page
    for label in STATUS_LABELS:
        assert escape(STATUS_STYLES[label].meaning) in page
    for text in (
        "Floor 1",
        "Floor 2",
        "42\u00a0ms",
        "throttled by the phone",
        "corrections.toml, line 4",
        "missing plan",
    ):
        assert text in page
    assert "mapping.visit_radius_m" in page


def test_a_failure_names_its_session_once(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1, plan=False)
    key = survey.sessions[0].key
    page = own_part(written(tmp_path / "out", survey, [failed_result(survey.sessions[0], f"{key}: no frames")]))
    assert f"{key}</a>: no frames</li>" in page


def test_nothing_is_loaded_from_outside(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    page = own_part(written(tmp_path / "out", survey, make_results(survey)))
    assert not re.findall(r'(?:src|href)="(?!#)', page)
    assert "http" not in page


def test_equal_input_gives_equal_bytes(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey")
    first = written(tmp_path / "a", survey, make_results(survey))
    assert first == written(tmp_path / "b", survey, make_results(survey))


def evil_results(survey: Survey) -> list[SessionResult]:
    finding = Finding(kind=EVIL, file=EVIL, count=1, message=EVIL)
    good = make_result(survey.sessions[0]).model_copy(
        update={"findings": [finding], "corrections": [EVIL], "landmarks_logged": [EVIL], "format": EVIL}
    )
    good = good.model_copy(
        update={
            "visits": [visit.model_copy(update={"landmark": EVIL}) for visit in good.visits],
            "files": [file.model_copy(update={"name": EVIL, "role": EVIL}) for file in good.files],
            "contradictions": [mark.model_copy(update={"landmark": EVIL}) for mark in good.contradictions],
            "readings": {EVIL: {"ok": 1}},
        }
    )
    return [good, failed_result(survey.sessions[1], EVIL)]


def test_text_of_the_users_stays_text(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=2, plan=False)
    refs = tuple(replace(ref, key=SessionKey(1, EVIL, f"{EVIL}{index}")) for index, ref in enumerate(survey.sessions))
    landmarks = replace(survey.site.landmarks, ids=tuple(EVIL + landmark for landmark in survey.site.landmarks.ids))
    floors = tuple(replace(floor, name=EVIL) for floor in survey.site.floors)
    site = replace(survey.site, landmarks=landmarks, floors=floors)
    finding = Finding(kind=EVIL, file=EVIL, count=1, message=EVIL)
    survey = replace(survey, sessions=refs, site=site, findings=(finding,))
    page = own_part(written(tmp_path / "out", survey, evil_results(survey)))
    assert "<script>alert" not in page
    assert "<!--" not in page
    assert not tags_in_figures(page)
    data = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL)
    assert len(data) == 2 + 1 + 2 + 1
    parts = [part for part in map(json.loads, data) if "name" in part]
    assert parts[0]["name"] == f"{EVIL} / {EVIL}0"


def test_broken_bytes_in_a_folder_name_do_not_stop_the_report(tmp_path: Path) -> None:
    assert "caf?" in page_of_one(tmp_path, session="caf\udce9")


def test_an_empty_run_and_a_bare_site_have_a_page(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1, plan=False)
    assert "This run contains no sessions." in written(tmp_path / "a", survey, [])
    floor = replace(survey.site.floors[0], width_m=None, height_m=None)
    bare = replace(survey, site=replace(survey.site, floors=(floor,)), findings=())
    assert "Floor 1" in written(tmp_path / "b", bare, make_results(bare))


def test_sessions_pass_one_at_a_time(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    results = make_results(survey)
    sizes = []

    def watched() -> Iterator[SessionResult]:
        for result in results:
            (page,) = filter(lambda path: UNFINISHED.fullmatch(path.name), tmp_path.iterdir())
            sizes.append(page.stat().st_size)
            yield result

    write_report(tmp_path / "out.html", survey, Settings(), watched(), summarise(results, "local", "1"))
    assert len(sizes) == len(results)
    assert sizes[-1] > sizes[0]


def test_a_failing_run_leaves_the_old_page(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    results = make_results(survey)
    old = written(tmp_path / "out", survey, results)

    def broken() -> Iterable[SessionResult]:
        yield results[0]
        raise RuntimeError("cut")

    out_file = tmp_path / "out" / "report.html"
    with pytest.raises(RuntimeError, match="cut"):
        write_report(out_file, survey, Settings(), broken(), summarise(results, "local", "1"))
    assert out_file.read_text(encoding="utf-8") == old
    assert [path.name for path in out_file.parent.iterdir()] == ["report.html"]


def test_an_unwritable_place_is_an_output_error(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    with pytest.raises(OutputError, match=r"missing.*report\.html"):
        write_report(tmp_path / "missing" / "report.html", survey, Settings(), [], summarise([], "local", "1"))


def test_a_hundred_sessions_fit_in_twenty_megabytes(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=5, sessions=100)
    results = make_results(survey, points=1_500)
    assert len(written(tmp_path / "out", survey, results).encode()) < 20e6


def test_a_session_without_drawing_still_has_its_row(tmp_path: Path) -> None:
    nothing = Drawing(mapped=[Stretch(status="ok", points=[])], discarded=[], raw=[], wifi=[])
    assert '<tbody id="session-' in page_of_one(tmp_path, drawing=nothing, visits=[], readings={})


def test_uncertainty_errors_events_and_contradictions_are_told(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    results = make_results(survey)
    page = own_part(written(tmp_path / "out", survey, results))
    summary = summarise(results, "smoother", "1")
    assert summary.sigma is not None
    assert f"<b>{summary.sigma.median_m:.2f}\u00a0m</b> median sigma of the frames" in page
    assert "(sigma above 0.5 m): they keep their position" in page
    assert "Ground truth exists at 2\u202f800 points (truth.csv: 7 sessions)" in page
    assert "of the errors are inside the predicted 68 % region" in page
    assert page.count('class="plot chart"') == 2
    assert "2 of 4 sessions that logged it" in page
    assert page.count('<td class="head">Error</td>') == page.count('<td class="head">Sigma</td>') == 7
    for style in EVENT_STYLES.values():
        assert escape(style.meaning) in page
        also_a_cause = style.name == "break"
        assert page.count(f"</i>{style.name}</td>") == 1 + 7 + also_a_cause
    assert "no-truth" not in page


def test_without_truth_the_page_says_so_and_what_to_do(tmp_path: Path) -> None:
    page = page_of_one(tmp_path, errors=None)
    assert "No label was compared with ground truth" in page
    assert "<code>vislam2tag check SURVEY</code>" in page
    assert 'class="plot chart"' not in page


def test_a_strategy_without_uncertainty_is_told_with_its_errors(tmp_path: Path) -> None:
    errors = reduce_errors(
        "truth.csv", np.array([[3.0, 4.0], [0.0, 1.0]]), np.full((2, 2, 2), np.nan), np.zeros((2, 2, 2))
    )
    page = page_of_one(tmp_path, sigma=None, errors=errors, events=[], contradictions=[])
    assert "The strategy local-corrected does not estimate uncertainty." in page
    assert "Their mean error is <b>3.00\u00a0m</b>" in page
    for absent in ('class="plot chart"', "median sigma", "Contradictory landmarks", "Tracker events"):
        assert absent not in page


def test_errors_at_control_points_are_told_to_be_small(tmp_path: Path) -> None:
    for source, told in ((CONTROL_POINTS, True), ("truth.csv", False)):
        errors = reduce_errors(source, np.ones((5, 2)), np.repeat(np.eye(2)[None], 5, axis=0), np.zeros((5, 2, 2)))
        page = page_of_one(tmp_path / source, errors=errors)
        assert f"({source}: 1 session)" in page
        assert ("the nearest control point" in page) is told


def test_uncertain_time_is_not_lost_time(tmp_path: Path) -> None:
    page = page_of_one(tmp_path, frame_seconds={"ok": 60.0, "uncertain": 30.0, "gap": 10.0})
    assert "60\u00a0% of the walking time has a position and another 30\u00a0% an uncertain one." in page
    assert "10.0\u00a0s (10\u00a0% of the time) without a position: gap" in page


@pytest.mark.parametrize(
    ("reason", "start_ns", "todo"),
    [
        ("ambiguous", START_NS, "In the studio, tap the plan where the walk was at 2:10."),
        ("ambiguous", None, "Tap one known place on the plan, or walk longer through rooms and corridors."),
        ("fits_nowhere", START_NS, "Check the plan, its scale and the floor of the session."),
    ],
)
def test_a_session_that_is_not_placed_is_named_with_the_reason_and_what_helps(
    tmp_path: Path, reason: str, start_ns: int | None, todo: str
) -> None:
    seconds = {reason: 200.0}
    frames = {reason: 6000}
    page = page_of_one(tmp_path, placing=unplaced(reason), frames=frames, frame_seconds=seconds, start_ns=start_ns)
    style = STATUS_STYLES[reason]
    assert f'<span class="warning">not placed: {style.name}</span>' in page
    assert f"<b>Not placed on the plan.</b> {escape(style.meaning)} What helps: {todo[0].lower()}{todo[1:]}" in page
    listed = page.partition('id="unplaced"')[2].partition("</div>")[0]
    assert f'</a>: {style.name}. <b class="todo">{todo}</b>' in listed
    assert "0 of 1 sessions could be mapped, and 1 without errors have no position; none of the walking time" in page


def test_a_session_that_is_placed_in_part_is_not_among_those_that_are_not(tmp_path: Path) -> None:
    assert "unplaced" not in page_of_one(tmp_path, placing=unplaced("ok"))


def test_without_a_limit_nothing_is_uncertain_and_the_page_says_why(tmp_path: Path) -> None:
    settings = Settings(labels=LabelSettings(max_sigma_m=float("inf")))
    page = page_of_one(tmp_path, settings, sigma=sigma_statistics(np.array([0.2, 3.0]), float("inf")))
    assert "None is <i>uncertain</i>: no limit is set." in page


def test_a_floor_that_walks_only_led_to_has_its_map(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    other = Drawing(mapped=[Stretch(status="ok", points=[(5.0, 6.0)])])
    results = [
        result.model_copy(update={"elsewhere": {2: other}}) for result in make_results(survey) if result.floor == 1
    ]
    page = written(tmp_path, survey, results)
    assert page.count('class="part" data-floor="2"') == len(results)
    assert '<section class="floor" id="floor-2">' in page
    assert "No session starts on this floor, but walks from other floors visit it." in page
    assert 'Floors walked</td><td class="text">1, 2</td>' in page
    assert '<section class="floor" id="floor-2">' not in written(
        tmp_path, survey, [result.model_copy(update={"elsewhere": {}}) for result in results]
    )


def view_of(survey: Survey, floor: Floor | None = None) -> dict[str, Any]:
    return floor_view(floor or survey.site.floors[0], survey.site.landmarks, iter(()))


def test_a_floor_with_its_plan_needs_no_note(tmp_path: Path) -> None:
    view = view_of(make_survey(tmp_path, floors=1, sessions=1))
    assert view["notes"] == []
    assert "images" in json.loads(view["figure"])["layout"]
    assert view["unplaced"] == ["7", "8"]


@pytest.mark.parametrize("content", [b"", b"<html>", b"\xff\xd8\xff\xe0half a JPEG"])
def test_a_plan_that_is_no_image_is_said(tmp_path: Path, content: bytes) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1)
    plan = survey.site.floors[0].plan
    assert plan is not None
    plan.write_bytes(content)
    view = view_of(survey)
    assert view["notes"] == ["floorplan.jpg cannot be read as an image; the map shows a grid instead."]
    assert "images" not in json.loads(view["figure"])["layout"]


def test_a_missing_plan_and_a_plan_of_unknown_size_are_said(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1)
    floor = survey.site.floors[0]
    assert view_of(survey, replace(floor, plan=None))["notes"] == [
        "This floor has no plan; the map shows a grid instead."
    ]
    view = view_of(survey, replace(floor, width_m=None))
    assert view["notes"] == [
        "floorplan.jpg is not shown because no file gives the floor's size; the map shows a grid instead."
    ]
    assert "images" not in json.loads(view["figure"])["layout"]


def test_surveyed_landmarks_outside_the_plan_are_named(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=2, sessions=2)
    position = survey.site.landmarks.position_bcs
    for landmark, place in {0: (-38, 5), 2: (5, 43.5), 3: (84.5, -0.5), 6: (-9, 9), 8: (-9, 9)}.items():
        position[landmark] = place
    (note,) = view_of(survey)["notes"]
    assert note == "Surveyed landmarks outside the plan of 84 m x 42 m: 1, 3. Check their positions or its size."


COVERAGE = CoverageCurve(
    np.array([np.nan, 0.1, 0.4, 0.8]), np.array([0.1, 0.5, 0.8, 0.9]), np.array([1.0, 0.5, 0.6, 0.7]), np.full(4, 2.0)
)


def test_reliability_stands_against_the_diagonal() -> None:
    curve = ReliabilityCurve(np.arange(1, 100) / 100, np.linspace(0, 1, 99), 50)
    diagonal, labels = json.loads(reliability_figure(curve))["data"]
    assert diagonal["x"] == diagonal["y"] == [0, 100]
    assert labels["x"] == list(range(1, 100))
    assert labels["y"][49] == pytest.approx(50)


@pytest.mark.parametrize(("limit_m", "at"), [(0.5, [80.0]), (0.05, [10.0]), (9.0, [90.0]), (float("inf"), [])])
def test_coverage_marks_the_limit_that_is_set(limit_m: float, at: list[float]) -> None:
    figure = json.loads(coverage_figure(COVERAGE, limit_m))
    mean, p95 = figure["data"]
    assert mean["x"] == p95["x"] == [10, 50, 80, 90]
    assert (mean["y"], p95["y"]) == ([1.0, 0.5, 0.6, 0.7], [2.0] * 4)
    assert mean["hovertext"][:2] == ["no sigma", "sigma up to 0.10 m"]
    assert [shape["x0"] for shape in figure["layout"].get("shapes", [])] == at
