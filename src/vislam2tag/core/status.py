"""What became of a walk: why a frame or reading has a position or has none, and what went wrong on the way.

What goes wrong is events of the tracker, and landmarks that contradict the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum

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
    AMBIGUOUS = 11
    FITS_NOWHERE = 12
    FITS_MIRROR = 13
    FITS_OTHER_FLOOR = 14
    TOO_SHORT = 15
    PLAN_TOO_OPEN = 16

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


def frames_placed(counts: Mapping[str, int]) -> int:
    """How many frames, counted by label, have a position, certain or not."""
    return sum(counts.get(status.label, 0) for status in (Status.OK, Status.UNCERTAIN))


class EventKind(StrEnum):
    """What a step of the tracker was that is not a motion of the camera; without tracker, what happened on the walk."""

    MAP_UPDATE = "map_update"
    """Camera and landmarks moved together: the tracker re-expressed its frame. Harmless."""
    CORRECTION = "correction"
    """Camera and landmarks moved, but not alike: the tracker corrected its drift."""
    BREAK = "break"
    """The camera alone jumped."""
    RELOCALISATION = "relocalisation"
    """The camera alone jumped as a known landmark came into view again, or back to where it had been."""
    LOSS = "loss"
    """Tracking was lost; ``size_m`` is what the tracker says the camera moved meanwhile."""
    SLIP = "slip"
    """Between two passes of landmarks the tracker led elsewhere than usual drift explains; the frame is the middle."""
    STANDING = "standing"
    """No tracker: the walker stood still, from the frame on."""
    TURN = "turn"
    """No tracker: the walker turned on the spot, by ``turn_rad``."""
    STAIRS = "stairs"
    """No tracker: air pressure shows ``size_m`` up or down, on foot."""
    LIFT = "lift"
    """No tracker: air pressure shows ``size_m`` up or down without a step."""
    DOUBTFUL_FIX = "doubtful_fix"
    """No tracker: a known position is ``size_m`` from where the walk's others put it."""


@dataclass(frozen=True)
class TrackerEvent:
    """A step of the tracker that is not a motion, between the usable frame before ``frame`` and ``frame``.

    ``size_m`` is the length of the jump in metres, ``turn_rad`` its turn about the vertical (NaN where unknown).
    """

    kind: EventKind
    frame: int
    size_m: float
    turn_rad: float = float("nan")
    reason: str = ""
    """What the tracker says why, in its own word; empty where it says nothing."""


@dataclass(frozen=True)
class Contradiction:
    """A landmark whose surveyed position disagrees with all the others by ``size_m``, expected within ``sigma_m``.

    ``offset_bcs_m`` is from the surveyed position to where the walk puts the landmark, metres in the BCS;
    ``passes`` counts the passes that say so.
    """

    landmark: str
    size_m: float
    sigma_m: float
    offset_bcs_m: tuple[float, float]
    passes: int
