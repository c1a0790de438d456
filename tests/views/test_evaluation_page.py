"""The page of an evaluation: what it says and draws."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.quality.evaluation.test_metrics import session, walk
from tests.views.browser import tags_in_figures
from vislam2tag.common.findings import Finding
from vislam2tag.quality.evaluation.metrics import table_rows
from vislam2tag.quality.evaluation.record import DenseRow, SurveyEvaluation
from vislam2tag.views.evaluation_page import ranking, write_evaluation_page


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
        "Against the whole true path",
        "Best here: <b>smoother</b>",
        "97\u00a0%",
        "1.23\u00a0cm (smoother)",
        "– (local)",
        "floor 0 / LG / walk &lt;0&gt;",
        "no &lt;poses&gt;",
        "2 presses nobody &lt;knows&gt;",
        "<code>lead_s</code> 0.123",
        "faulty</span>",
        "By floor and device",
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
