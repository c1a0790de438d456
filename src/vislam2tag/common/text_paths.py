"""Paths as the public interface takes them: text, or whatever knows its path."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TypeAlias

AnyPath: TypeAlias = str | PathLike[str]
"""A folder or file as people give it; functions make a Path of it first."""


def path_or_none(given: AnyPath | None) -> Path | None:
    """Return a path that may be left out."""
    return None if given is None else Path(given)


def paths_of(given: AnyPath | Sequence[AnyPath]) -> list[Path]:
    """Return one path or several as a list; text is one."""
    return [Path(given)] if isinstance(given, (str, PathLike)) else [Path(one) for one in given]
