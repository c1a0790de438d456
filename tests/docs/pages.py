"""Pages made of the program and of measured figures: `make docs-pages` writes them, a test compares."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.docs.figures import filled
from tests.docs.finding_pages import findings_page
from tests.docs.program_pages import api_page, commands_page
from tests.docs.settings_page import settings_page
from tests.docs.tutorial_pages import tutorial_page

DOCS = Path(__file__).parents[2] / "docs"
PAGES: dict[str, Callable[[], str]] = {
    "reference/api.md": api_page,
    "reference/commands.md": commands_page,
    "reference/findings.md": findings_page,
    "reference/settings.md": settings_page,
    "results/agreement.md": lambda: filled("agreement"),
    "results/floor-plan.md": lambda: filled("floor-plan"),
    "results/how-good.md": lambda: filled("how-good"),
    "results/input-mutations.md": lambda: filled("input-mutations"),
}

TUTORIALS = ("first_steps", "own_walk", "pandas_walk", "trained_model")

if __name__ == "__main__":
    for tutorial in TUTORIALS:
        page = tutorial_page(tutorial, DOCS / "images")
        (DOCS / "tutorials" / f"{tutorial}.md").write_text(page, encoding="utf-8")
    for name, made in PAGES.items():
        (DOCS / name).write_text(made(), encoding="utf-8")
