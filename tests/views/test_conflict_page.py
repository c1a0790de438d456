"""The page of conflicts: what it names and draws."""

from __future__ import annotations

import json
import re
from pathlib import Path

from tests.site.site import write_survey
from tests.views.browser import own_part, tags_in_figures
from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.quality.diagnosis.record import OddReference, Reference, References
from vislam2tag.sessions.registry import open_survey
from vislam2tag.views.conflict_page import write_conflict_page

ODD = Reference(
    floor=1,
    landmark="A<b>",
    session="floor 1 / LG / first",
    verdict=Verdict.CONTRADICTS,
    x_m=3.0,
    y_m=4.0,
    offset_m=(0.3, -0.4),
    size_m=0.5,
    sigma_m=0.05,
)
AGREES = Reference(
    floor=1,
    landmark="A<b>",
    verdict=Verdict.AGREES,
    x_m=3.0,
    y_m=4.0,
    offset_m=(0.01, 0.0),
    size_m=0.01,
    sigma_m=0.1,
)
ALONE = Reference(floor=1, landmark="C", verdict=Verdict.NOTHING, x_m=6.0, y_m=1.0)
FOUND = References(
    odd=(OddReference(culprit="first, A<b>", summary="it hung <elsewhere>", references=(ODD,)),),
    compared=(ODD, AGREES, ALONE),
)


def write_page_of_conflicts(folder: Path, found: References = FOUND) -> Path:
    survey = open_survey(write_survey(folder / "survey"), 0.02)
    write_conflict_page(folder / "conflicts.html", survey, found)
    return folder / "conflicts.html"


def test_the_odd_one_out_is_named_and_drawn_from_where_the_others_have_it(tmp_path: Path) -> None:
    page = write_page_of_conflicts(tmp_path).read_text("utf-8")
    body = own_part(page).replace("\u00a0", " ").replace("\u202f", " ")
    assert "Check <b>1</b> measurement. 1 of 3 measurements agree; 1 could not be compared." in body
    assert "it hung &lt;elsewhere&gt;" in body
    assert "A<b>" not in body
    assert not tags_in_figures(page)
    (figure,) = re.findall(r'<script type="application/json">(.*?)</script>', page)
    drawn = {trace["name"]: trace for trace in json.loads(figure)["data"]}
    assert drawn["contradicts"]["x"][:2] == [3.0, 3.3]
    assert drawn["contradicts"]["y"][:2] == [4.0, 3.6]
    assert drawn["agree"]["hovertext"] == ["landmark A&lt;b&gt;: 1 agree, 1 contradict"]
    assert (drawn["not compared"]["x"], drawn["not compared"]["y"]) == ([6.0], [1.0])


def test_a_survey_without_walks_that_are_tied_says_so(tmp_path: Path) -> None:
    page = write_page_of_conflicts(tmp_path, References()).read_text("utf-8")
    assert "nothing can be compared" in own_part(page)
