"""What all pages have in common: one layout, and the plotting library packed at their end."""

from __future__ import annotations

import base64
import gzip
import re
from importlib import resources
from pathlib import Path

from plotly.offline import get_plotlyjs

from tests.views.factory import make_results, make_survey
from vislam2tag.settings import Settings
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
