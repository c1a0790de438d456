"""Where readers of a message find the page of the documentation that it names."""

from __future__ import annotations

import os
import re
from importlib.resources import files
from pathlib import Path

from vislam2tag.common.errors import UsageError

HOSTED_AT = ""
"""Address of the hosted site, without a slash at its end. Set it when the site is published."""
ADDRESS_VARIABLE = "VISLAM2TAG_DOCS"
"""Environment variable with the address of another copy of the site, such as an organisation's own."""
_CITED = re.compile(r"docs/([\w-]+/[\w-]+)\.md")


def page_of(name: str) -> str:
    """How to open a page such as ``how-to/iphone``: its address on the hosted site, or the command that shows it."""
    site = os.environ.get(ADDRESS_VARIABLE, HOSTED_AT).rstrip("/")
    return f"{site}/{name}.html" if site else f"`vislam2tag docs {name}`"


def with_pages(text: str) -> str:
    """A text in which each ``docs/NAME.md`` is replaced by what :func:`page_of` says."""
    return _CITED.sub(lambda cited: page_of(cited[1]), text)


def offline_page(name: str) -> Path:
    """The file of a page in the offline copy of the site, which the extra ``docs`` installs.

    Raises ModuleNotFoundError without the extra, and UsageError for a page that does not exist.
    """
    site = Path(str(files("vislam2tag_docs") / "site"))
    for page in (site / f"{name}.html", site / name / "index.html"):
        if page.is_file():
            return page
    names = sorted(each.relative_to(site).with_suffix("").as_posix() for each in site.rglob("*.html"))
    word = name.rpartition("/")[2]
    close = [each for each in names if word and word in each]
    raise UsageError(
        f"the documentation has no page {name}. "
        f"{'Did you mean ' + ' or '.join(close) + '?' if close else 'Run `vislam2tag docs` for the start page.'}"
    )
