"""How a walk was placed on a floor plan: how well it fits, and where else it may have been."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status


@dataclass(frozen=True)
class Candidate:
    """One of the paths that a walk may have taken: its probability ``weight`` and ``position_bcs`` (k, 2), metres, at
    the frames :attr:`Placing.frame`.
    """

    weight: float
    position_bcs: FloatArray
    turn_rad: float
    """``bcs_R_continuous``, mean over the walk."""


@dataclass(frozen=True)
class Placing:
    """Fit of a walk to the plan of its floor.

    ``misfit`` is the cost of its best path, nats per 10 m of way (0.03 to 0.16 is usual). By ``mirror`` nats the plan
    prefers the walk to its mirror image. By ``exchanged`` nats it prefers the walk to the same one with left and right
    exchanged from the middle on. ``floors`` compares with the plans of other floors: (number, nats).
    """

    way_m: float
    misfit: float
    mirror: float
    exchanged: float
    floors: tuple[tuple[int, float], ...]
    labelled_share: float
    """Share of its stretches whose place is certain, 0 to 1."""
    reason: Status
    """OK if any frame is labelled; otherwise the commonest reason."""
    frame: tuple[int, ...] = ()
    """Frames of the camera track at which candidates have positions."""
    candidates: tuple[Candidate, ...] = ()
    """Most probable first; one if the whole walk is certain."""
    compass_rad: float | None = None
    """``enu_R_continuous`` by the rotation vector: minus a candidate's ``turn_rad`` it shows north; None if unknown."""
    best_tap: int | None = None
    """Frame of the camera track at which a known place would help most; None if none helps or is needed."""
    scale: float = float("nan")
    """Size of the plan by the walk: 1.02 means that the plan is 2 % too large; NaN if unknown."""
    scale_sigma: float = float("nan")
