"""A walk reduced to a map of the landmarks it passed, in its own frame: all that a joint survey needs of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.orientation import wrapped
from vislam2tag.estimation.smoothing import Smoothed


@dataclass(frozen=True)
class LinearMap:
    """A local map's observations about one solution, linear in the landmarks and in where the map's frame lies.

    ``column`` (3k,) of its landmarks' unknowns: x and y of each, then headings; ``residual`` (r,) observed minus
    predicted; ``design`` (r, 3k) by landmarks alone and ``frame`` (r, 3) by x, y, turn of its frame. ``covariance``
    (r, r) is the map's, taken ``walk_factor`` times; ``shift`` (r,), a diagonal, that of landmarks off their places.
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
        """The same with other doubts of the walk and of where it sees each landmark (k,), m^2."""
        headings = len(self.residual) - 2 * len(shift_m2)
        shift = np.concatenate((np.repeat(shift_m2, 2), np.zeros(headings)))
        return replace(self, walk_factor=walk_factor, shift=shift)

    @property
    def own(self) -> FloatArray:
        """(r, r) covariance of what the walk does not know."""
        return self.covariance * self.walk_factor

    @property
    def noise(self) -> FloatArray:
        """(r, r) the whole covariance."""
        return self.own + np.diag(self.shift)

    @cached_property
    def worth(self) -> FloatArray:
        """(r, r) of the observations in a frame that is known."""
        return np.asarray(np.linalg.inv(self.noise), dtype=np.float64)

    @cached_property
    def frame_covariance(self) -> FloatArray:
        """(3, 3) of where the frame lies, if the landmarks are known."""
        return np.asarray(np.linalg.inv(self.frame.T @ self.worth @ self.frame), dtype=np.float64)

    @cached_property
    def frame_gain(self) -> FloatArray:
        """(3, r) by how much observations move the frame, if the landmarks are known."""
        return np.asarray(self.frame_covariance @ self.frame.T @ self.worth)

    def equations(self) -> tuple[FloatArray, FloatArray]:
        """Information (3k, 3k) on the landmarks' unknowns once the frame has adapted itself, and right side (3k,)."""
        adapted = self.worth - self.worth @ self.frame @ self.frame_gain
        pull = self.design.T @ adapted
        return pull @ self.design, pull @ self.residual


@dataclass(frozen=True)
class LocalMap:
    """``k`` different landmarks in the frame of a walk; where that frame lies in the building is not known.

    ``landmark`` (k,) index of each; ``position`` (k,) complex, metres; ``heading_rad`` (k,) of the sheets, NaN where
    none was logged; ``covariance`` (3k, 3k) of x, y of each landmark, then of all headings (m^2, m rad, rad^2; rows
    and columns of missing headings mean nothing); ``passes`` (k,) how often each was passed.
    """

    landmark: IntArray
    position: ComplexArray
    heading_rad: FloatArray
    covariance: FloatArray
    passes: IntArray

    @classmethod
    def of(cls, smoothed: Smoothed) -> LocalMap:
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
        """Rows (r,) of :attr:`covariance` that mean something."""
        headings = np.flatnonzero(np.isfinite(self.heading_rad))
        return np.concatenate((np.arange(2 * len(self.landmark)), 2 * len(self.landmark) + headings))

    def select(self, keep: BoolArray) -> LocalMap:
        """Keep only the landmarks of a mask (k,)."""
        rows = np.flatnonzero(np.concatenate((np.repeat(keep, 2), keep)))
        return LocalMap(
            self.landmark[keep],
            self.position[keep],
            self.heading_rad[keep],
            self.covariance[np.ix_(rows, rows)],
            self.passes[keep],
        )

    def linearised(
        self,
        position: ComplexArray,
        heading_rad: FloatArray,
        frame: tuple[complex, float],
    ) -> LinearMap:
        """Linearise the map's observations about all landmarks' places (m,), complex metres, and headings (m,).

        ``frame`` is where the map's frame lies and how it is turned, rad. Nothing is doubted.
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
