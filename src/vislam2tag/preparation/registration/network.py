"""Stations and points, adjusted together: every shot of every station, every known point; heights likewise.

Each station's frame lies in the building by a turn and a shift (Helmert transformation of scale 1; one scale common to
all stations where that is asked for). A shot says ``place = centre + m e^(i turn) (shot - mean shot)`` with equal
standard deviation in all directions, so its error may be taken in the building as well as in the station's frame. Known
points are measurements of themselves. Angles, shifts and places are estimated at once, so points that several stations
shot tie the stations together. In height each station's frame lies above the building's by one number.
"""

from __future__ import annotations

import cmath
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import Similarity2
from vislam2tag.preparation.registration.least_squares import (
    Adjusted,
    SingularError,
    adjust,
    explanations,
    listed,
    suspicious,
)
from vislam2tag.preparation.registration.names import point_label

ROUNDS = 15
SMALL_M = 1e-7
"""A step that moves nothing farther ends the iteration."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Where a point was found; ``place`` as a complex number, metres."""

    point: str
    place: complex
    sigma_m: float
    source: str = ""
    """File and line."""
    decimals: int = 3
    """Digits after the decimal mark, as written."""

    @property
    def label(self) -> str:
        """How messages call it."""
        return f"known point {point_label(self.point)}{self._source}"

    @property
    def _source(self) -> str:
        return f" ({self.source})" if self.source else ""


class KnownPoint(Measurement):
    """One known point, in the building."""


@dataclass(frozen=True, kw_only=True)
class Shot(Measurement):
    """One shot of a point from a station, in the station's frame."""

    station: str

    @property
    def label(self) -> str:
        """How messages call it."""
        return f"shot of {point_label(self.point)} from {self.station}{self._source}"


@dataclass(frozen=True)
class PlaneFit:
    """The adjusted network; rows 2i and 2i + 1 of ``adjusted`` are x and y of measurement i, shots first."""

    shots: tuple[Shot, ...]
    known: tuple[KnownPoint, ...]
    maps: Mapping[str, Similarity2]
    """Station to building."""
    places: Mapping[str, complex]
    """Every point's adjusted place in the building, metres."""
    adjusted: Adjusted
    scale: tuple[float, float] | None
    """How much longer distances are in the building than the stations have them, and its standard deviation."""
    """None where it was held at 1."""
    _first_point: int

    @cached_property
    def measurements(self) -> tuple[Measurement, ...]:
        """Shots, then known points."""
        return (*self.shots, *self.known)

    @cached_property
    def groups(self) -> list[IntArray]:
        """Rows (2,) of each measurement."""
        return [np.array((2 * i, 2 * i + 1)) for i in range(len(self.measurements))]

    def covariance(self, *points: str) -> FloatArray:
        """Joint covariance (2k, 2k) of points' places, m^2, by the stated standard deviations and sigma0."""
        order = list(self.places)
        rows = [self._first_point + 2 * order.index(point) + axis for point in points for axis in (0, 1)]
        return np.asarray(self.adjusted.cofactor[np.ix_(rows, rows)] * self.adjusted.variance_factor)

    def residual_m(self, measurement: int) -> complex:
        """What a measurement is off by in the building: measured minus adjusted, metres."""
        sigma = self.measurements[measurement].sigma_m
        x, y = self.adjusted.residual[2 * measurement : 2 * measurement + 2]
        return -complex(x, y) * sigma

    def reliability(self, measurement: int) -> float:
        """How much of a measurement the others check: 0 not at all, 1 wholly."""
        return max(float(np.trace(self.adjusted.kernel(self.groups[measurement]))) / 2, 0.0)


def adjust_plane(
    shots: Sequence[Shot],
    known: Sequence[KnownPoint],
    start: Mapping[str, Similarity2],
    *,
    free_scale: bool = False,
    rounds: int = ROUNDS,
) -> PlaneFit:
    """Adjust a network from rough frames; with one round it is only linearised there.

    Known points that no shot uses are left out. Raises SingularError where the network is not determined.
    """
    used = {shot.point for shot in shots}
    state = _State.of(shots, [one for one in known if one.point in used], start)
    for _ in range(rounds):
        step, adjusted = adjust(state.design(free_scale), state.misclosure())
        moved_m = state.move(step, free_scale) if rounds > 1 else 0.0
        if moved_m < SMALL_M:
            break
    else:
        raise SingularError("the adjustment does not settle")
    return state.fit(adjusted, free_scale)


@dataclass
class _State:
    """The estimate so far; points and stations are numbered in order of their names' first use."""

    shots: tuple[Shot, ...]
    known: tuple[KnownPoint, ...]
    stations: list[str]
    points: list[str]
    station: IntArray
    point: IntArray
    known_point: IntArray
    lever: ComplexArray
    """Each shot minus the mean shot of its station."""
    mean: ComplexArray
    centre: ComplexArray
    turn: FloatArray
    place: ComplexArray
    scale: float = 1.0

    @classmethod
    def of(cls, shots: Sequence[Shot], known: Sequence[KnownPoint], start: Mapping[str, Similarity2]) -> _State:
        stations = list(dict.fromkeys(shot.station for shot in shots))
        points = list(dict.fromkeys(shot.point for shot in shots))
        number = {name: i for i, name in enumerate(points)}
        station = np.array([stations.index(shot.station) for shot in shots], dtype=np.int64)
        measured = np.array([shot.place for shot in shots], dtype=np.complex128)
        mean = np.array([measured[station == i].mean() for i in range(len(stations))])
        place = np.zeros(len(points), dtype=np.complex128)
        for shot in reversed(shots):
            place[number[shot.point]] = start[shot.station].a * shot.place + start[shot.station].b
        return cls(
            shots=tuple(shots),
            known=tuple(known),
            stations=stations,
            points=points,
            station=station,
            point=np.array([number[shot.point] for shot in shots], dtype=np.int64),
            known_point=np.array([number[one.point] for one in known], dtype=np.int64),
            lever=measured - mean[station],
            mean=mean,
            centre=np.array([start[name].a * m + start[name].b for name, m in zip(stations, mean, strict=True)]),
            turn=np.array([start[name].rotation_rad for name in stations]),
            place=place,
        )

    @property
    def _sigma(self) -> FloatArray:
        """(n,) of shots, then known points, metres."""
        return np.array([one.sigma_m for part in (self.shots, self.known) for one in part])

    @property
    def _arm(self) -> ComplexArray:
        """Lever (k,) of each shot, turned into the building, metres."""
        return np.asarray(self.scale * np.exp(1j * self.turn[self.station]) * self.lever)

    def misclosure(self) -> FloatArray:
        """Places minus what was measured of them (2n,), whitened."""
        measured = np.concatenate(
            (self.centre[self.station] + self._arm, np.array([one.place for one in self.known], dtype=np.complex128))
        )
        off = (np.concatenate((self.place[self.point], self.place[self.known_point])) - measured) / self._sigma
        return np.column_stack((off.real, off.imag)).ravel()

    def design(self, free_scale: bool) -> FloatArray:
        """Derivatives (2n, u): turn and centre of each station, the scale where it is free, then the points."""
        n, first = len(self.shots), 3 * len(self.stations) + free_scale
        rows, arm = np.arange(n), self._arm
        design = np.zeros((n + len(self.known), 2, first + 2 * len(self.points)))
        design[rows, :, 3 * self.station] = np.column_stack((-arm.imag, arm.real))
        for axis in (0, 1):
            design[rows, axis, 3 * self.station + 1 + axis] = 1.0
            design[rows, axis, first + 2 * self.point + axis] = -1.0
            design[n + np.arange(len(self.known)), axis, first + 2 * self.known_point + axis] = -1.0
        if free_scale:
            design[:n, :, first - 1] = np.column_stack((arm.real, arm.imag)) / self.scale
        return (design / self._sigma[:, None, None]).reshape(-1, design.shape[2])

    def move(self, step: FloatArray, free_scale: bool) -> float:
        """Take a step (u,); return how far it moves anything, metres."""
        stations, first = step[: 3 * len(self.stations)].reshape(-1, 3), 3 * len(self.stations) + free_scale
        self.turn = self.turn + stations[:, 0]
        self.centre = self.centre + stations[:, 1] + 1j * stations[:, 2]
        if free_scale:
            self.scale += float(step[first - 1])
        moved = step[first:].reshape(-1, 2)
        self.place = self.place + moved[:, 0] + 1j * moved[:, 1]
        return float(np.abs(moved).max())

    def fit(self, adjusted: Adjusted, free_scale: bool) -> PlaneFit:
        first = 3 * len(self.stations) + free_scale
        maps = {}
        for i, name in enumerate(self.stations):
            a = self.scale * cmath.exp(1j * float(self.turn[i]))
            maps[name] = Similarity2(a, complex(self.centre[i] - a * self.mean[i]))
        variance = adjusted.cofactor[first - 1, first - 1] * adjusted.variance_factor if free_scale else 0.0
        return PlaneFit(
            shots=self.shots,
            known=self.known,
            maps=maps,
            places={name: complex(place) for name, place in zip(self.points, self.place, strict=True)},
            adjusted=adjusted,
            scale=(self.scale, float(np.sqrt(variance))) if free_scale else None,
            _first_point=first,
        )


KNOWN_HEIGHT = ""
"""The station of a known height: it has no shift."""


@dataclass(frozen=True)
class MeasuredHeight:
    """One measured height, metres: in a station's frame, or known (station :data:`KNOWN_HEIGHT`)."""

    point: str
    station: str
    height_m: float
    sigma_m: float
    source: str = ""

    @property
    def label(self) -> str:
        """How messages call it."""
        what = f"height of {point_label(self.point)} from {self.station}"
        what = what if self.station else f"known height of {point_label(self.point)}"
        return f"{what} ({self.source})" if self.source else what


@dataclass(frozen=True)
class HeightFit:
    """Heights of points in the building with their standard deviation, metres, by point; what was left out."""

    heights: dict[str, tuple[float, float]]
    errors: tuple[str, ...]
    untied: tuple[str, ...]
    """Stations whose height nothing tells."""
    sigma0: float | None


def adjust_heights(measured: Sequence[MeasuredHeight]) -> HeightFit:
    """Adjust all heights that are tied to a known one; leave out, and name, what contradicts the others."""
    good, untied = _tied_to_known(measured)
    errors: list[str] = []
    while good:
        points, values, adjusted = _solve(good)
        groups = [np.array((i,)) for i in range(len(good))]
        suspects = [i for i, _ in suspicious(adjusted, groups, adjusted.noise_level)]
        if not suspects:
            sigma = np.sqrt(np.diag(adjusted.cofactor)[: len(points)] * adjusted.variance_factor)
            heights = {name: (float(values[i]), float(sigma[i])) for i, name in enumerate(points)}
            return HeightFit(heights, tuple(errors), untied, adjusted.sigma0)
        sigmas = np.array([one.sigma_m for one in good])
        found = explanations(adjusted, groups, sigmas, adjusted.noise_level, suspects, ())
        wrong = sorted(i for one in found for i in one.measurements)
        names = listed([good[i].label for i in wrong])
        errors.append(
            f"{names} {'is off' if len(wrong) == 1 else 'contradict each other (nothing tells which is off)'}"
        )
        good, further = _tied_to_known([one for i, one in enumerate(good) if i not in wrong])
        untied += further
    return HeightFit({}, tuple(errors), untied, None)


def _tied_to_known(measured: Sequence[MeasuredHeight]) -> tuple[list[MeasuredHeight], tuple[str, ...]]:
    """What is tied to a known height, and the stations that are not."""
    graph = nx.Graph()
    graph.add_node(("station", KNOWN_HEIGHT))
    graph.add_edges_from((("station", one.station), ("point", one.point)) for one in measured)
    tied = nx.node_connected_component(graph, ("station", KNOWN_HEIGHT))
    kept = [one for one in measured if ("station", one.station) in tied]
    stations = dict.fromkeys(one.station for one in measured)
    return kept, tuple(name for name in stations if ("station", name) not in tied)


def _solve(good: Sequence[MeasuredHeight]) -> tuple[list[str], FloatArray, Adjusted]:
    """Heights of the points (k,) by least squares: measured = height + the station's shift."""
    points = list(dict.fromkeys(one.point for one in good))
    stations = list(dict.fromkeys(one.station for one in good if one.station != KNOWN_HEIGHT))
    rows = np.arange(len(good))
    design = np.zeros((len(good), len(points) + len(stations)))
    design[rows, [points.index(one.point) for one in good]] = 1.0
    for row, one in enumerate(good):
        if one.station != KNOWN_HEIGHT:
            design[row, len(points) + stations.index(one.station)] = 1.0
    sigma = np.array([one.sigma_m for one in good])
    values, adjusted = adjust(design / sigma[:, None], np.array([one.height_m for one in good]) / sigma)
    return points, values, adjusted
