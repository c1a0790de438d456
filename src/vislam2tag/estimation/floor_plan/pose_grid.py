"""All poses that a stretch may have on a plan, what its shape says of each, and how the next one's pose follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.wall_costs import COARSE, FINE_M, POSITION_M, REACH_M, Float32Array, WallCosts
from vislam2tag.estimation.floor_plan.stretches import SPACING_M, Link

Box = tuple[slice, slice]
"""Rows and columns of some positions."""
YAWS = 120
YAW_RAD = 2 * np.pi / YAWS
WORST_NATS = 14.0
"""A stretch never costs more than this: the plan, or a person, may be wrong somewhere."""
DRIFT_M, DRIFT_SHARE = 0.15, 0.02
"""Error per axis of the way between two stretches: a constant, and a share of half of it."""
DRIFT_RAD, DRIFT_PER_M = np.radians(2.5), 12.0
"""Standard deviation of the turn over so many metres."""
WIDE_RAD, WIDE_SHARE = np.radians(25.0), 0.02
"""With this share for each unconnected step its turn is much larger than expected."""


@dataclass(frozen=True)
class PoseGrid:
    """Poses on a plan: (yaws, rows, columns), positions on the grid of the costs.

    A walk over several floors has costs of each of the ``floors`` by number, all on the same cells.
    """

    costs: WallCosts
    floors: Mapping[int, WallCosts] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Yaws, rows and columns."""
        return (YAWS, *self.costs.positions.shape)

    @cached_property
    def turns(self) -> ComplexArray:
        """(yaws,) complex, unit."""
        return np.asarray(np.exp(1j * YAW_RAD * np.arange(YAWS)))

    def costs_of(self, floor: int | None) -> WallCosts:
        """The costs on a floor."""
        return self.costs if floor is None else self.floors.get(floor, self.costs)

    def fit(self, shape: ComplexArray, yaws: IntArray, box: Box, floor: int | None = None) -> Float32Array:
        """Log-likelihood (k, r, c) of a stretch's points, relative to their middle, at the positions of a box for the
        ``yaws`` (k,).
        """
        parts = self.costs_of(floor).interleaved
        margin = round(REACH_M / POSITION_M)
        rows, columns = (side.stop - side.start for side in box)
        total = np.zeros((len(yaws), rows, columns), dtype=np.float32)
        reach = (margin - 1) * POSITION_M
        for number, turn in enumerate(self.turns[yaws]):
            turned = shape * turn
            x, y = (
                np.floor(axis.clip(-reach, reach) / FINE_M).astype(np.int64) + COARSE // 2 + COARSE * margin
                for axis in (turned.real, turned.imag)
            )
            x, y = x + COARSE * box[1].start, y + COARSE * box[0].start
            sum_of = total[number]
            starts = np.stack((y % COARSE, x % COARSE, y // COARSE, x // COARSE), axis=1)
            for part_y, part_x, low, left in starts.tolist():
                sum_of += parts[part_y, part_x, low : low + rows, left : left + columns]
        total *= -np.float32(SPACING_M)
        return np.maximum(total, np.float32(-WORST_NATS), out=total)

    def place(self, cells: IntArray) -> tuple[ComplexArray, FloatArray]:
        """Positions (k,), complex metres, and yaws (k,), rad, of flat indices (k,) into the poses."""
        yaw, row, column = np.unravel_index(cells, self.shape)
        x, y = self.costs.positions.centres_m(np.stack((row, column), axis=1)).T
        return np.asarray(x + 1j * y), np.asarray(YAW_RAD * yaw, dtype=np.float64)


@dataclass(frozen=True)
class Transition:
    """From the pose of a stretch to the next: half the step at the first yaw, a turn, half of it at the second."""

    grid: PoseGrid
    link: Link

    def forward(self, weight: Float32Array, least: float) -> tuple[Float32Array, IntArray]:
        """Spread weights (yaws, rows, columns); also the yaws (k,) that then have more than ``least``."""
        return self._spread(weight, 1, least)

    def backward(self, weight: Float32Array, least: float) -> tuple[Float32Array, IntArray]:
        """The same in the opposite direction (the transposed matrix)."""
        return self._spread(weight, -1, least)

    def density(
        self, before: ComplexArray, yaw_rad: FloatArray, after: ComplexArray, yaw_after_rad: FloatArray
    ) -> FloatArray:
        """Weights (m, k), up to a constant, of poses (k,) before those (m,) after."""
        half = self.link.step / 2
        came = before + half * np.exp(1j * yaw_rad)
        away = np.abs(after[:, None] - half * np.exp(1j * yaw_after_rad)[:, None] - came)
        turn = np.round((yaw_after_rad[:, None] - yaw_rad) / YAW_RAD).astype(np.int64) % YAWS
        return np.asarray(np.exp(-0.25 * (away / self._sigma_m) ** 2) * self._turn_kernel[turn])

    def _spread(self, weight: Float32Array, sign: int, least: float) -> tuple[Float32Array, IntArray]:
        some = np.flatnonzero(weight.any(axis=(1, 2)))
        box = box_around(weight)
        moved, box = self._moved(weight[some][:, *box], some, sign, box)
        turned = self._turn_kernel[(np.arange(YAWS)[:, None] - some) % YAWS]
        flat = turned @ moved.reshape(len(some), -1)
        kept = np.flatnonzero(flat.sum(axis=1) > least)
        moved, box = self._moved(flat[kept].reshape(-1, *moved.shape[1:]), kept, sign, box)
        spread = np.zeros(weight.shape, dtype=np.float32)
        spread[kept, *box] = moved
        return spread, kept

    @cached_property
    def _turn_kernel(self) -> Float32Array:
        """(yaws,) weights of each turn, symmetric."""
        link = self.link
        sigma = np.hypot(DRIFT_RAD * np.sqrt(link.way_m / DRIFT_PER_M), link.sigma_rad)
        turn = YAW_RAD * np.minimum(np.arange(YAWS), YAWS - np.arange(YAWS))
        wide = min(WIDE_SHARE * link.jumps, 0.2)
        kernel = np.zeros(YAWS)
        for share, width in ((1 - wide, sigma), (wide, np.hypot(sigma, WIDE_RAD))):
            weight = _normal(turn, float(width))
            kernel += share * weight / weight.sum()
        return kernel.astype(np.float32)

    @cached_property
    def _sigma_m(self) -> float:
        """Blur of half a step, per axis, metres."""
        own = np.hypot(DRIFT_M, DRIFT_SHARE * self.link.way_m / 2)
        yaw_m = YAW_RAD / np.sqrt(12) * abs(self.link.step) / 2
        sigma = np.sqrt((own**2 + self.link.sigma_m**2) / 2 + yaw_m**2)
        return float(np.hypot(sigma, POSITION_M / np.sqrt(12)))

    def _moved(self, weight: Float32Array, yaws: IntArray, sign: int, box: Box) -> tuple[Float32Array, Box]:
        """Move weights (k, r, c) in a box by half the step, turned by their yaws (k,), and blur; also the new box."""
        half = sign * self.link.step / 2 * self.grid.turns[yaws]
        reach = round((abs(self.link.step) / 2 + BLURRED_SIGMAS * self._sigma_m) / POSITION_M) + 1
        after = tuple(
            slice(max(side.start - reach, 0), min(side.stop + reach, count))
            for side, count in zip(box, self.grid.shape[1:], strict=True)
        )
        down, across = (
            _shifts(axis, self._sigma_m, before, then)
            for axis, before, then in zip((half.imag, half.real), box, after, strict=True)
        )
        return np.asarray(down @ weight @ across.transpose(0, 2, 1), dtype=np.float32), (after[0], after[1])


BLURRED_SIGMAS = 4.5
"""Weights spread as far as this."""


def box_around(weight: Float32Array) -> Box:
    """Rows and columns around all weights (yaws, rows, columns)."""
    some: BoolArray = np.asarray(weight.any(axis=0))
    rows, columns = (np.flatnonzero(some.any(axis=axis)) for axis in (1, 0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _shifts(by_m: FloatArray, sigma_m: float, before: slice, after: slice) -> Float32Array:
    """Matrices (k, a, b) that move values on the cells ``before`` (b) by distances (k,) to those ``after`` (a), and
    blur them; on all cells their sum stays the same.
    """
    offset = np.arange(after.start - before.stop + 1, after.stop - before.start) * POSITION_M
    reach = round(BLURRED_SIGMAS * sigma_m / POSITION_M) + 1
    beyond_cell = by_m - POSITION_M * np.round(by_m / POSITION_M)
    whole = _normal(POSITION_M * np.arange(-reach, reach + 1) - beyond_cell[:, None], sigma_m).sum(axis=1)
    kernel = _normal(offset - by_m[:, None], sigma_m) / whole[:, None]
    windows = np.lib.stride_tricks.sliding_window_view(kernel, before.stop - before.start, axis=1)
    return np.ascontiguousarray(windows[:, :, ::-1])


def _normal(away: FloatArray, sigma: float) -> Float32Array:
    """Weights of the values of a normal distribution, 1 at its mean."""
    weight = np.exp(-0.5 * (away / sigma) ** 2)
    return np.asarray(weight, dtype=np.float32)
