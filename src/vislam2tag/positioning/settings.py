"""What can be chosen of locating; imports nothing heavy, as the command's help names it all."""

from __future__ import annotations

from enum import StrEnum


class SequenceMethod(StrEnum):
    """Which scans of a walk may speak for one of them."""

    FILTER = "filter"
    """Earlier ones only."""
    SMOOTHER = "smoother"
    """All."""
