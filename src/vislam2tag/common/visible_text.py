"""Text for terminals and logs: names from files may contain control characters, which a terminal would obey.

Escape sequences can rewrite what was printed, set titles or fill the clipboard; marks of writing direction let a name
read as another. They are shown as JSON writes them (``\\u001b``), so that JSON stays what it was.
"""

from __future__ import annotations

import logging
import re

_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters but tab and line feed, marks of direction, and what stands for bytes that are not UTF-8."""


def visible(text: str) -> str:
    """Return the text with each character that a terminal would obey spelled out."""
    return _HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


_MARKUP = re.compile("<[^<>]*>?")
_EXCERPT = 60


def excerpt(text: str) -> str:
    """Text of a file as a message quotes it: one line of at most 60 characters, without markup or hidden characters."""
    line = " ".join(visible(_MARKUP.sub(" ", text[: 10 * _EXCERPT])).split())
    return line if len(line) <= _EXCERPT else f"{line[: _EXCERPT - 3]}..."


class VisibleFormatter(logging.Formatter):
    """Formats what is logged, traceback and all, by :func:`visible`."""

    def format(self, record: logging.LogRecord) -> str:
        """As any formatter's."""
        return visible(super().format(record))
