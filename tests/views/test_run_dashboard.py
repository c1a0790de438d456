from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.views.factory import make_results, make_survey
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_parquet
from vislam2tag.labeling.results import Summary
from vislam2tag.quality.self_check_record import FloorCheck, ProposedPlace, SurveyCheck
from vislam2tag.site.model import Survey
from vislam2tag.site.walkable.walked import WalkedFloor
from vislam2tag.views.run_dashboard import MOST_TASKS, Page, RunFigures, changes, expected_errors, write_dashboard
from vislam2tag.views.run_summary import summarise

PAGES = {name: Page(f"{name}/page.html", name, "about it") for name in ("report", "conflicts", "check", "dataset")}
PLACE = ProposedPlace(x_m=3.0, y_m=4.0, near="", gain_m=0.05)
CHECK = SurveyCheck(
    version="1",
    max_sigma_m=0.5,
    sessions=[],
    floors=[FloorCheck(number=1, frames=300, expected_m=0.2, places=[PLACE])],
    bad_landmarks=[],
    walked=[WalkedFloor(number=1, walkable_m2=100.0, walked=0.8), WalkedFloor(number=2, note="not known")],
)


def table_of(folder: Path, name: str, sigma: list[float | None]) -> Path:
    """Frames along x from 0.5 m on, one metre apart."""
    x = [0.5 + number for number in range(len(sigma))]
    schema = {"floor": pl.Int32, "x": pl.Float64, "y": pl.Float64, "sigma": pl.Float64}
    frames = pl.DataFrame({"floor": [1] * len(x), "x": x, "y": [2.5] * len(x), "sigma": sigma}, schema=schema)
    (folder / "trajectory").mkdir(parents=True, exist_ok=True)
    write_parquet(frames, Folder.at(folder / "trajectory"), f"{name}.parquet")
    return folder / "trajectory" / f"{name}.parquet"


def page_of(tmp_path: Path, survey: Survey, summary: Summary, *faults: str, **before: object) -> str:
    figures = RunFigures.of(summary, CHECK, faults)
    last = figures.model_copy(update=before) if before else None
    write_dashboard(tmp_path / "index.html", survey, tmp_path / "labels", (summary, CHECK, faults), last, PAGES)
    text = re.sub(r"<script.*?</script>", "", (tmp_path / "index.html").read_text(), flags=re.S)
    return text.replace("\N{NO-BREAK SPACE}", " ")


def totals(survey: Survey, *, whole: bool) -> Summary:
    """Of generated walks, of which one failed; or of whole ones without a problem."""
    results = make_results(survey)
    summary = summarise(results, "smoother", "1")
    if not whole:
        return summary
    clean = {"failed": 0, "failures": {}, "contradictions": [], "sigma": None, "frame_seconds": {"ok": 60.0}}
    return summary.model_copy(update=clean)


def test_errors_of_a_square_are_those_of_all_walks_through_it(tmp_path: Path) -> None:
    files = [table_of(tmp_path, "a", [0.1, 0.3, None]), table_of(tmp_path, "b", [0.3, math.nan])]
    found = expected_errors(files)
    assert found.select("floor", "column", "row").rows() == [(1, 0, 2), (1, 1, 2)]
    assert found["error_m"].to_list() == pytest.approx([0.2 * np.sqrt(np.pi / 2), 0.3 * np.sqrt(np.pi / 2)])
    assert expected_errors([]).is_empty()


def test_only_what_differs_is_a_change() -> None:
    before = RunFigures(sessions=2, failed=0, labelled=0.5, expected_m={0: 0.31}, walked={0: 0.4}, faults=3)
    now = RunFigures(sessions=4, failed=0, labelled=0.912, expected_m={0: 0.31, 1: 0.2}, walked={0: 0.4}, faults=0)
    found = [[text.replace("\N{NO-BREAK SPACE}", " ") for text in row] for row in changes(before, now)]
    assert found == [
        ["walks", "2", "4"],
        ["labelled camera frames", "50 %", "91 %"],
        ["faults", "3", "0"],
        ["expected error on floor 1", "–", "0.20 m"],
    ]
    assert list(changes(now, now)) == []


def test_faults_come_first_and_three_things_are_listed(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "campus")
    page = page_of(tmp_path, survey, totals(survey, whole=False), "landmarks 2 and 9 are interchanged", "more")
    tasks = re.findall(r"<li>(.*?)</li>", page.partition("What to do next")[2].partition("</ol>")[0], re.S)
    assert len(tasks) == MOST_TASKS
    assert "landmarks 2 and 9 are interchanged (and 1 more)" in tasks[0]
    assert "vislam2tag studio campus" in tasks[0]
    assert not any("observe it" in task for task in tasks), "the faults explain the contradictions"
    assert 'href="report/page.html#failures"' in tasks[1]


def test_a_survey_without_problems_is_extended_and_used(tmp_path: Path) -> None:
    survey = replace(make_survey(tmp_path / "campus"), findings=())
    page = page_of(tmp_path, survey, totals(survey, whole=True))
    assert "Add a landmark on floor 1: the expected error decreases by 0.05 m." in page
    assert "vislam2tag train dataset" in page
    assert all(f'href="{name}/page.html"' in page for name in PAGES)
    assert "Changes since" not in page
    assert "Changes since" in page_of(tmp_path, survey, totals(survey, whole=True), sessions=1)


def test_each_floor_has_its_map_and_coverage(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "campus")
    table_of(tmp_path / "labels", survey.sessions[0].slug, [0.1, 0.2])
    page = page_of(tmp_path, survey, totals(survey, whole=False))
    assert re.findall(r'aria-label="(Map of floor \d)"', page) == ["Map of floor 1", "Map of floor 2"]
    assert "Walked: <b>80 %</b> of 100 m²" in page
    assert "No walk has a position on this floor." in page
    assert '"expected error"' in (tmp_path / "index.html").read_text()
