"""What stands in a page's body, without the plotting library."""

from __future__ import annotations


def own_part(page: str) -> str:
    """The body up to the packed library, of which any text might be part."""
    return page[page.index("<body>") :].partition('<script type="text/plain"')[0]
