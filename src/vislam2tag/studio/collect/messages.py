"""What the server tells of sessions that phones hand over, and of what was walked, as JSON."""

from __future__ import annotations

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.messages import Point


class ReceivedSession(FiniteRecord):
    """A session that was handed over; ``path`` is its folder in the survey."""

    path: str
    already: bool
    """It had been there before."""


class CollectingView(FiniteRecord):
    """Where phones hand over; without an address they cannot now."""

    url: str | None
    token: str
    """As it is typed where no camera is at hand."""
    code: list[str]
    """Modules of the address's QR code, row by row: 1 is dark."""
    received: list[ReceivedSession]
    refused: list[str]


class Covered(FiniteRecord):
    """What of a floor was walked, by the labels; ``note`` says why nothing is known of it."""

    floor: int
    note: str
    walkable_m2: float | None
    walked: float | None
    scanned: float | None
    """Shares of the walkable space within 2 m, on foot, of a walk and of a Wi-Fi scan."""
    never_entered: list[str]
    minutes_left: float | None
    """A walk past all that lacks takes so long; None: nothing worth a way lacks."""
    next_m: Point | None
    """Its first stop."""


class CoveredFloors(FiniteRecord):
    """Of each floor with a plan."""

    floors: list[Covered]
