"""What all pages have in common: one layout, and the plotting library packed at their end."""

from __future__ import annotations

import base64
import gzip
import re
from importlib import resources
from pathlib import Path

import pytest
from plotly.offline import get_plotlyjs

from tests.views.factory import make_results, make_survey
from vislam2tag.settings import Settings
from vislam2tag.views import page
from vislam2tag.views.page import moment
from vislam2tag.views.run_report import write_report
from vislam2tag.views.run_summary import summarise

TEMPLATES = [part for part in (resources.files("vislam2tag.views") / "templates").iterdir() if part.is_file()]


def test_the_library_comes_whole_after_all_that_is_read(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey")
    results = make_results(survey)
    write_report(tmp_path / "report.html", survey, Settings(), results, summarise(results, "local", "1"))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert len(page) < 5e6
    packed = re.findall(r'<script type="text/plain" id="plotly">(.*?)</script>', page)
    assert [gzip.decompress(base64.b64decode(text)).decode() for text in packed] == [get_plotlyjs()]
    assert page.index("</main>") < page.index('id="plotly"')


def test_a_page_has_no_style_or_drawing_of_its_own_that_the_layout_has() -> None:
    texts = {part.name: part.read_text("utf-8") for part in TEMPLATES}
    whole = {name for name, text in texts.items() if "<html" in text}
    assert whole == {"layout.html.j2"}
    assert {name for name, text in texts.items() if "Plotly.newPlot" in text} == {"figures.js"}
    assert {name for name, text in texts.items() if "prefers-color-scheme" in text} == {"page.css"}


def unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


@pytest.mark.parametrize(
    ("share", "text"),
    [(None, "–"), (0.0, "0 %"), (0.001, "< 1 %"), (0.5, "50 %"), (0.994, "99 %"), (0.9999, "> 99 %"), (1.0, "100 %")],
)
def test_percent_never_rounds_to_all_or_nothing(share: float | None, text: str) -> None:
    assert page.percent(share) == unbroken(text)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (None, "–"),
        (0.0, "0.0 s"),
        (59.94, "59.9 s"),
        (59.96, "1 min 00 s"),
        (245.4, "4 min 05 s"),
        (3599.7, "1 h 00 min"),
        (7380, "2 h 03 min"),
    ],
)
def test_duration(seconds: float | None, text: str) -> None:
    assert page.duration(seconds) == unbroken(text)


def test_a_moment_is_in_minutes_and_whole_seconds() -> None:
    assert [moment(seconds) for seconds in (0, 36.7, 129.6)] == ["0:00", "0:37", "2:10"]


def test_numbers_carry_units() -> None:
    assert page.distance(1234.4) == unbroken("1\u202f234 m")
    assert page.distance(12_340) == unbroken("12.3 km")
    assert page.distance(None) == "–"
    assert page.number(1.236, 2, "m/s") == unbroken("1.24 m/s")
    assert page.number(None, 2, "m/s") == "–"
    assert page.size(1_500) == unbroken("1.5 kB")
    assert page.size(2_300_000) == unbroken("2.3 MB")
    assert page.words("scan_throttling") == "scan throttling"
