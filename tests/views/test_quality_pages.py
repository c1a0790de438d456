"""The pages of a check and of an evaluation: what they say and draw."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.quality.evaluation.test_metrics import session, walk
from tests.site.site import write_survey
from tests.views.browser import own_part, tags_in_figures
from vislam2tag.common.findings import Finding
from vislam2tag.quality.evaluation.metrics import table_rows
from vislam2tag.quality.evaluation.record import DenseRow, SurveyEvaluation
from vislam2tag.quality.landmark_gain import GainMap, session_gains
from vislam2tag.quality.self_check_record import BadLandmark, Fault, LeftOutMark, SessionCheck, SurveyCheck
from vislam2tag.sessions.registry import open_survey
from vislam2tag.views.quality_pages import median_left_out_m, ranking, write_check_page, write_evaluation_page

MARK = LeftOutMark(
    floor=1,
    landmark="A<b>",
    passes=2,
    surveyed_m=(3.0, 4.0),
    offset_m=(0.3, -0.4),
    covariance_m2=(0.04, 0.0, 0.04),
    survey_covariance_m2=(4e-4, 0.0, 4e-4),
)
GOOD = SessionCheck(
    slug="a",
    floor=1,
    device="LG",
    session="first",
    landmarks=3,
    left_out=[MARK],
    frames=1000,
    labelled=900,
    stated_m=0.2,
    estimated_m=0.25,
    low_m=0.1,
    high_m=0.6,
)
FAILED = SessionCheck(slug="b", floor=1, device="LG", session="second", error="floor 1 / LG / second: no <poses>")
BAD = BadLandmark(
    floor=1,
    landmark="A<b>",
    fault=Fault.OFFSET,
    sessions=4,
    surveyed_m=(3.0, 4.0),
    offset_m=(0.3, -0.4),
    size_m=0.5,
    sigma_m=0.05,
)


def gain_map() -> GainMap:
    gains = GainMap()
    found = {(1, 2, 3): 1.0, (1, 4, 3): 5.0, (1, 20, 9): 3.0}
    gains.add(session_gains(found, 1.0, np.ones(100, dtype=np.int64), np.full(100, 0.3)))
    return gains


def write_page_of_a_check(folder: Path) -> Path:
    survey = open_survey(write_survey(folder / "survey"), 0.02)
    gains = gain_map()
    check = SurveyCheck(
        version="1",
        max_sigma_m=0.5,
        sessions=[GOOD, FAILED],
        floors=gains.floors(survey.site.landmarks),
        bad_landmarks=[BAD],
    )
    write_check_page(folder / "check.html", survey, check, gains, {})
    return folder / "check.html"


@pytest.fixture
def check_page(tmp_path: Path) -> str:
    return write_page_of_a_check(tmp_path).read_text("utf-8")


def traces(check_page: str) -> dict[str, dict[str, Any]]:
    (figure,) = re.findall(r'<script type="application/json">(.*?)</script>', check_page)
    return {trace["name"]: trace for trace in json.loads(figure)["data"]}


def test_the_page_needs_nothing_else_and_escapes_names(check_page: str) -> None:
    body = own_part(check_page)
    assert not re.search(r'(?:src|href)="', body)
    assert "A&lt;b&gt;" in body
    assert "no &lt;poses&gt;" in body
    assert "A<b>" not in body
    assert not tags_in_figures(check_page)


def test_tables_tell_accuracy_bad_landmarks_and_places(check_page: str) -> None:
    text = re.sub(r"\s+", " ", own_part(check_page))
    for wanted in (
        "(0.25 m)",
        "0.10 to 0.60 m",
        "measure it again",
        "(4.5, 3.5): to 0.25 m",
        "(20.5, 9.5): to 0.27 m",
        "Expected mean position error: <b>0.30 m</b>",
    ):
        assert wanted in text.replace("\u00a0", " ").replace("\u202f", " ")


def test_the_map_shows_gains_left_out_errors_and_places(check_page: str) -> None:
    drawn = traces(check_page)
    gains = drawn["gain of one more landmark"]
    assert gains["z"][0][:3] == [1.0, None, 5.0]
    assert gains["x"][0] == 2.5
    assert gains["z"][6][18] == 3.0
    for name in ("left-out error", "bad landmark"):
        assert drawn[name]["x"][:2] == [3.0, 3.3]
        assert drawn[name]["y"][:2] == [4.0, 3.6]
    assert drawn["one more landmark"]["x"] == [4.5, 20.5]


def test_median_of_left_out_errors() -> None:
    assert median_left_out_m(GOOD) == pytest.approx(0.5)
    assert median_left_out_m(FAILED) is None


def evaluation() -> SurveyEvaluation:
    """Six walks on two floors, one of which failed."""
    rng = np.random.default_rng(4)
    sessions = [
        session(
            f"walk <{number}>",
            walk(rng.gamma(2.0, 0.2, 30)),
            walk(rng.gamma(2.0, 0.1, 30), "smoother"),
            floor=number % 2,
            movement_m=0.1 * number,
            faulty=number == 3,
        )
        for number in range(6)
    ]
    finding = Finding(kind="ambiguous_presses", file="", count=2, message="presses nobody <knows>")
    sessions.append(session("bad", error="floor 1 / LG / bad: no <poses>"))
    sessions[0] = sessions[0].model_copy(update={"findings": [finding], "estimates": {"lead_s": 0.123}})
    along = [DenseRow(strategy="smoother", what="since landmark", low=0, high=5, points=9, mean_m=0.2, labelled=1)]
    return SurveyEvaluation(
        version="1.2.3",
        strategies=["local", "smoother"],
        max_sigma_m=0.5,
        rows=table_rows(sessions),
        dense=along,
        drift={"local": None, "smoother": 0.0123},
        retention={"local": 1.0, "smoother": 0.97},
        sessions=sessions,
    )


@pytest.fixture
def evaluation_page(tmp_path: Path) -> str:
    write_evaluation_page(tmp_path / "report.html", "A <survey>", evaluation())
    return (tmp_path / "report.html").read_text(encoding="utf-8")


def figures(evaluation_page: str) -> list[dict[str, Any]]:
    return [
        json.loads(text)
        for text in re.findall(r'<script type="application/json">(.*?)</script>', evaluation_page, re.DOTALL)
    ]


def test_the_page_says_what_was_found(evaluation_page: str) -> None:
    for text in (
        "A &lt;survey&gt;",
        "7 sessions (1 failed)",
        "Errors against control points",
        "Best strategy: <b>smoother</b>",
        "97\u00a0%",
        "1.23\u00a0cm (smoother)",
        "– (local)",
        "floor 0 / LG / walk &lt;0&gt;",
        "no &lt;poses&gt;",
        "2 presses nobody &lt;knows&gt;",
        "<code>lead_s</code> 0.123",
        "faulty</span>",
        "Errors by floor and device",
    ):
        assert text in evaluation_page, text


def test_hover_labels_hold_names_as_text(evaluation_page: str) -> None:
    assert not tags_in_figures(evaluation_page)


def test_the_page_of_an_evaluation_needs_nothing_else(evaluation_page: str) -> None:
    markup = re.sub(r"<script>.*?</script>", "", evaluation_page, flags=re.DOTALL)  # Plotly's own text names addresses
    assert not re.findall(r'(?:src|href)="(?!data:|#)[^"]+"', markup)


def test_curves_have_bands_and_end_at_the_share_labelled(evaluation_page: str) -> None:
    curves, movement, way = figures(evaluation_page)
    lines = [trace for trace in curves["data"] if trace["mode"] == "lines"]
    assert [trace["name"] for trace in lines] == ["local", "smoother"]
    assert [trace["y"][-1] for trace in lines] == [1, 1]
    assert sum(trace.get("fill") == "toself" for trace in curves["data"]) == 2
    assert movement["data"][0]["x"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert "&lt;0&gt;" in movement["data"][0]["text"][0]
    assert way["data"][0]["x"] == ["0 to 5"]


def test_equal_evaluations_give_equal_bytes(evaluation_page: str, tmp_path: Path) -> None:
    write_evaluation_page(tmp_path / "again.html", "A <survey>", evaluation())
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == evaluation_page


def test_the_best_labels_most_of_what_any_does_and_has_the_smallest_error() -> None:
    half = np.where(np.arange(30) < 15, 0.01, np.nan)
    sessions = [
        session(str(n), walk(np.full(30, 0.3)), walk(np.full(30, 0.2), "smoother"), walk(half, "few")) for n in (1, 2)
    ]
    assert [row.strategy for row in ranking(table_rows(sessions))] == ["smoother", "local", "few"]
    assert ranking([]) == []
