"""The page to lay floors on top of each other, in a real browser; skipped where none is installed."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.cli.command import vislam2tag
from tests.site.plans import drawn_floor
from tests.views.browser import note_problems, running_browser
from vislam2tag.site.discover import read_site

pytestmark = pytest.mark.slow
POINT = """([x, y]) => {
    const at = new DOMPoint(x, -y).matrixTransform(by("world").getScreenCTM());
    return [at.x, at.y];
}"""


def test_four_clicks_give_the_command_that_lays_a_floor_on_another_one(tmp_path: Path) -> None:
    site = tmp_path / "site"
    for number, corner in (("0", "0,0"), ("1", "3,1")):
        plan = drawn_floor.png(tmp_path, name=f"{number}.png")
        words = ("--plan", plan, "--floor", number, "--width-m", "20", "--lower-left", corner)
        assert vislam2tag("site", "init", site, *words).returncode == 0
    align = ("site", "align", site, "--floor", "1", "--onto", "0")
    assert vislam2tag(*align, "--page", tmp_path / "align.html").returncode == 0
    problems: list[str] = []
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        note_problems(page, problems)
        page.goto((tmp_path / "align.html").as_uri())
        for x, y in ((8, 7), (5, 6), (22, 10), (19, 9)):  # the corner of the wall, and a place near the lift
            assert page.inner_text("#command") == ""
            page.mouse.click(*page.evaluate(POINT, [x, y]))
        command = shlex.split(page.inner_text("#command"))
    assert problems == []
    done = vislam2tag(*command[1:])
    assert done.returncode == 0, done.stderr
    assert read_site(site)[0].floor(1).site_T_bcs @ np.array([(3.0, 1.0)]) == pytest.approx(0.0, abs=0.1)
