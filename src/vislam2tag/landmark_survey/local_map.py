"""A walk reduced to a map of the landmarks it passed, in its own frame: all that a joint survey needs of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.smoother.smoothing import Smoothed


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
