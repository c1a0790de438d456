"""Distances as equations: what they miss at a place, how that changes, where two of them meet."""

from __future__ import annotations

import cmath
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.registration.least_squares import Adjusted, adjust
from vislam2tag.preparation.registration.names import PlaceByPoint
from vislam2tag.preparation.registration.tape_and_clicks import TapeDistance, Target

BEYOND_M = 0.5
"""The foot of a distance may lie so far beyond a wall's ends."""
CLIP = 16.0
"""Squared residuals, in sigmas, count at most this much while starts are compared."""
MOST_STARTS = 32


@dataclass(frozen=True)
class Equation:
    """One distance from an unknown landmark to a fixed target, or to another unknown landmark (``other``)."""

    distance: TapeDistance
    target: Target | None
    other: str
    side: int = 1
    """Of a wall's line, from start to stop: 1 left, -1 right; of a point no matter."""

    @property
    def sigma_m(self) -> float:
        """Of tape and target together."""
        return float(np.hypot(self.distance.sigma_m, self.target.sigma_m if self.target else 0.0))

    @property
    def wall(self) -> Target | None:
        """The target, where it is a wall."""
        return self.target if self.target is not None and self.target.stop is not None else None

    def from_to(self, places: PlaceByPoint) -> tuple[complex, float]:
        """Unit vector from the target to the landmark, and the distance as the places have it."""
        here = places[self.distance.landmark]
        if self.wall is not None:
            normal = self.side * _normal(self.wall)
            return normal, ((here - self.wall.start) * normal.conjugate()).real
        there = self.target.start if self.target is not None else places[self.other]
        offset = here - there
        return (offset / abs(offset), abs(offset)) if offset else (1 + 0j, 0.0)

    def beyond(self, places: PlaceByPoint) -> bool:
        """Whether the foot of the distance is beyond the wall."""
        if self.wall is None or self.wall.stop is None:
            return False
        along = self.wall.stop - self.wall.start
        foot = ((places[self.distance.landmark] - self.wall.start) * (along / abs(along)).conjugate()).real
        return not -BEYOND_M <= foot <= abs(along) + BEYOND_M


@dataclass(frozen=True)
class StartingPlaces:
    """Places to start from, and the equations with the side of each wall."""

    places: dict[str, complex]
    equations: tuple[Equation, ...]


def _normal(wall: Target) -> complex:
    along = (wall.stop or 0) - wall.start
    return 1j * along / abs(along)


def misclosure(equations: Sequence[Equation], places: PlaceByPoint) -> FloatArray:
    """Distance by the places minus distance by tape (n,), whitened."""
    off = [(one.from_to(places)[1] - one.distance.distance_m) / one.sigma_m for one in equations]
    return np.array(off, dtype=np.float64)


def design_matrix(equations: Sequence[Equation], names: Sequence[str], places: PlaceByPoint) -> FloatArray:
    """Derivatives (n, 2k) of minus the misclosure by the places of ``names``, whitened."""
    found = np.zeros((len(equations), len(names), 2))
    for row, one in enumerate(equations):
        unit, _ = one.from_to(places)
        found[row, names.index(one.distance.landmark)] = np.array((unit.real, unit.imag)) / one.sigma_m
        if one.other:
            found[row, names.index(one.other)] = -np.array((unit.real, unit.imag)) / one.sigma_m
    return -found.reshape(len(equations), -1)


def least_squares_places(start: StartingPlaces, names: Sequence[str]) -> dict[str, complex]:
    """Least-squares places from a start."""

    def at(values: FloatArray) -> dict[str, complex]:
        return {name: complex(*pair) for name, pair in zip(names, values.reshape(-1, 2), strict=True)}

    begin = np.array([(start.places[name].real, start.places[name].imag) for name in names]).ravel()

    def residual(values: FloatArray) -> FloatArray:
        return misclosure(start.equations, at(values))

    def jacobian(values: FloatArray) -> FloatArray:
        return -design_matrix(start.equations, names, at(values))

    return at(np.asarray(least_squares(residual, begin, jac=jacobian, x_scale="jac").x))


def adjusted_at(equations: Sequence[Equation], names: Sequence[str], places: PlaceByPoint) -> Adjusted:
    """The adjustment, linearised at places; raises SingularError where they are not determined."""
    return adjust(design_matrix(equations, names, places), misclosure(equations, places))[1]


def starting_places(equations: Sequence[Equation], names: Sequence[str]) -> list[StartingPlaces]:
    """Where the landmarks may be, the likeliest first: each where two of its distances meet.

    ``names`` come in an order in which each has two distances to targets or to earlier ones. Few of the likeliest
    are kept after each landmark.
    """
    partial = [StartingPlaces({}, ())]
    for name in names:
        longer: list[StartingPlaces] = []
        for start in partial:
            now = [one for one in equations if _usable(one, name, start.places)]
            meetings = [
                meeting for pair in itertools.combinations(now, 2) for meeting in _meetings(*pair, name, start.places)
            ]
            longer += [_with_landmark(start, name, place, now) for place in meetings]
        longer.sort(key=_clipped_square)
        partial = longer[:MOST_STARTS]
    return partial


def _usable(one: Equation, name: str, places: PlaceByPoint) -> bool:
    """Whether an equation ties this landmark to a target or to a landmark placed before."""
    if name not in (one.distance.landmark, one.other):
        return False
    return not one.other or (one.distance.landmark if one.other == name else one.other) in places


def _with_landmark(start: StartingPlaces, name: str, place: complex, now: Sequence[Equation]) -> StartingPlaces:
    """Add a landmark, each wall on the side on which it then is."""
    sided = [
        Equation(one.distance, one.target, one.other, 1 if _offset(one.wall, place) >= 0 else -1) if one.wall else one
        for one in now
    ]
    return StartingPlaces(start.places | {name: place}, (*start.equations, *sided))


def _offset(wall: Target, place: complex) -> float:
    return ((place - wall.start) * _normal(wall).conjugate()).real


def _clipped_square(start: StartingPlaces) -> float:
    return float(np.minimum(misclosure(start.equations, start.places) ** 2, CLIP).sum())


def _meetings(one: Equation, other: Equation, name: str, places: PlaceByPoint) -> list[complex]:
    """Where two distances meet, or come nearest to each other."""
    first, second = one.distance.distance_m, other.distance.distance_m
    if one.wall and other.wall:
        return _lines_meet(one.wall, first, other.wall, second)
    if one.wall:
        return _line_and_circle_meet(one.wall, first, _centre(other, name, places), second)
    if other.wall:
        return _line_and_circle_meet(other.wall, second, _centre(one, name, places), first)
    return _circles_meet(_centre(one, name, places), first, _centre(other, name, places), second)


def _centre(one: Equation, name: str, places: PlaceByPoint) -> complex:
    if one.target is not None:
        return one.target.start
    return places[one.distance.landmark if one.other == name else one.other]


def _lines_meet(wall: Target, away_m: float, other: Target, other_m: float) -> list[complex]:
    normals = np.array([(n.real, n.imag) for n in (_normal(wall), _normal(other))])
    if abs(np.linalg.det(normals)) < 0.05:  # nearly parallel walls do not meet anywhere definite
        return []
    at = np.array([(each.start * _normal(each).conjugate()).real for each in (wall, other)])
    signs = itertools.product((1, -1), repeat=2)
    return [complex(*np.linalg.solve(normals, at + np.array([a * away_m, b * other_m]))) for a, b in signs]


def _line_and_circle_meet(wall: Target, away_m: float, centre: complex, radius_m: float) -> list[complex]:
    normal, found = _normal(wall), []
    for sign in (1, -1):
        across = sign * away_m - _offset(wall, centre)
        half = max(radius_m**2 - across**2, 0.0) ** 0.5
        found += [centre + across * normal + end * half * normal * 1j for end in (1, -1)]
    return found


def _circles_meet(first: complex, a: float, second: complex, b: float) -> list[complex]:
    """Where circles about two points with radii ``a`` and ``b``, metres, meet."""
    apart = abs(second - first)
    if not apart > 0:
        return []
    along = (apart**2 + a**2 - b**2) / (2 * apart)
    across = max(a**2 - along**2, 0.0) ** 0.5
    unit = cmath.rect(1, cmath.phase(second - first))
    return [first + (along + 1j * end * across) * unit for end in (1, -1)]
