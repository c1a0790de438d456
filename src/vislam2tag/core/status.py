"""Why a frame or reading has a position, or why it has none."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

import numpy as np

from vislam2tag.core.arrays import BoolArray, StatusArray


class Status(IntEnum):
    """Cause codes of frames and readings; the lower-case name is what tables show."""

    OK = 0
    BEFORE_FIRST_LANDMARK = 1
    AFTER_LAST_LANDMARK = 2
    TRACKING_LOST = 3
    BREAK = 4
    NO_MAPPING = 5
    GAP = 6
    UNCERTAIN = 7
    OUTSIDE_FRAMES = 8
    DUPLICATE = 9
    INVALID = 10

    @property
    def label(self) -> str:
        """The text written to tables, e.g. ``before_first_landmark``."""
        return self.name.lower()


STATUS_LABELS: tuple[str, ...] = tuple(status.label for status in Status)
"""Label of each code, in code order."""


def has_position(status: StatusArray) -> BoolArray:
    """Mask (n,) of the codes (n,) of entries that carry coordinates (``ok`` or ``uncertain``)."""
    positioned: BoolArray = (status == Status.OK) | (status == Status.UNCERTAIN)
    return positioned


def counts_by_label(status: StatusArray) -> dict[str, int]:
    """Number of the codes (n,) by label, in code order, those that occur only."""
    counts = np.bincount(status, minlength=len(STATUS_LABELS))
    return {label: int(count) for label, count in zip(STATUS_LABELS, counts, strict=True) if count}


def labelled_share(counts: Mapping[str, int]) -> float | None:
    """Share of frames or readings, counted by label, with status ``ok``, 0 to 1; None where there are none.

    Repeated ones (``duplicate``) say nothing new and are counted neither as labelled nor as lost.
    """
    total = sum(count for label, count in counts.items() if label != Status.DUPLICATE.label)
    return counts.get(Status.OK.label, 0) / total if total else None
