"""The site as a reader meets it: built, opened from a folder in a real browser, searched, without any network."""

from __future__ import annotations

import html
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urldefrag

import pytest
from playwright.sync_api import Page

from tests.docs.pages import DOCS
from tests.views.browser import note_problems, running_browser

pytestmark = pytest.mark.slow


class Answer(NamedTuple):
    """What a search leads to: the page with more, and what is directly below the heading of one of the first hits."""

    page: str
    text: str


ANSWERS = {
    "how many landmarks do I need": Answer("how-to/site.html", r"About 12\b"),
    "how accurate is it": Answer("results/how-good.html", r"20 cm|mean error"),
    "how long does a survey take": Answer("how-to/field-guide.html", r"(?i)two people"),
    "which phones work": Answer("how-to/phone-app.html", r"Android 8 or later.*ARCore"),
    "can I use an iPhone": Answer("how-to/iphone.html", r"^Yes"),
    "where can I download the app": Answer("how-to/phone-app.html", r"make android"),
    "does it run on windows": Answer("how-to/install.html", r"never been run"),
    "wifi scan throttling": Answer("how-to/phone-app.html", r"developer options|(?:4|four) .*scans in 2 minutes"),
    "print on A3": Answer("how-to/sheets.html", r"--paper A3"),
    "sheet not recognised": Answer("how-to/field-guide.html", r"bent"),
    "tracking lost": Answer("how-to/field-guide.html", r"go back to the last sheet"),
    "what does sigma mean": Answer("explanation/uncertainty.html", r"standard deviation"),
    "report says uncertain": Answer("reference/statuses.html", r"sigma is above 0\.5 m"),
    "map is mirrored": Answer("how-to/diagnosis.html", r"vislam2tag diagnose"),
    "csv has other columns": Answer("reference/formats.html", r"vislam2tag inspect"),
    "share result with a colleague": Answer("how-to/share.html", r"studio survey --export"),
    "delete personal data": Answer("help/privacy.html", r"Delete the walk"),
    "which model should I use": Answer("how-to/which-model.html", r"vislam2tag train"),
    "how do I upgrade": Answer("help/upgrade.html", r"pip install --upgrade"),
    "how do I cite": Answer("project/citing.html", r"Cite the paper"),
}
"""What people type, and its answer."""
BELOW = 500
"""Characters below a heading in which the answer is."""
HITS = """(asked) => {
  const inside = [...document.querySelectorAll("*")].find((element) => element.shadowRoot).shadowRoot;
  const hits = [...inside.querySelectorAll("a[href]")];
  return hits.filter((hit) => new URL(hit.href).searchParams.get("h") === asked).slice(0, 3).map((hit) => hit.href);
}"""
"""Addresses of the first three hits, once the search has seen all that was typed."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site's folder."""
    project, copy = DOCS.parent, tmp_path_factory.mktemp("site")
    shutil.copytree(DOCS, copy / "docs")
    for name in ("zensical.toml", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"):
        shutil.copy(project / name, copy)
    command = [sys.executable, "-m", "zensical", "build", "--strict"]
    done = subprocess.run(command, cwd=copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return copy / "site"


@pytest.fixture(scope="module")
def browsed(site: Path) -> Iterator[tuple[Page, list[str]]]:
    """The start page in a browser, and what the browser complains about."""
    problems: list[str] = []
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        note_problems(page, problems)
        page.goto((site / "index.html").as_uri())
        yield page, problems


class _Links(HTMLParser):
    """What a page links to, and the names that links may lead to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.names |= {found[key] or "" for key in ("id", "name") if key in found}
        self.targets |= {found[key] or "" for key in ("href", "src") if key in found and tag != "link"}


def test_every_link_of_the_built_pages_leads_somewhere(site: Path) -> None:
    pages = {path: _Links(path.read_text(encoding="utf-8")) for path in site.rglob("*.html") if path.name != "404.html"}
    broken = set()
    for path, links in pages.items():
        for target in links.targets:
            where, name = urldefrag(unquote(target))
            if re.match(r"\w+:", where):
                continue
            there = (path.parent / where).resolve() if where else path
            named = not name or there not in pages or name in pages[there].names
            if not there.exists() or not named:
                broken.add((path.relative_to(site).as_posix(), target))
    assert not broken


def article(page: Path) -> str:
    """What a page says, without navigation."""
    return page.read_text(encoding="utf-8").partition("<article")[2].partition("</article>")[0]


def linked(site: Path, pages: set[str]) -> set[str]:
    """Pages that the text of these pages leads to."""
    found = set()
    for page in pages:
        for target in re.findall(r"<a href=\"([^\"#:]+\.html)[^\"]*\"", article(site / page)):
            found.add((site / page).parent.joinpath(target).resolve().relative_to(site.resolve()).as_posix())
    return found


def test_the_page_of_each_answer_is_two_clicks_from_the_start(site: Path) -> None:
    first = linked(site, {"index.html"})
    reached = first | linked(site, first)
    assert {asked for asked, answer in ANSWERS.items() if answer.page not in reached} == set()


def text_below(site: Path, address: str) -> str:
    """What the reader sees below the heading that an address leads to."""
    where, name = urldefrag(address)
    shown = article(site / where.partition("?")[0].removeprefix(site.as_uri() + "/"))
    heading = rf"<h[1-6] id=\"{re.escape(unquote(name))}\".*?</h[1-6]>" if name else r"<h1.*?</h1>"
    below = re.split(heading, shown, maxsplit=1, flags=re.DOTALL)[-1]
    return " ".join(html.unescape(re.sub(r"<[^>]+>", "", below)).split())[:BELOW]


def test_a_search_leads_to_the_answer_by_one_of_the_first_three_hits(
    browsed: tuple[Page, list[str]], site: Path
) -> None:
    page, problems = browsed
    missed = {}
    for asked, answer in ANSWERS.items():
        page.goto(page.url.partition("?")[0])
        page.keyboard.press("/")
        page.keyboard.insert_text(asked)
        page.wait_for_function(f"(asked) => ({HITS})(asked).length > 0", arg=asked)
        hits = page.evaluate(HITS, asked)
        if not any(re.search(answer.text, text_below(site, hit)) for hit in hits):
            missed[asked] = hits
    assert len(missed) <= 2, missed
    assert not problems
