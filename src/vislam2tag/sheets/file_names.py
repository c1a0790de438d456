"""File names of landmarks' images: safe on every file system, whatever the id."""

from __future__ import annotations

import re
from collections.abc import Sequence

from vislam2tag.survey.slugs import unique_slugs

_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that Windows keeps for devices, with any ending."""


def image_names(ids: Sequence[str]) -> tuple[str, ...]:
    """Name the image file of each id, ``lobby.png``; ids that would share a name get a hash of the id."""
    return tuple(f"{slug}.png" for slug in unique_slugs([_plain(name) for name in ids], ids))


def _plain(name: str) -> str:
    """Make a name that is neither empty, hidden nor reserved."""
    shown = name.replace(":", "").lstrip(".")
    return f"landmark-{shown}" if not shown or _RESERVED.fullmatch(shown) else shown
