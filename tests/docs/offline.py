"""The wheel of the documentation, as the extra ``docs`` installs it, with empty pages."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PACKAGE = "vislam2tag_docs"


@contextmanager
def installed_site(folder: Path, *pages: str) -> Iterator[Path]:
    """Install pages such as ``how-to/iphone``; yields the folder of the site."""
    site = folder / PACKAGE / "site"
    for page in pages:
        (site / page).parent.mkdir(parents=True, exist_ok=True)
        (site / f"{page}.html").touch()
    (site.parent / "__init__.py").touch()
    sys.path.insert(0, str(folder))
    try:
        yield site
    finally:
        sys.path.remove(str(folder))
        sys.modules.pop(PACKAGE, None)
