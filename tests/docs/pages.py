"""Pages of the documentation that are made of the program: `make docs-pages` writes them, a test compares."""

from __future__ import annotations

from pathlib import Path

from tests.cli.first_mistakes import page as mistakes_page
from tests.docs.finding_pages import findings_page
from tests.docs.program_pages import api_page, commands_page
from vislam2tag.cli.settings_options import settings_page

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {
    "how-to/first_mistakes.md": mistakes_page,
    "reference/api.md": api_page,
    "reference/commands.md": commands_page,
    "reference/findings.md": findings_page,
    "reference/settings.md": settings_page,
}

if __name__ == "__main__":
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")
