"""Random use of the page, while someone else edits the file: it ends with exactly what was acknowledged.

A seed decides everything: what is clicked, typed and pressed, what someone else writes, and when the page is loaded
again. The page's own requests are watched, and each answer that saves or undoes is what the file must contain then.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.studio.test_page import studio_page
from tests.views.browser import running_browser
from vislam2tag.site.corrections.edits import entry_spans, text_lines

SEED = 48
WIDE: dict[str, Any] = {"viewport": {"width": 1400, "height": 900}}
KEYS = ("Tab", "Enter", "Escape", "Control+z", "Control+Shift+Z", "l", "e", "f", " ", "[", "]", ".", "ArrowRight")
TEXTS = ("1", "2", "3.5", "nobody", "2021-12-21", "")
LONG_WORK = "Build|Search for all|Create radio|Receive from|Deutsch"
"""Buttons that start work of minutes, and the one after which names are others."""
CORRECT = "Save|Correct|Exclude|Show the change|Remove|Undo|Redo|↶|↷|gnore"
"""Buttons that lead to a change of the file."""

WATCH = """
const ask = window.fetch;
window.awaited = 0;
window.fetch = async (address, options = {}) => {
  const changes = (options.method ?? 'GET') !== 'GET' && /corrections(.undo)?$/.test(address);
  window.awaited += changes;
  try {
    const answer = await ask(address, options);
    if (changes && answer.ok) {
      const body = await answer.clone().json();
      await window.acknowledge((body.corrections ?? body).text);
    }
    return answer;
  } finally {
    window.awaited -= changes;
  }
};
"""
"""Reports each text of corrections that the server acknowledges, before the page hears of it."""

CLICK = """
([kinds, chance, times, wanted, unwanted]) => {
  const within = document.querySelector('dialog[open]') ?? document;
  const named = (one, pattern) => new RegExp(pattern).test(one.textContent);
  const found = [...within.querySelectorAll(kinds)].filter(
    (one) => one.checkVisibility() && !one.matches(':disabled') && named(one, wanted) && !named(one, unwanted),
  );
  for (let time = 0; time < times; time++) found[Math.floor(chance * found.length)]?.click();
}
"""
FILL = """
([chance, text]) => {
  const within = document.querySelector('dialog[open]') ?? document;
  const kinds = 'input:not([type=file], [type=checkbox], [type=radio]), select, textarea';
  const found = [...within.querySelectorAll(kinds)].filter((one) => one.checkVisibility() && !one.matches(':disabled'));
  const one = found[Math.floor(chance * found.length)];
  if (!one) return;
  if (one instanceof HTMLSelectElement) one.selectedIndex = Math.floor(chance * 977) % one.options.length;
  else one.value = text;
  for (const kind of ['input', 'change']) one.dispatchEvent(new Event(kind, { bubbles: true }));
}
"""
QUIET = "() => window.awaited === 0 && !document.querySelector('.tools [aria-disabled=true]')"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@dataclass
class Monkey:
    """Uses a page at random; ``text`` is what the file must contain once no answer is awaited."""

    page: Page
    file: Path
    random: Random
    text: str = ""
    done: list[str] = field(default_factory=list)

    def act(self) -> None:
        """Do one thing."""
        actions = {
            self.click: 30,
            self.correct: 30,
            self.turn_to: 10,
            self.fill: 14,
            self.press: 8,
            self.edit: 5,
            self.reload: 3,
        }
        action = self.random.choices(list(actions), list(actions.values()))[0]
        self.done.append(action.__name__)
        action()

    def click(self) -> None:
        """Click something."""
        self._click("button, summary, input[type=checkbox], input[type=radio]")

    def correct(self) -> None:
        """Click what may change the file, now and then in a view that has more of it."""
        if self.random.random() < 0.2:
            for tab in ("Check", self.random.choice(("Faults", "Corrections", "Landmarks"))):
                self._click("[role=tab]", tab)
        self._click(self.random.choice(("button", "button.main")), CORRECT)

    def turn_to(self) -> None:
        """Change the tab."""
        self._click("[role=tab]")

    def _click(self, kinds: str, wanted: str = "") -> None:
        """Click one of some kinds of things, sometimes twice."""
        times = self.random.choice((1, 1, 1, 2))
        self.page.evaluate(CLICK, [kinds, self.random.random(), times, wanted, LONG_WORK])

    def fill(self) -> None:
        """Fill something in."""
        self.page.evaluate(FILL, [self.random.random(), self.random.choice(TEXTS)])

    def press(self) -> None:
        """Press a key."""
        self.page.keyboard.press(self.random.choice(KEYS))

    def edit(self) -> None:
        """Change the file as an editor does: an entry more, an entry less, or a comment."""
        self.is_as_acknowledged()
        lines = text_lines(self.text)
        spans = entry_spans(lines)
        if spans and self.random.random() < 0.5:
            _, start, end = self.random.choice(spans)
            changed = "".join(lines[:start] + lines[end:])
        else:
            number = len(self.done)
            changed = f'{self.text.rstrip()}\n\n# theirs\n[[exclude_landmark]]\nid = "theirs {number}"\n'.lstrip()
        new = self.file.with_suffix(".new")
        new.write_text(changed)
        new.replace(self.file)
        self.text = changed

    def reload(self) -> None:
        """Load the page again."""
        self.is_as_acknowledged()
        self.page.reload()
        expect(self.page.get_by_role("tab").first).to_be_visible()

    def is_as_acknowledged(self) -> None:
        """Compare the file once the page awaits no answer."""
        while not self.page.evaluate(QUIET):
            self.page.wait_for_timeout(20)
        now = self.file.read_text() if self.file.exists() else ""
        assert now == self.text, f"after {len(self.done)} steps, the last ones {self.done[-5:]}"


@pytest.mark.parametrize(
    "steps",
    [pytest.param(200, marks=pytest.mark.slow), pytest.param(2000, marks=pytest.mark.campaign)],
)
def test_random_use_ends_with_what_was_acknowledged(browser: Browser, faulty: Path, tmp_path: Path, steps: int) -> None:
    with studio_page(browser, faulty, tmp_path, **WIDE) as (page, folder):
        monkey = Monkey(page, folder / "survey" / "corrections.toml", Random(SEED))
        saved: list[str] = []

        def acknowledge(text: str) -> None:
            monkey.text = text
            saved.append(text)

        page.expose_function("acknowledge", acknowledge)
        page.add_init_script(WATCH)
        page.reload()
        expect(page.get_by_role("tab").first).to_be_visible()
        for _ in range(steps):
            monkey.act()
        monkey.is_as_acknowledged()
        assert saved, "the page never saved anything"
