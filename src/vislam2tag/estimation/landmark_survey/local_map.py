"""A walk reduced to a map of its landmarks in its own frame, and the initial joining of such maps.

The poses of the frames in the building are unknown. Two maps with two common landmarks, or with one whose sheet heading
both know, fit in one way. Maps are therefore joined to larger and larger submaps (charts); the survey is one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, with_rows
from vislam2tag.core.transforms import wrapped
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.smoother import SolvedWalk


@dataclass(frozen=True)
class LinearMap:
    """A local map's observations about one solution, linear in the landmarks and in the pose of the map's frame.

    ``column`` (3k,) of its landmarks' unknowns: x and y of each, then headings. ``residual`` (r,) is observed minus
    predicted; ``design`` (r, 3k) by landmarks alone and ``frame`` (r, 3) by x, y, turn of its frame. ``covariance``
    (r, r) is that of the map, with factor ``walk_factor``; ``shift`` (r,), a diagonal, that of the offsets of sights.
    Metres and rad.
    """

    column: IntArray
    residual: FloatArray
    design: FloatArray
    frame: FloatArray
    covariance: FloatArray
    walk_factor: float
    shift: FloatArray

    def doubted(self, walk_factor: float, shift_m2: FloatArray) -> LinearMap:
        """The same with other weights of the walk and other variances (k,) of its sights, m^2."""
        headings = len(self.residual) - 2 * len(shift_m2)
        shift = np.concatenate((np.repeat(shift_m2, 2), np.zeros(headings)))
        return replace(self, walk_factor=walk_factor, shift=shift)

    @property
    def own(self) -> FloatArray:
        """(r, r) covariance of the walk's own errors."""
        return self.covariance * self.walk_factor

    @property
    def noise(self) -> FloatArray:
        """(r, r) the whole covariance."""
        return self.own + np.diag(self.shift)

    @cached_property
    def worth(self) -> FloatArray:
        """(r, r) information of the observations in a known frame."""
        return np.asarray(np.linalg.inv(self.noise), dtype=np.float64)

    @cached_property
    def frame_covariance(self) -> FloatArray:
        """(3, 3) covariance of the frame's pose if the landmarks are known."""
        return np.asarray(np.linalg.inv(self.frame.T @ self.worth @ self.frame), dtype=np.float64)

    @cached_property
    def frame_gain(self) -> FloatArray:
        """(3, r) derivative of the frame's pose by the observations if the landmarks are known."""
        return np.asarray(self.frame_covariance @ self.frame.T @ self.worth)

    def equations(self) -> tuple[FloatArray, FloatArray]:
        """Information (3k, 3k) on the landmarks' unknowns with a free frame, and right side (3k,)."""
        adapted = self.worth - self.worth @ self.frame @ self.frame_gain
        pull = self.design.T @ adapted
        return pull @ self.design, pull @ self.residual


@dataclass(frozen=True)
class LocalMap:
    """``k`` different landmarks in the frame of a walk, whose pose in the building is unknown.

    ``landmark`` (k,) is the index of each; ``position`` (k,) complex, metres; ``heading_rad`` (k,) of the sheets, NaN
    if none was logged. ``covariance`` (3k, 3k) is of x, y of each landmark, then of all headings (m^2, m rad, rad^2);
    rows and columns of missing headings are invalid. ``passes`` (k,) is the number of passes of each.
    """

    landmark: IntArray
    position: ComplexArray
    heading_rad: FloatArray
    covariance: FloatArray
    passes: IntArray

    @classmethod
    def of(cls, smoothed: SolvedWalk) -> LocalMap:
        """Reduce a walk that was solved in its own frame; landmarks are the indices of its log's ids."""
        passes = smoothed.model.observations.passes
        landmark, count = np.unique(passes.landmark, return_counts=True)
        marks = len(smoothed.priors.position)
        columns = np.concatenate(((2 * landmark[:, None] + (0, 1)).ravel(), 2 * marks + landmark))
        headed = np.isin(landmark, passes.landmark[smoothed.model.headed])
        return cls(
            landmark=landmark,
            position=smoothed.landmark_position[landmark],
            heading_rad=np.where(headed, smoothed.landmark_heading_rad[landmark], np.nan),
            covariance=smoothed.solution.border_covariance[np.ix_(columns, columns)],
            passes=count.astype(np.int64),
        )

    @property
    def observed(self) -> IntArray:
        """Valid rows (r,) of :attr:`covariance`."""
        headings = np.flatnonzero(np.isfinite(self.heading_rad))
        return np.concatenate((np.arange(2 * len(self.landmark)), 2 * len(self.landmark) + headings))

    def select(self, keep: BoolArray) -> LocalMap:
        """Select the landmarks of a mask (k,)."""
        rows = np.flatnonzero(np.concatenate((np.repeat(keep, 2), keep)))
        some = with_rows(self, keep, "landmark", "position", "heading_rad", "passes")
        return replace(some, covariance=self.covariance[np.ix_(rows, rows)])

    def linearised(
        self,
        position: ComplexArray,
        heading_rad: FloatArray,
        frame: tuple[complex, float],
    ) -> LinearMap:
        """Linearise the map's observations about all landmarks' places (m,), complex metres, and headings (m,).

        ``frame`` is the position and rotation (rad) of the map's frame. All weights are usual.
        """
        k, landmark = len(self.landmark), self.landmark
        turn = np.exp(-1j * frame[1])
        arm = turn * (position[landmark] - frame[0])
        miss = self.position - arm
        turned = self.heading_rad - heading_rad[landmark] + frame[1]
        rotation = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
        design = np.eye(3 * k)
        x = 2 * np.arange(k)
        for i, j in np.ndindex(2, 2):
            design[x + i, x + j] = rotation[i, j]
        by_frame = np.zeros((3 * k, 3))
        by_frame[: 2 * k, :2] = np.tile(-rotation, (k, 1))
        by_frame[: 2 * k, 2] = np.column_stack((arm.imag, -arm.real)).ravel()
        by_frame[2 * k :, 2] = -1
        residual = np.concatenate((np.column_stack((miss.real, miss.imag)).ravel(), wrapped(turned)))
        column = np.concatenate(((2 * landmark[:, None] + (0, 1)).ravel(), 2 * len(position) + landmark))
        rows = self.observed
        covariance = self.covariance[np.ix_(rows, rows)]
        return LinearMap(column, residual[rows], design[rows], by_frame[rows], covariance, 1.0, np.zeros(len(rows)))


LEAST_APART_M = 1.0
"""Smallest distance between two landmarks that determine a rotation."""
SAME_PLACE_M = 0.5
SAME_PLACE_SHARE = 0.03
"""Tolerance for the place of a landmark in two maps, as a share of the extent of the common landmarks."""
SAME_HEADING_RAD = 0.1
"""Tolerance for headings; logged headings of sheets have errors of some hundredths."""
FEWEST_AGREEING = 2
"""Number of landmarks or headings that must agree before maps are joined."""
MOST_PAIRS = 300
"""Of many pairs of landmarks only those farthest apart determine possible rotations."""


@dataclass(frozen=True)
class Chart:
    """A submap: local maps joined in one frame, with ``m`` landmarks and ``b`` maps.

    ``position`` (m,) complex, metres, and ``heading_rad`` (m,) are NaN if unknown; ``origin`` (b,) complex and
    ``turn_rad`` (b,) are the poses of the maps' frames, NaN for maps that are not part of it.
    """

    position: ComplexArray
    heading_rad: FloatArray
    origin: ComplexArray
    turn_rad: FloatArray
    is_survey: bool = False
    """Whether the frame is the BCS."""

    @classmethod
    def of_map(cls, own: LocalMap, number: int, maps: int, landmarks: int) -> Chart:
        """Make a chart from one local map, the one with this number."""
        chart = cls._blank(maps, landmarks)
        chart.position[own.landmark] = own.position
        chart.heading_rad[own.landmark] = own.heading_rad
        chart.origin[number] = chart.turn_rad[number] = 0
        return chart

    @classmethod
    def of_survey(cls, priors: LandmarkPriors, maps: int) -> Chart:
        """Make a chart from the survey."""
        blank = cls._blank(maps, len(priors.position))
        return replace(blank, position=priors.position, heading_rad=priors.heading_rad, is_survey=True)

    @classmethod
    def _blank(cls, maps: int, landmarks: int) -> Chart:
        return cls(
            np.full(landmarks, np.nan + 0j),
            np.full(landmarks, np.nan),
            np.full(maps, np.nan + 0j),
            np.full(maps, np.nan),
        )

    @property
    def size(self) -> int:
        """Number of landmarks with a place."""
        return int(np.isfinite(self.position).sum())

    @property
    def members(self) -> BoolArray:
        """(b,) maps that are part of it."""
        return np.asarray(np.isfinite(self.turn_rad))

    def common(self, other: Chart) -> int:
        """Number of landmarks that connect two charts; 0 if they do not determine the rotation."""
        both = np.flatnonzero(np.isfinite(self.position) & np.isfinite(other.position))
        headed = np.isfinite(self.heading_rad[both] + other.heading_rad[both]).any()
        apart = np.abs(self.position[both] - self.position[both[:1]]).max(initial=0.0)
        return len(both) if headed or apart > LEAST_APART_M else 0

    def moved(self, turn_rad: float, shift: complex) -> Chart:
        """The same chart in a frame that is turned and shifted (metres)."""
        turn = np.exp(1j * turn_rad)
        return Chart(
            self.position * turn + shift,
            self.heading_rad + turn_rad,
            self.origin * turn + shift,
            self.turn_rad + turn_rad,
            self.is_survey,
        )

    def with_chart(self, other: Chart) -> Chart | None:
        """Add another chart to this one, whose places have priority; None if they contradict each other."""
        fit = _fit(self, other)
        if fit is None:
            return None
        added = other.moved(*fit)
        return replace(
            self,
            position=np.where(np.isfinite(self.position), self.position, added.position),
            heading_rad=np.where(np.isfinite(self.heading_rad), self.heading_rad, added.heading_rad),
            origin=np.where(self.members, self.origin, added.origin),
            turn_rad=np.where(self.members, self.turn_rad, added.turn_rad),
        )


def tied_to_survey(maps: Sequence[LocalMap], priors: LandmarkPriors) -> Chart:
    """Join all maps that can be connected to the survey, directly or through others; the chart is in the BCS."""
    charts = [Chart.of_map(one, number, len(maps), len(priors.position)) for number, one in enumerate(maps)]
    charts = [Chart.of_survey(priors, len(maps)), *_grown(charts)]
    before = len(charts) + 1
    while len(charts) < before:
        before = len(charts)
        charts = _grown(charts)
    return next(chart for chart in charts if chart.is_survey)


def _grown(charts: Sequence[Chart]) -> list[Chart]:
    """Add everything that fits to the largest chart, best connections first; repeat with the remaining ones."""
    waiting = sorted(charts, key=lambda chart: -chart.size)
    grown = []
    while waiting:
        chart, contradicting = waiting.pop(0), set[int]()
        while waiting:
            ties = [0 if i in contradicting else chart.common(one) for i, one in enumerate(waiting)]
            best = int(np.argmax(ties))
            if not ties[best]:
                break
            first, second = (waiting[best], chart) if waiting[best].is_survey else (chart, waiting[best])
            together = first.with_chart(second)
            if together is None:
                contradicting.add(best)
            else:
                chart = together
                waiting.pop(best)
                contradicting.clear()
        grown.append(chart)
    return grown


def _fit(first: Chart, second: Chart) -> tuple[float, complex] | None:
    """Rotation and shift of the second chart that fit most common landmarks."""
    both = np.flatnonzero(np.isfinite(first.position) & np.isfinite(second.position))
    a, b = first.position[both], second.position[both]
    heading = first.heading_rad[both] - second.heading_rad[both]
    heading = heading[np.isfinite(heading)]
    turns = np.concatenate((heading, _turns_of_pairs(a, b)))
    place_m = SAME_PLACE_M + SAME_PLACE_SHARE * float(np.abs(a - a.mean()).max())
    shift = a - b * np.exp(1j * turns[:, None])
    middle = np.median(shift.real, axis=1) + 1j * np.median(shift.imag, axis=1)
    off = np.abs(shift - middle[:, None]) / place_m
    off_rad = wrapped(heading - turns[:, None]) / SAME_HEADING_RAD
    agreeing = np.sum(off < 1, axis=1) + np.sum(np.abs(off_rad) < 1, axis=1)
    cost = np.log1p(off**2).sum(axis=1) + np.log1p(off_rad**2).sum(axis=1)
    cost[agreeing < FEWEST_AGREEING] = np.inf
    best = int(np.argmin(cost)) if len(turns) else -1
    return (float(turns[best]), complex(middle[best])) if best >= 0 and np.isfinite(cost[best]) else None


def _turns_of_pairs(a: ComplexArray, b: ComplexArray) -> FloatArray:
    """Rotations (q,), rad, that turn pairs of places ``b`` (k,) into the directions in ``a`` (k,), complex metres."""
    pairs: IntArray = np.array(list(combinations(range(len(a)), 2)), dtype=np.int64).reshape(-1, 2)
    apart_a, apart_b = (points[pairs[:, 1]] - points[pairs[:, 0]] for points in (a, b))
    apart = np.minimum(np.abs(apart_a), np.abs(apart_b))
    chosen = np.argsort(-apart, kind="stable")[:MOST_PAIRS]
    chosen = chosen[apart[chosen] > LEAST_APART_M]
    return np.angle(apart_a[chosen] * apart_b[chosen].conj())
