"""Where readers of a message find the page of the documentation that it names."""

from __future__ import annotations

import os
import re
from pathlib import Path

import vislam2tag
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
    """The file of a page: HTML of the site that the extra ``docs`` installs, else Markdown that every wheel contains.

    Raises UsageError for a page that does not exist.
    """
    folder, suffix = _pages()
    for page in (folder / f"{name}{suffix}", folder / name / f"index{suffix}"):
        if page.is_file():
            return page
    names = sorted(each.relative_to(folder).with_suffix("").as_posix() for each in folder.rglob(f"*{suffix}"))
    word = name.rpartition("/")[2]
    close = [each for each in names if word and word in each]
    raise UsageError(
        f"the documentation has no page {name}. "
        f"{'Did you mean ' + ' or '.join(close) + '?' if close else 'Run `vislam2tag docs` for the start page.'}"
    )


def _pages() -> tuple[Path, str]:
    """The folder with all pages, and the suffix of their files."""
    from importlib.resources import files  # only `docs` needs it, and every command loads this module

    try:
        return Path(str(files("vislam2tag_docs") / "site")), ".html"
    except ModuleNotFoundError:
        package = Path(vislam2tag.__file__).parent
        installed = package / "pages"
        return (installed if installed.is_dir() else package.parents[1] / "docs"), ".md"
