"""Truths that the walks contradict alike: control points, and the track of a total station.

Two shots fit a station's frame however they are turned, so one of a wrong point may show in nothing but the walks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from vislam2tag.common.findings import Finding, Judgement, counted
from vislam2tag.common.records import Record
from vislam2tag.core.robust import TRUSTED_MEAN_SQUARE, trusted
from vislam2tag.quality.evaluation.truth import PointErrors

CERTAIN_SIGMAS = 3.5
"""A point is odd where its presses, taken together, put it so many standard deviations away (by normal errors 3 % of
floors with 15 points would have one beyond) ..."""
LEAST_M = 0.3
"""... and at least this far: presses are seldom exact ..."""
FEWEST_SESSIONS = 2
"""... if so many sessions pressed there: one that was lost errs at all its points."""
FEWEST_POINTS = 3
"""A session that pressed at fewer is left out: what its presses have in common may be a point's."""
SHARED_M, SHARED_COUNTS = 0.13, 20
"""Per axis, the common error of all presses at a point, because people pass it on the same side: half of the distance
to the phone. It is a prior that counts as much as this many points."""
MOST_SHARED_M, RESOLVED_M = 10.0, 1e-4
"""It is looked for up to here, this exactly."""


class PressOffset(Record):
    """Where a label puts the phone, from the control point that was pressed at then; metres, BCS of the floor."""

    point: str
    x_m: float
    y_m: float
    sigma_m: float
    """Of label and press together, one standard deviation per axis."""


class PooledOffset(NamedTuple):
    """From a point of a truth to where sessions put it; complex metres, BCS of the floor."""

    offset: complex
    sigma_m: float
    """One standard deviation per axis, of what sessions err by each for itself, and of what they share."""
    sessions: int
    place: complex = 0j
    """Where a station's track is compared."""


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
    """Name the control points that are odd, furthest first, from the floor and the presses of each session."""
    found = [odd for place, one in pooled_offsets(pressed).items() if (odd := _odd(place, one)) is not None]
    return sorted(found, key=lambda odd: -odd.size_m)


def judgement_of_points(pressed: Iterable[tuple[int, Sequence[PressOffset]]], odd: int) -> Judgement:
    """Whether control points could be compared with one another, ``odd`` of which are named."""
    judged = sum(one.sessions >= FEWEST_SESSIONS for one in pooled_offsets(pressed).values())
    why = f"no control point has presses of {FEWEST_SESSIONS} sessions with at least {FEWEST_POINTS} points each"
    return Judgement.of(odd, judged, counted(judged, "control point"), "" if judged else why)


def pooled_offsets(pressed: Iterable[tuple[int, Sequence[PressOffset]]]) -> dict[tuple[int, str], PooledOffset]:
    """Pool the presses at each point of a floor, from the floor and the presses of each session.

    What a session has in common (it was lost, or its holder presses late) is not a point's: its median is taken out.
    What presses at a point have in common is estimated from how far points are off.
    """
    offsets: dict[tuple[int, str], list[tuple[int, complex, float]]] = defaultdict(list)
    for session, (floor, presses) in enumerate(pressed):
        if len({one.point for one in presses}) >= FEWEST_POINTS:
            common = np.median([one.x_m for one in presses]) + 1j * np.median([one.y_m for one in presses])
            for one in presses:
                offsets[floor, one.point].append((session, complex(one.x_m, one.y_m) - common, one.sigma_m))
    pooled = {place: _pooled(made) for place, made in offsets.items()}
    shared = shared_m(list(pooled.values()))
    return {place: one._replace(sigma_m=float(np.hypot(one.sigma_m, shared))) for place, one in pooled.items()}


def shared_m(pooled: Sequence[PooledOffset]) -> float:
    """By how much, per axis, all presses at a point err alike: what points are off by beyond their own sigma, robustly.

    A random effect of the point (DerSimonian and Laird 1986), by the points that are least off.
    """
    if not pooled:
        return SHARED_M
    square_m2 = np.array([abs(one.offset) for one in pooled]) ** 2
    own_m2 = np.array([one.sigma_m for one in pooled]) ** 2
    usual_m2 = float(np.median(own_m2))

    def too_small(variance_m2: float) -> bool:
        least = trusted(square_m2 / (own_m2 + variance_m2))
        assumed = SHARED_COUNTS * ((usual_m2 + SHARED_M**2) / (usual_m2 + variance_m2) - 1)
        return bool(least.sum() / TRUSTED_MEAN_SQUARE - len(least) + assumed > 0)

    low_m, high_m = 0.0, MOST_SHARED_M
    while high_m - low_m > RESOLVED_M:
        middle_m = (low_m + high_m) / 2
        low_m, high_m = (middle_m, high_m) if too_small(middle_m**2) else (low_m, middle_m)
    return low_m


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
        f"control point {point} on floor {floor} is {size_m:.2f} m (sigma {sigma_m:.2f} m) from the position "
        f"according to {sessions} sessions: measure it again"
    )
    return OddPoint(floor=floor, point=point, sessions=sessions, size_m=size_m, sigma_m=sigma_m, summary=summary)


CELL_M = 10.0
"""Tracks are compared place by place, in squares of this side."""
CERTAIN_PLACE_SIGMAS = 3.0
"""A place contradicts where sessions, together, put the track so many standard deviations away (the mean over a place
is closer than its labels state: without a fault the worst of six is 1.5 off) ..."""
LEAST_PLACE_M = 0.2
"""... and at least this far."""
FEWEST_PASSING = 2
"""... if so many sessions passed it."""
FEWEST_PLACES, FEWEST_CONTRADICTING, LEAST_SHARE = 3, 2, 0.3
"""A frame is off where, of so many places at least, so many and this share contradict: where only one does, a landmark
near it may be."""
SHARED_PLACE_M = 0.05
"""All sessions err at a place by this alike, per axis, and by more where places are off by more that no other frame
accounts for: by how landmarks around it are surveyed (assumed)."""


def places_apart(walks: Sequence[PointErrors]) -> list[PooledOffset]:
    """Pool the labels of sessions against one station's track, by place.

    Labels of a session in a place err alike: however many they are, they count as one.
    """
    seen: dict[tuple[int, int], list[tuple[complex, complex, float, float]]] = defaultdict(list)
    for errors in walks:
        kept = errors.labelled & np.isfinite(errors.sigma_m)
        place, offset = (at[kept] @ (1, 1j) for at in (errors.truth_bcs, errors.residual_bcs))
        label_m, truth_m = errors.sigma_m[kept], np.nan_to_num(errors.truth_sigma_m[kept])
        cell = np.floor(errors.truth_bcs[kept] / CELL_M).astype(np.int64)
        for x, y in np.unique(cell, axis=0).tolist():
            rows = (cell == (x, y)).all(axis=1)
            at, off = complex(place[rows].mean()), complex(offset[rows].mean())
            seen[x, y].append((at, off, float(label_m[rows].mean()), float(truth_m[rows].mean())))
    places = [_pooled_place(found) for found in seen.values() if len(found) >= FEWEST_PASSING]
    shared_m = _shared_m(places)
    return [one._replace(sigma_m=float(np.hypot(one.sigma_m, shared_m))) for one in places]


def _pooled_place(found: Sequence[tuple[complex, complex, float, float]]) -> PooledOffset:
    """Weighted mean over sessions of place, offset, and sigmas of label and track (clock and prism are one for all)."""
    place, offset, label_m, truth_m = (np.array(values) for values in zip(*found, strict=True))
    worth = label_m**-2.0
    share = worth / worth.sum()
    sigma_m = np.hypot(worth.sum() ** -0.5, share @ truth_m)
    return PooledOffset(complex(share @ offset), float(sigma_m), len(found), complex(place.mean()))


def _shared_m(places: Sequence[PooledOffset]) -> float:
    """By how much, per axis, all sessions err alike at a place: what places are off by beyond their own sigma.

    Not counted is what another frame, turned and shifted, accounts for: three numbers of two for each place.
    """
    if len(places) < FEWEST_PLACES:
        return SHARED_PLACE_M
    offset, arm = (np.array([getattr(one, name) for one in places]) for name in ("offset", "place"))
    arm = 1j * (arm - arm.mean())
    frame = np.zeros((2, len(places), 3))
    frame[0, :, 0], frame[1, :, 1], frame[0, :, 2], frame[1, :, 2] = 1, 1, arm.real, arm.imag
    design, values = frame.reshape(-1, 3), np.concatenate((offset.real, offset.imag))
    left = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    beyond_m2 = left @ left / (len(left) - design.shape[1]) - np.mean([one.sigma_m**2 for one in places])
    return float(np.sqrt(max(beyond_m2, SHARED_PLACE_M**2)))


def frame_against_walks(walks: Sequence[PointErrors]) -> list[Finding]:
    """Report a station whose track is elsewhere than walks of one device put it."""
    places = places_apart(walks)
    contradicting = [one for one in places if abs(one.offset) > max(CERTAIN_PLACE_SIGMAS * one.sigma_m, LEAST_PLACE_M)]
    enough = max(FEWEST_CONTRADICTING, LEAST_SHARE * len(places))
    if len(places) < FEWEST_PLACES or len(contradicting) < enough:
        return []
    worst = max(contradicting, key=lambda one: abs(one.offset))
    by = f"{abs(worst.offset):.2f} m (sigma {worst.sigma_m:.2f} m)"
    message = (
        f"around ({worst.place.real:.0f}, {worst.place.imag:.0f}) the total station's track is {by} from the "
        f"position according to {worst.sessions} sessions: check the ids and coordinates of its common points"
    )
    return [Finding(kind="station_frame", file="", count=len(contradicting), message=message)]
