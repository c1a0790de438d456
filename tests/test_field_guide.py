"""The field guide can be printed: with its picture it fits on both sides of one sheet of A4."""

from __future__ import annotations

import re
from pathlib import Path

import pypdfium2
import pytest
from markdown_it import MarkdownIt

from tests.views.browser import running_browser
from vislam2tag.preparation.planning.settings import CameraSettings
from vislam2tag.preparation.sheets.settings import SHEET_SIZES

GUIDE = Path(__file__).resolve().parents[1] / "docs" / "how-to" / "field-guide.md"
IMAGES = GUIDE.parents[1] / "images"
STYLE = (
    "body { font: 10pt/1.3 sans-serif; margin: 0 } h1 { font-size: 15pt; margin: 0 } p, ul { margin: 4pt 0 } "
    "img { width: 100% }"
)
SIDES = 2


def test_it_prints_on_both_sides_of_one_sheet_of_a4(tmp_path: Path) -> None:
    body = MarkdownIt().render(GUIDE.read_text(encoding="utf-8").replace("../images/", f"{IMAGES.as_uri()}/"))
    (tmp_path / "guide.html").write_text(f"<meta charset='utf-8'><style>{STYLE}</style>{body}", encoding="utf-8")
    with running_browser() as browser:
        page = browser.new_page()
        page.goto((tmp_path / "guide.html").as_uri())
        margin = dict.fromkeys(("top", "bottom", "left", "right"), "15mm")
        page.pdf(path=str(tmp_path / "guide.pdf"), format="A4", margin=margin)  # type: ignore[arg-type]
    document = pypdfium2.PdfDocument(tmp_path / "guide.pdf")
    assert len(document) == SIDES
    document.close()


@pytest.mark.parametrize("name", ["A4", "A3", "A2"])
def test_its_distances_are_those_of_the_planner(name: str) -> None:
    distance = CameraSettings().fill_distance_m(SHEET_SIZES[name])
    told = re.search(rf"{name} at (\d\.\d\d) m", GUIDE.read_text(encoding="utf-8"))
    assert told is not None
    assert told.group(1) == f"{distance:.2f}"
