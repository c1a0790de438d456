"""Choices of `locate`. Imports nothing heavy, because the command's help names them all."""

from __future__ import annotations

from enum import StrEnum


class SequenceMethod(StrEnum):
    """Which scans of a walk contribute to the position of one scan."""

    FILTER = "filter"
    """Earlier scans only."""
    SMOOTHER = "smoother"
    """All scans of the walk."""
