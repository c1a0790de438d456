"""Evidence of a walk's pose besides its shape: known places, headings, and where other walks say that it was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.core.wall_costs import Float32Array
from vislam2tag.estimation.floor_plan.pose_grid import YAW_RAD, YAWS, PoseGrid
from vislam2tag.estimation.floor_plan.stretches import Stretches
from vislam2tag.estimation.odometry import Odometry

WRONG_NATS = 10.0
"""No single fact costs more than this: a person may have tapped the wrong point, a compass may be beside iron."""


@dataclass(frozen=True)
class KnownPlace:
    """At ``frame`` of the odometry something at ``offset`` from the camera (complex metres, continuous frame) was at
    ``place``, complex metres, within ``sigma_m`` per axis.
    """

    frame: int
    place: complex
    sigma_m: float
    offset: complex = 0j


@dataclass(frozen=True)
class KnownTurn:
    """At ``frame`` of the odometry the continuous frame is turned to the building by ``turn_rad``, within
    ``sigma_rad``.
    """

    frame: int
    turn_rad: float
    sigma_rad: float


@dataclass(frozen=True)
class PossiblePlaces:
    """At ``frame`` the camera was at one of some ``place`` (k,), complex metres, with probabilities ``weight`` (k,).

    They sum to at most 1; the rest says nothing. Each is exact to ``sigma_m`` per axis.
    """

    frame: int
    place: ComplexArray
    weight: FloatArray
    sigma_m: float


Fact = KnownPlace | KnownTurn | PossiblePlaces


def evidence_of(grid: PoseGrid, walk: Stretches, odometry: Odometry, facts: Sequence[Fact]) -> dict[int, Float32Array]:
    """Log-likelihoods (yaws, rows, columns) of all facts, at most 0, by number of the stretch that each belongs to."""
    total: dict[int, Float32Array] = {}
    for fact in facts:
        number = nearest_stretch(walk, fact.frame)
        middle = walk.stretches[number].middle
        if isinstance(fact, KnownTurn):
            off = wrapped(np.asarray(YAW_RAD * np.arange(YAWS) - fact.turn_rad, dtype=np.float64)) / fact.sigma_rad
            found = np.maximum(-0.5 * off**2, -WRONG_NATS).astype(np.float32)[:, None, None]
        else:
            found = _of_places(grid, complex(odometry.path[fact.frame]) - middle, fact)
        before = total.get(number)
        total[number] = found if before is None else before + found
    return {number: np.broadcast_to(found, grid.shape) for number, found in total.items()}


def nearest_stretch(walk: Stretches, frame: int) -> int:
    """Number of the stretch that contains a frame, or is nearest to it."""
    away = [max(one.first - frame, frame - one.last, 0) for one in walk.stretches]
    return int(np.argmin(away))


def _of_places(grid: PoseGrid, offset: complex, fact: KnownPlace | PossiblePlaces) -> Float32Array:
    """Log-likelihood (yaws, rows, columns) of a camera at ``offset`` from the stretch's middle."""
    if isinstance(fact, KnownPlace):
        places, weights, offset = np.array([fact.place]), np.ones(1), offset + fact.offset
    else:
        places, weights = fact.place, fact.weight
    positions = grid.costs.positions
    x, y = (
        start + (np.arange(count) + 0.5) * positions.cell_m
        for start, count in zip(positions.origin_m, positions.shape[::-1], strict=True)
    )
    turned = offset * grid.turns
    sigma = np.hypot(fact.sigma_m, positions.cell_m / 2)
    total = np.full(grid.shape, max(1 - float(weights.sum()), 0.0), dtype=np.float32)
    for place, weight in zip(places.tolist(), weights.tolist(), strict=True):
        across = np.exp(-0.5 * ((x + turned.real[:, None] - place.real) / sigma) ** 2).astype(np.float32)
        along = np.exp(-0.5 * ((y + turned.imag[:, None] - place.imag) / sigma) ** 2).astype(np.float32)
        total += np.float32(weight) * along[:, :, None] * across[:, None, :]
    return np.log(np.maximum(total, np.float32(np.exp(-WRONG_NATS))))
