"""What stands in a page's body, without the plotting library."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

_READ_BY_PLOTLY = {"text", "hovertext", "hovertemplate", "hover", "name", "ticktext", "title"}
"""Keys of figures whose texts Plotly takes for HTML; ``name`` of a trace alone, which has a type."""
_OURS = re.compile(r"</?(br|b|i|sup|sub|extra)/?>")


def own_part(page: str) -> str:
    """The body up to the packed library, of which any text might be part."""
    return page[page.index("<body>") :].partition('<script type="text/plain"')[0]


def tags_in_figures(page: str) -> list[str]:
    """Texts of a page's figures in which Plotly would find a tag that is none of ours."""
    data = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL)
    texts = [text for part in data for text in _texts(json.loads(part), wanted=False)]
    assert texts
    return [text for text in texts if "<" in _OURS.sub("", text)]


def _texts(value: Any, *, wanted: bool) -> Iterator[str]:
    if isinstance(value, dict):
        keys = _READ_BY_PLOTLY if "type" in value else _READ_BY_PLOTLY - {"name"}
        for key, inner in value.items():
            yield from _texts(inner, wanted=wanted or key in keys)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner, wanted=wanted)
    elif isinstance(value, str) and wanted:
        yield value
