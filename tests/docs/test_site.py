"""The site as a reader meets it: built, opened from a folder in a real browser, searched, without any network."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest
from playwright.sync_api import Page

from tests.docs.pages import DOCS
from tests.views.browser import note_problems, running_browser

pytestmark = pytest.mark.slow
ANSWERS = {
    "file formats": r"File formats",
    "accuracy": r"Accuracy",
    "sigma": r"What sigma is|Uncertainty",
    "before_first_landmark": r"before_first_landmark",
    "citing": r"Citing",
    "contributing": r"Contributing",
    "changelog": r"Changelog",
    "privacy": r"Privacy",
}
"""What people look for, and the heading that answers."""
HITS = """(asked) => {
  const inside = [...document.querySelectorAll("*")].find((element) => element.shadowRoot).shadowRoot;
  const hits = [...inside.querySelectorAll("a[href]")].slice(0, 3);
  const whole = hits.filter((hit) => new URL(hit.href).searchParams.get("h") === asked);
  return whole.map((hit) => hit.innerText.split("\\n")[0]);
}"""
"""Headings of the first three hits, once the search has seen all that was typed."""


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


def test_what_people_look_for_is_two_clicks_from_the_start(site: Path) -> None:
    """One click leads to the page that answers, so that the second may lead on within it."""
    text = (site / "index.html").read_text(encoding="utf-8")
    content = text.partition("<article")[2].partition("</article>")[0]
    reached = set(re.findall(r"<a href=\"([^\"#]+\.html)[^\"]*\"", content))
    headings = "\n".join(
        re.sub(r"<[^>]+>", "", heading)
        for page in reached
        for heading in re.findall(r"<h[1-3][^>]*>(.*?)</h[1-3]>", (site / page).read_text(encoding="utf-8"), re.DOTALL)
    )
    assert not {asked for asked, answer in ANSWERS.items() if not re.search(rf"(?mi)^(?:{answer})", headings)}


def test_a_search_finds_the_heading_that_answers_among_the_first_three(browsed: tuple[Page, list[str]]) -> None:
    page, problems = browsed
    missed = {}
    for asked, answer in ANSWERS.items():
        page.goto(page.url.partition("?")[0])
        page.keyboard.press("/")
        page.keyboard.insert_text(asked)
        page.wait_for_function(f"(asked) => ({HITS})(asked).length == 3", arg=asked)
        hits = page.evaluate(HITS, asked)
        if not any(re.match(answer, hit) for hit in hits):
            missed[asked] = hits
    assert not missed
    assert not problems
