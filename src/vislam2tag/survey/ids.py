"""Landmark ids are text: how raw files spell them, brought to one form."""

from __future__ import annotations

import re

_INTEGRAL_FLOAT = re.compile(r"([+-]?\d+)[.,]0*")
_UNUSABLE = re.compile(r"[\x00-\x1f\x7f;\ufffd]")


def landmark_id(text: str) -> str:
    """Bring an id to its one form: ``" 10"`` and ``"10.0"`` are ``"10"``.

    Returns the empty string for what cannot be an id: blank, control characters, undecodable bytes.
    """
    stripped = text.strip()
    if _UNUSABLE.search(stripped):
        return ""
    integral = _INTEGRAL_FLOAT.fullmatch(stripped)
    return integral.group(1) if integral else stripped
