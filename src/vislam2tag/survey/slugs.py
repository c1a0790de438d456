"""File-name stems for sessions: safe on every file system, unique in the survey, always the same."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Sequence

from vislam2tag.survey.model import SessionKey

_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_SUFFIX_LENGTH = 8
_GREATEST_STEM = 120
"""File systems allow 255 bytes; this leaves room for suffixes."""


def session_slugs(keys: Sequence[SessionKey]) -> tuple[str, ...]:
    """Give each session its slug, e.g. ``floor_4.LG_ref.2022-01-14T163530``.

    Colons go, other unsafe characters become ``-``. Slugs that would collide (also on a file system that
    ignores case) or be too long get a short hash of the exact folder names.
    """
    stems = [_stem(key) for key in keys]
    uses = Counter(stem.lower() for stem in stems)
    return tuple(
        stem if uses[stem.lower()] == 1 and len(stem) <= _GREATEST_STEM else f"{stem[:_GREATEST_STEM]}-{_digest(key)}"
        for key, stem in zip(keys, stems, strict=True)
    )


def _stem(key: SessionKey) -> str:
    return ".".join((f"floor_{key.floor}", _safe(key.device), _safe(key.session)))


def _safe(name: str) -> str:
    return _UNSAFE.sub("-", name.replace(":", ""))


def _digest(key: SessionKey) -> str:
    exact = "\0".join((str(key.floor), key.device, key.session))
    return hashlib.sha256(exact.encode("utf-8", "surrogateescape")).hexdigest()[:_SUFFIX_LENGTH]
