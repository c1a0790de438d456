"""Errors against a truth of the whole walk: how they grow with the distance walked, and with speed.

The distance walked is the truth's own length, known where its points follow each other within
:data:`~vislam2tag.quality.evaluation.truth.MAX_GAP_S`. Where the truth has holes, what spans them is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.settings import USUAL_TRUTH, TruthSettings
from vislam2tag.quality.evaluation.record import (
    DenseFigures,
    DenseRow,
    DriftSums,
    ErrorBin,
    RelativeErrorSums,
    SessionEvaluation,
)
from vislam2tag.quality.evaluation.truth import (
    MAX_GAP_S,
    STRIDE_S,
    PointErrors,
    Truth,
    TruthKind,
    walking_velocity,
)

DISTANCES_M = (1.0, 5.0, 10.0, 50.0)
"""Ways over which the error of the displacement is taken."""
SLACK_M = 0.5
"""A pair of points may lie this much further apart on the way than asked."""
SINCE_EDGES_M = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, np.inf)
"""Bins of the distance walked since the last landmark."""
SPEED_EDGES_M_S = (0.0, 0.3, 0.8, 1.2, 1.6, 2.5, np.inf)
"""Bins of the speed: standing, slow, usual, brisk, hurrying, running."""
_HOLE_M = 1e6
"""Way that a hole of the truth counts as: longer than any walk."""


@dataclass(frozen=True)
class TruePath:
    """A truth (t,) as a path: ``path_length_m`` (t,) so far, by far too long across holes, and ``velocity_bcs`` (t, 2),
    metres per second, NaN beside holes.
    """

    truth: Truth
    path_length_m: FloatArray
    velocity_bcs: FloatArray

    @classmethod
    def of(cls, truth: Truth) -> TruePath:
        """Measure path length and velocity."""
        hole = np.diff(truth.time_ns) > MAX_GAP_S * 1e9
        step = np.linalg.norm(np.diff(truth.position_bcs, axis=0), axis=1)
        path_length = np.append(0.0, np.cumsum(np.where(hole, _HOLE_M, step)))
        velocity = walking_velocity(truth.time_ns, truth.time_ns, truth.position_bcs)
        velocity[_beside_holes(truth.time_ns, hole)] = np.nan
        return cls(truth, path_length, velocity)

    @property
    def speed_m_s(self) -> FloatArray:
        """(t,) metres per second, NaN beside holes."""
        return np.asarray(np.linalg.norm(self.velocity_bcs, axis=1))

    def since_m(self, visits_ns: IntArray) -> FloatArray:
        """Distance (t,) walked since the last visit (v,), rising times; NaN before the first or across a hole."""
        time_ns = self.truth.time_ns
        visits_ns = visits_ns[(visits_ns >= time_ns[0]) & (visits_ns <= time_ns[-1])]
        if not len(visits_ns):
            return np.full(len(time_ns), np.nan)
        at_visit = np.interp(visits_ns - time_ns[0], time_ns - time_ns[0], self.path_length_m)
        last = np.searchsorted(visits_ns, time_ns, side="right") - 1
        since = self.path_length_m - at_visit[np.maximum(last, 0)]
        # A visit inside a hole is somewhere on the hole's great length.
        return np.where((last >= 0) & (since < _HOLE_M / 1e3), since, np.nan)


def _beside_holes(time_ns: IntArray, hole: BoolArray) -> BoolArray:
    """Mask (t,) of the points whose stride reaches into a hole."""
    stretch = np.append(0, np.cumsum(hole))
    first, last = np.searchsorted(stretch, stretch), np.searchsorted(stretch, stretch, side="right") - 1
    early = (time_ns - time_ns[first] < STRIDE_S * 1e9) & (stretch > 0)
    late = (time_ns[last] - time_ns < STRIDE_S * 1e9) & (stretch < stretch[-1])
    return np.asarray(early | late)


def dense_errors(trajectory: Trajectory, path: TruePath, settings: TruthSettings = USUAL_TRUTH) -> PointErrors:
    """Compare the label at each true point's time with it."""
    truth = path.truth
    labels = label_by_interpolation(truth.time_ns, trajectory, MAX_GAP_S)
    own_m = truth.sigma_or(settings.file_sigma_m)
    return PointErrors.of((TruthKind.DENSE, truth.time_ns, truth.position_bcs), labels, path.velocity_bcs, own_m)


def dense_figures(points: PointErrors, path: TruePath, visits_ns: IntArray) -> DenseFigures:
    """Reduce errors at a path's points; ``visits_ns`` (v,), rising, are the times of passing landmarks."""
    since, error = path.since_m(visits_ns), points.error_m
    inside = np.zeros(len(points), dtype=np.bool_)
    if len(visits_ns):
        inside = (points.time_ns >= visits_ns[0]) & (points.time_ns <= visits_ns[-1])
    return DenseFigures(
        relative=[_relative(points, path.path_length_m, distance) for distance in DISTANCES_M],
        since_landmark=_binned(since, error, SINCE_EDGES_M),
        drift=_drift(since, error),
        speed=_binned(np.where(inside, path.speed_m_s, np.nan), error, SPEED_EDGES_M_S),
    )


def relative_errors(points: PointErrors, path_length_m: FloatArray, distance_m: float) -> FloatArray:
    """Error (p,) of the displacement from each point to the one ``distance_m`` of way later, metres, both labelled."""
    later = np.searchsorted(path_length_m, path_length_m + distance_m)
    start = np.flatnonzero(later < len(path_length_m))
    end = later[start]
    near = path_length_m[end] - path_length_m[start] <= distance_m + SLACK_M
    residual = points.residual_bcs
    error = np.linalg.norm(residual[end[near]] - residual[start[near]], axis=1)
    return np.asarray(error[np.isfinite(error)])


def _relative(points: PointErrors, path_length_m: FloatArray, distance_m: float) -> RelativeErrorSums:
    """Sums of the relative errors; ``path_length_m`` (t,)."""
    error = relative_errors(points, path_length_m, distance_m)
    return RelativeErrorSums(
        distance_m=distance_m, pairs=len(error), sum_m=float(error.sum()), sum_m2=float((error**2).sum())
    )


def _binned(values: FloatArray, error_m: FloatArray, edges: tuple[float, ...]) -> list[ErrorBin]:
    """Count points by bin of their values (t,), NaN in none."""
    index = np.searchsorted(edges, values, side="right") - 1
    bins = []
    for number in range(len(edges) - 1):
        here = error_m[(index == number) & np.isfinite(values)]
        labelled = here[np.isfinite(here)]
        bins.append(ErrorBin(points=len(here), labelled=len(labelled), sum_m=float(labelled.sum())))
    return bins


def _drift(since_m: FloatArray, error_m: FloatArray) -> DriftSums:
    """Sums over the points where both distance (t,) and error (t,) are known, metres."""
    both = np.isfinite(since_m) & np.isfinite(error_m)
    d, e = since_m[both], error_m[both]
    return DriftSums(
        points=len(d),
        distance_m=d.sum(),
        error_m=e.sum(),
        distance_m2=(d * d).sum(),
        distance_error_m2=(d * e).sum(),
    )


def drift_per_metre(walks: Sequence[DriftSums]) -> float | None:
    """Slope of errors against the way since the last landmark, within walks; None where there is only one way.

    One slope for all walks, each with a height of its own: a walk that is wrong as a whole does not count as drift.
    """
    known = [one for one in walks if one.points]
    spread = sum(one.distance_m2 - one.distance_m**2 / one.points for one in known)
    if spread <= 1e-9 * max(sum(one.distance_m2 for one in known), 1.0):
        return None
    return float(sum(one.distance_error_m2 - one.distance_m * one.error_m / one.points for one in known) / spread)


RELATIVE, SINCE_LANDMARK, SPEED = "relative error", "since landmark", "speed"


def dense_rows(sessions: Sequence[SessionEvaluation], strategies: Sequence[str]) -> list[DenseRow]:
    """Rows of each strategy: relative errors, errors by the way since the last landmark, and by speed."""
    rows = []
    for strategy in strategies:
        figures = _figures(sessions, strategy)
        if figures:
            rows += _relative_rows(strategy, figures)
            since, speed = ([getattr(one, name) for one in figures] for name in ("since_landmark", "speed"))
            rows += _bin_rows(strategy, SINCE_LANDMARK, SINCE_EDGES_M, since)
            rows += _bin_rows(strategy, SPEED, SPEED_EDGES_M_S, speed)
    return rows


def survey_drift(sessions: Sequence[SessionEvaluation], strategies: Sequence[str]) -> dict[str, float | None]:
    """By how much each strategy's error grows with a metre since the last landmark; none without dense truth."""
    found = {}
    for strategy in strategies:
        figures = _figures(sessions, strategy)
        if figures:
            slope = drift_per_metre([one.drift for one in figures])
            found[strategy] = None if slope is None else round(slope, 6)
    return found


def _figures(sessions: Sequence[SessionEvaluation], strategy: str) -> list[DenseFigures]:
    return [
        one.dense
        for session in sessions
        for one in session.measured
        if one.strategy == strategy and one.dense is not None
    ]


def _relative_rows(strategy: str, figures: Sequence[DenseFigures]) -> list[DenseRow]:
    rows = []
    for same in zip(*(one.relative for one in figures), strict=True):
        pairs, way = sum(one.pairs for one in same), same[0].distance_m
        rows.append(
            DenseRow(
                strategy=strategy,
                what=RELATIVE,
                low=way,
                high=way,
                points=pairs,
                mean_m=round(sum(one.sum_m for one in same) / pairs, 4) if pairs else None,
                rmse_m=round((sum(one.sum_m2 for one in same) / pairs) ** 0.5, 4) if pairs else None,
            )
        )
    return rows


def _bin_rows(
    strategy: str, what: str, edges: Sequence[float], sessions: Sequence[Sequence[ErrorBin]]
) -> list[DenseRow]:
    """One row for each bin in which there are points."""
    rows = []
    for low, high, same in zip(edges, edges[1:], zip(*sessions, strict=True), strict=False):
        points, labelled = sum(one.points for one in same), sum(one.labelled for one in same)
        if points:
            rows.append(
                DenseRow(
                    strategy=strategy,
                    what=what,
                    low=low,
                    high=high if np.isfinite(high) else None,
                    points=points,
                    mean_m=round(sum(one.sum_m for one in same) / labelled, 4) if labelled else None,
                    labelled=round(labelled / points, 4),
                )
            )
    return rows
