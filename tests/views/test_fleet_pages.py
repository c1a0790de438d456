"""The tree of pages about a fleet: small however large it is, and each leads to the next."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from tests.views.factory import make_results, make_survey
from vislam2tag.labeling.results import Drawing, SessionResult, Stretch
from vislam2tag.views.fleet_pages import ROWS, fleet_pages, session_page, survey_pages
from vislam2tag.views.run_summary import summarise

MOST_BYTES = 2_000_000
LONG = "a-name-as-long-as-anybody-gives-to-a-survey-of-a-hospital"


def write_fleet_page(folder: Path) -> Path:
    """The first page about a fleet of three surveys."""
    rows = [surveyed(number, state) for number, state in enumerate(("done", "failed", "new"))]
    (folder / "page.html").write_text(next(fleet_pages("fleet", totals(rows), rows))[1], encoding="utf-8")
    return folder / "page.html"


def write_session_page(folder: Path) -> Path:
    survey = make_survey(folder / "survey")
    (folder / "page.html").write_text(session_page(survey, make_results(survey)[0]), encoding="utf-8")
    return folder / "page.html"


def surveyed(number: int, state: str = "done") -> dict[str, object]:
    """A survey's row of the catalogue."""
    counts = {"sessions": 120_000, "failed": 1, "frames": 10, "frames_labelled": 9, "distance_m": 120_345.0}
    texts = {"survey": f"{LONG}-{number}", "site": f"{LONG} {number}", "state": state, "labels": "key"}
    return texts | counts | {"floors": [1, 2], "devices": ["LG"] * 9, "first_date": None, "last_date": None}


def totals(rows: list[dict[str, object]]) -> dict[str, object]:
    counts = {"surveys": len(rows), "sessions": 7, "failed": 1, "frames": 10, "frames_labelled": 9}
    return counts | {"distance_m": 3.0, "states": {"done": 3}}


def test_no_page_grows_with_the_fleet() -> None:
    rows = [surveyed(number) for number in range(3 * ROWS + 1)]
    pages = dict(fleet_pages("fleet", totals(rows), rows))
    assert list(pages) == ["index.html", "index_2.html", "index_3.html", "index_4.html"]
    assert max(len(text.encode()) for text in pages.values()) < MOST_BYTES
    assert set(re.findall(r'href="(index[^"]*)"', pages["index.html"])) == pages.keys() - {"index.html"}
    linked = [name for text in pages.values() for name in re.findall(r'href="([^"]*)/index.html"', text)]
    assert linked == [str(row["survey"]) for row in rows]


def test_no_page_grows_with_a_survey(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    results = make_results(survey)
    row = {
        "slug": LONG,
        "session": LONG,
        "device": LONG,
        "error": "no",
        "floor": 1,
        "duration_s": 1.0,
        "distance_m": 2.0,
    }
    row |= {"labelled_share": 0.5, "sigma_median_m": None, "wifi_scans": 1, "visits": 1, "findings": 1}
    pages = dict(survey_pages(survey, summarise(results, "smoother", "1"), [row] * (ROWS + 1)))
    assert list(pages) == ["index.html", "index_2.html"]
    assert max(len(text.encode()) for text in pages.values()) < MOST_BYTES
    assert 'href="../index.html"' in pages["index_2.html"]
    assert f'href="../../labels/{survey.root.name}/report.html"' in pages["index.html"]


def test_no_page_grows_with_a_session(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    result = make_results(survey)[0]
    points = [(float(x), float(y)) for x, y in np.random.default_rng(1).uniform(0, 900, (300_000, 2))]
    drawing = Drawing(mapped=[Stretch(status="ok", points=points)])
    long = result.model_copy(update={"drawing": drawing, "findings": result.findings * 2000})
    text = session_page(survey, long)
    assert len(text.encode()) < MOST_BYTES
    assert "more findings" in text
    assert drawn(text) > 4000


def test_a_session_that_could_not_be_read_says_why(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", plan=False)
    failed: SessionResult = make_results(survey)[-2]
    text = session_page(survey, failed)
    assert "poses.csv: empty; expected one pose a line" in text
    assert drawn(text) == 0


def drawn(page: str) -> int:
    """Points of the lines on a page."""
    return sum(len(points.split()) for points in re.findall(r'<polyline points="([^"]*)"', page))
