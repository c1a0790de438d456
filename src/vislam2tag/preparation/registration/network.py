"""Stations and points, adjusted together: every shot of every station, every known point; heights likewise.

Each station's frame is in the building by a turn and a shift (Helmert transformation of scale 1; one scale common to
all stations where that is asked for). A shot says ``place = centre + m e^(i turn) (shot - mean shot)`` with equal
standard deviation in all directions, so its error may be taken in the building as well as in the station's frame. Known
points are measurements of themselves. Angles, shifts and places are estimated at once, so points that several stations
shot tie the stations together. In height each station's frame is above the building's by one number.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.robust import StoppingRule, iterate
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
"""The adjustment ends when no point is farther than this from its final place."""


KNOWN = ""
"""The station of known points: their frame is the building's."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Where a point was found: shot from a station, in its frame, or :data:`KNOWN`; metres."""

    point: str
    station: str = KNOWN
    place: complex
    sigma_m: float
    height_m: float = math.nan
    code: str = ""
    source: str = ""
    """File and line."""
    decimals: int = 3
    """Digits after the decimal mark, as written: what a typing error can have changed."""

    @property
    def label(self) -> str:
        """How messages call it."""
        return self._called("known point ", "shot of ")

    @property
    def height_label(self) -> str:
        """How messages call its height."""
        return self._called("known height of ", "height of ")

    def _called(self, known: str, shot: str) -> str:
        text = f"{shot if self.station else known}{point_label(self.point)}"
        text += f" from {self.station}" if self.station else ""
        return f"{text} ({self.source})" if self.source else text


@dataclass(frozen=True)
class PlaneFit:
    """The adjusted network; rows 2i and 2i + 1 of ``adjusted`` are x and y of measurement i."""

    measurements: tuple[Measurement, ...]
    """Shots, then known points."""
    maps: Mapping[str, Similarity2]
    """Station to building; :data:`KNOWN` changes nothing."""
    places: Mapping[str, complex]
    """Every point's adjusted place in the building, metres."""
    adjusted: Adjusted
    scale: tuple[float, float] | None
    """How much longer distances are in the building than the stations have them, and its standard deviation."""
    """None where it was held at 1."""
    _first_point: int

    def covariance(self, *points: str) -> FloatArray:
        """Joint covariance (2k, 2k) of points' places, m^2, by the stated standard deviations and sigma0."""
        order = list(self.places)
        rows = [self._first_point + 2 * order.index(point) + axis for point in points for axis in (0, 1)]
        return np.asarray(self.adjusted.cofactor[np.ix_(rows, rows)] * self.adjusted.variance_factor)

    def residual_m(self, measurement: int) -> complex:
        """What a measurement is off by in the building: measured minus adjusted, metres."""
        x, y = self.adjusted.residual[self.adjusted.rows(measurement)]
        return -complex(x, y) * self.measurements[measurement].sigma_m

    def reliability(self, measurement: int) -> float:
        """How much of a measurement the others check: 0 not at all, 1 wholly."""
        return max(float(np.trace(self.adjusted.kernel(self.adjusted.rows(measurement)))) / 2, 0.0)


def adjust_plane(
    measured: Sequence[Measurement], start: Mapping[str, Similarity2], *, free_scale: bool = False, rounds: int = ROUNDS
) -> PlaneFit:
    """Adjust a network from rough frames; with one round it is only linearised there.

    Known points that no shot uses are left out. Raises SingularError where the network is not determined.
    """
    state = _State(measured, start, free_scale)
    first = adjust(state.design(), state.misclosure(), each=2)
    if rounds == 1:
        return state.fit(first[1])

    def step(before: _Round, _number: int) -> _Round:
        moved_m = state.move(before[0])
        return *adjust(state.design(), state.misclosure(), each=2), moved_m

    done = iterate(
        "the adjustment of the network",
        (*first, math.inf),
        step,
        lambda _, after: after[2],
        StoppingRule(tolerance=SMALL_M, most_rounds=rounds),
        logged=False,
    )
    if not done.converged:
        raise SingularError("the adjustment does not converge")
    return state.fit(done.state[1])


_Round: TypeAlias = tuple[FloatArray, Adjusted, float]
"""The next step (u,), the adjustment from which it follows, and how far the step before moved anything, metres."""


class _State:
    """The estimate so far; points and stations are numbered in order of their names' first use."""

    def __init__(self, measured: Sequence[Measurement], start: Mapping[str, Similarity2], free_scale: bool) -> None:
        shots = [one for one in measured if one.station]
        self.stations = list(dict.fromkeys(shot.station for shot in shots))
        self.points = list(dict.fromkeys(shot.point for shot in shots))
        used = set(self.points)
        known = [one for one in measured if not one.station and one.point in used]
        self.measurements = (*shots, *known)
        self.sigma = np.array([one.sigma_m for one in self.measurements])
        number = {name: i for i, name in enumerate(self.points)}
        self.point = np.array([number[one.point] for one in self.measurements], dtype=np.int64)
        self.station = np.array([self.stations.index(shot.station) for shot in shots], dtype=np.int64)
        shot_at = np.array([shot.place for shot in shots], dtype=np.complex128)
        self.known_at = np.array([one.place for one in known], dtype=np.complex128)
        self.mean = np.array([shot_at[self.station == i].mean() for i in range(len(self.stations))])
        self.lever = shot_at - self.mean[self.station]
        maps = [start[name] for name in self.stations]
        self.centre = np.array([one.a * mean + one.b for one, mean in zip(maps, self.mean, strict=True)])
        self.turn = np.array([one.rotation_rad for one in maps])
        self.place = np.zeros(len(self.points), dtype=np.complex128)
        for shot in reversed(shots):
            self.place[number[shot.point]] = start[shot.station].a * shot.place + start[shot.station].b
        self.scale, self.free_scale = 1.0, free_scale
        self.first_point = 3 * len(self.stations) + free_scale

    @property
    def _arm(self) -> ComplexArray:
        """Each shot minus the mean shot of its station (k,), turned into the building, metres."""
        return np.asarray(self.scale * np.exp(1j * self.turn[self.station]) * self.lever)

    def misclosure(self) -> FloatArray:
        """Places minus what was measured of them (2n,), whitened."""
        measured = np.concatenate((self.centre[self.station] + self._arm, self.known_at))
        off = (self.place[self.point] - measured) / self.sigma
        return np.column_stack((off.real, off.imag)).ravel()

    def design(self) -> FloatArray:
        """Derivatives (2n, u): turn and centre of each station, the scale where it is free, then the points."""
        shots, every, arm = np.arange(len(self.station)), np.arange(len(self.point)), self._arm
        design = np.zeros((len(every), 2, self.first_point + 2 * len(self.points)))
        design[shots, :, 3 * self.station] = np.column_stack((-arm.imag, arm.real))
        for axis in (0, 1):
            design[shots, axis, 3 * self.station + 1 + axis] = 1.0
            design[every, axis, self.first_point + 2 * self.point + axis] = -1.0
        if self.free_scale:
            design[: len(shots), :, self.first_point - 1] = np.column_stack((arm.real, arm.imag)) / self.scale
        return np.asarray((design / self.sigma[:, None, None]).reshape(-1, design.shape[2]))

    def move(self, step: FloatArray) -> float:
        """Take a step (u,); return how far it moves anything, metres."""
        turn, east, north = step[: 3 * len(self.stations)].reshape(-1, 3).T
        self.turn, self.centre = self.turn + turn, self.centre + east + 1j * north
        if self.free_scale:
            self.scale += float(step[self.first_point - 1])
        moved = step[self.first_point :].reshape(-1, 2)
        self.place = self.place + moved[:, 0] + 1j * moved[:, 1]
        return float(np.abs(moved).max())

    def fit(self, adjusted: Adjusted) -> PlaneFit:
        maps = {KNOWN: Similarity2.identity()}
        for i, name in enumerate(self.stations):
            a = self.scale * cmath.exp(1j * float(self.turn[i]))
            maps[name] = Similarity2(a, complex(self.centre[i] - a * self.mean[i]))
        variance = adjusted.cofactor[self.first_point - 1, self.first_point - 1] * adjusted.variance_factor
        return PlaneFit(
            measurements=self.measurements,
            maps=maps,
            places={name: complex(place) for name, place in zip(self.points, self.place, strict=True)},
            adjusted=adjusted,
            scale=(self.scale, float(np.sqrt(variance))) if self.free_scale else None,
            _first_point=self.first_point,
        )


@dataclass(frozen=True)
class HeightFit:
    """Heights of points in the building with their standard deviation, metres, by point; what was left out."""

    heights: dict[str, tuple[float, float]]
    errors: tuple[str, ...]
    untied: tuple[str, ...]
    """Stations of unknown height."""


def adjust_heights(measured: Sequence[Measurement], sigma_m: float) -> HeightFit:
    """Adjust all heights, each with this sigma, that are tied to a known one; name what contradicts the others."""
    good, untied = _tied_to_known([one for one in measured if math.isfinite(one.height_m)])
    errors: list[str] = []
    while good:
        points, values, adjusted = _solve(good, sigma_m)
        noise = adjusted.noise_level
        suspects = suspicious(adjusted, noise)
        if not suspects:
            sigma = np.sqrt(np.diag(adjusted.cofactor)[: len(points)] * adjusted.variance_factor)
            heights = {name: (float(values[i]), float(sigma[i])) for i, name in enumerate(points)}
            return HeightFit(heights, tuple(errors), untied)
        found = explanations(adjusted, np.full(len(good), sigma_m), noise, suspects)
        wrong = sorted(i for one in found for i in one.measurements)
        names = listed([good[i].height_label for i in wrong])
        errors.append(
            f"{names} "
            f"{'is wrong' if len(wrong) == 1 else 'contradict each other (it cannot be determined which is wrong)'}"
        )
        good, further = _tied_to_known([one for i, one in enumerate(good) if i not in wrong])
        untied += further
    return HeightFit({}, tuple(errors), untied)


def _tied_to_known(measured: Sequence[Measurement]) -> tuple[list[Measurement], tuple[str, ...]]:
    """What is tied to a known height, and the stations that are not."""
    graph = nx.Graph()
    graph.add_node(("station", KNOWN))
    graph.add_edges_from((("station", one.station), ("point", one.point)) for one in measured)
    tied = nx.node_connected_component(graph, ("station", KNOWN))
    kept = [one for one in measured if ("station", one.station) in tied]
    stations = dict.fromkeys(one.station for one in measured)
    return kept, tuple(name for name in stations if ("station", name) not in tied)


def _solve(good: Sequence[Measurement], sigma_m: float) -> tuple[list[str], FloatArray, Adjusted]:
    """Heights of the points (k,) by least squares: measured = height + the station's shift."""
    points = list(dict.fromkeys(one.point for one in good))
    stations = list(dict.fromkeys(one.station for one in good if one.station))
    design = np.zeros((len(good), len(points) + len(stations)))
    for row, one in enumerate(good):
        design[row, points.index(one.point)] = 1.0
        if one.station:
            design[row, len(points) + stations.index(one.station)] = 1.0
    values, adjusted = adjust(design / sigma_m, np.array([one.height_m for one in good]) / sigma_m)
    return points, values, adjusted
