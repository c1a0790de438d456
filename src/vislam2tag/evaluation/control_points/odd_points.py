"""Control points that are not where the file says: several walks, pressing there, put them elsewhere, and alike."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from vislam2tag.common.records import Record
from vislam2tag.evaluation.point_errors import PointErrors

CERTAIN_SIGMAS = 4.0
"""A point is odd where its presses, taken together, put it so many standard deviations away ..."""
LEAST_M = 0.3
"""... and at least this far: presses are seldom exact ..."""
FEWEST_SESSIONS = 2
"""... if so many sessions pressed there: one that was lost errs at all its points."""


class PressOffset(Record):
    """Where a label puts the phone, from the control point that was pressed at then; metres, BCS of the floor."""

    point: str
    x_m: float
    y_m: float
    sigma_m: float
    """Of label and press together, one standard deviation per axis."""


class PooledOffset(NamedTuple):
    """Where all presses at a control point put it, from where its file does: complex metres, BCS of the floor."""

    offset: complex
    sigma_m: float
    """One standard deviation per axis."""
    sessions: int


class OddPoint(Record):
    """A control point that the walks put elsewhere."""

    floor: int
    point: str
    sessions: int
    size_m: float
    sigma_m: float
    """How far off it should be expected to be, one standard deviation per axis."""
    summary: str
    """One sentence."""


def press_offsets(points: Sequence[str], errors: PointErrors) -> list[PressOffset]:
    """Reduce the labels at presses, made at these points, to offsets; those without a label or a sigma are left out."""
    sigma_m = np.hypot(errors.sigma_m, errors.truth_sigma_m)
    known = np.flatnonzero(errors.labelled & np.isfinite(sigma_m))
    return [
        PressOffset(
            point=points[i],
            x_m=round(float(errors.residual_bcs[i, 0]), 3),
            y_m=round(float(errors.residual_bcs[i, 1]), 3),
            sigma_m=round(float(sigma_m[i]), 3),
        )
        for i in known.tolist()
    ]


def odd_points(pressed: Iterable[tuple[int, Sequence[PressOffset]]]) -> list[OddPoint]:
    """Name the control points that are odd, farthest first, from the floor and the presses of each session."""
    found = [odd for place, one in pooled_offsets(pressed).items() if (odd := _odd(place, one)) is not None]
    return sorted(found, key=lambda odd: -odd.size_m)


def pooled_offsets(pressed: Iterable[tuple[int, Sequence[PressOffset]]]) -> dict[tuple[int, str], PooledOffset]:
    """Pool the presses at each point of a floor, from the floor and the presses of each session.

    What a session has in common (it was lost, or its holder presses late) is not a point's: its median is taken out.
    """
    offsets: dict[tuple[int, str], list[tuple[int, complex, float]]] = defaultdict(list)
    for session, (floor, presses) in enumerate(pressed):
        if presses:
            common = np.median([one.x_m for one in presses]) + 1j * np.median([one.y_m for one in presses])
            for one in presses:
                offsets[floor, one.point].append((session, complex(one.x_m, one.y_m) - common, one.sigma_m))
    return {place: _pooled(made) for place, made in offsets.items()}


def _pooled(made: Sequence[tuple[int, complex, float]]) -> PooledOffset:
    """Weighted mean of presses: the number of the session, the offset and its sigma of each."""
    worth = np.array([sigma_m**-2 for _, _, sigma_m in made])
    offset = complex(np.sum(worth * [offset for _, offset, _ in made]) / worth.sum())
    return PooledOffset(offset, float(worth.sum() ** -0.5), len({session for session, _, _ in made}))


def _odd(place: tuple[int, str], pooled: PooledOffset) -> OddPoint | None:
    size_m, sigma_m, sessions = abs(pooled.offset), pooled.sigma_m, pooled.sessions
    if sessions < FEWEST_SESSIONS or size_m < max(LEAST_M, CERTAIN_SIGMAS * sigma_m):
        return None
    floor, point = place
    summary = (
        f"control point {point} on floor {floor} is {size_m:.2f} m (usual are {sigma_m:.2f} m) from where "
        f"{sessions} sessions that pressed there put it: measure it again"
    )
    return OddPoint(floor=floor, point=point, sessions=sessions, size_m=size_m, sigma_m=sigma_m, summary=summary)
