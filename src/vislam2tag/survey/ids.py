"""Landmark ids are text: how raw files spell them, brought to one form."""

from __future__ import annotations

import re

_WHOLE_NUMBER = re.compile(r"(?:\+|(-))?0*([0-9]+)(?:[.,]0*)?")
_UNUSABLE = re.compile(r"[\x00-\x1f\x7f;\ufffd]")


def landmark_id(text: str) -> str:
    """Bring an id to its one form: ``" 10"``, ``"010"``, ``"+10"`` and ``"10.0"`` are ``"10"``.

    Whole numbers lose leading zeros and the plus sign, because other programs read such columns as numbers.

    Returns the empty string for what cannot be an id: blank, control characters, undecodable bytes.
    """
    stripped = text.strip()
    if _UNUSABLE.search(stripped):
        return ""
    number = _WHOLE_NUMBER.fullmatch(stripped)
    if not number:
        return stripped
    sign, digits = number.groups()
    return f"-{digits}" if sign and digits != "0" else str(digits)
