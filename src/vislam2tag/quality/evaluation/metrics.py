"""Errors reduced to what tables show (mean, median, root mean square, quantiles ...), and these tables as text.

Of one walk (one strategy in one session against one truth); of many, over walks as in the paper, and over points. Text
is CSV with one figure a field, and LaTeX with booktabs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from vislam2tag.common.error_statistics import (
    BINS,
    FEWEST_WALKS,
    LEVEL,
    counts_of,
    draws,
    interval,
    lower_edge_m,
    multiplicities,
)
from vislam2tag.common.tabular import TabularResult
from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.record import (
    DenseFigures,
    DenseRow,
    ErrorRow,
    FigureWithInterval,
    SessionEvaluation,
    StrategyErrors,
)
from vislam2tag.quality.evaluation.truth import PointErrors


@dataclass(frozen=True, repr=False)
class ErrorSummary(TabularResult):
    """Statistics of label errors, metres; all but the counts are NaN where nothing is labelled."""

    count: int
    """Points asked for."""
    labelled_share: float
    """Share of them with a position."""
    mean_m: float
    median_m: float
    rmse_m: float
    p75_m: float
    p95_m: float
    max_m: float


FIGURES = ("mean_m", "median_m", "rmse_m", "p75_m", "p95_m", "max_m")
"""Fields of an :class:`ErrorSummary` in metres, in the order of every table."""
DIRECTED = ("along_m", "across_m", "ahead_m")
"""Errors along and across the direction of walking, and by how much labels are ahead; metres."""


def summarise(errors_m: FloatArray) -> ErrorSummary:
    """Reduce errors (n,), NaN where there is no label, to their statistics."""
    labelled = errors_m[np.isfinite(errors_m)]
    if labelled.size == 0:
        return ErrorSummary(len(errors_m), 0.0, *([float("nan")] * len(FIGURES)))
    median, *upper = np.quantile(labelled, (0.5, 0.75, 0.95, 1.0)).tolist()
    rmse = float(np.sqrt(np.mean(labelled**2)))
    return ErrorSummary(
        len(errors_m), labelled.size / len(errors_m), float(labelled.mean()), float(median), rmse, *upper
    )


def average(walks: Sequence[ErrorSummary]) -> ErrorSummary:
    """Average the walks' statistics, each walk counting once; walks without any label count in the share only."""
    labelled = [walk for walk in walks if walk.labelled_share > 0]
    figures = np.array([[getattr(walk, name) for name in FIGURES] for walk in labelled])
    means = figures.mean(axis=0).tolist() if labelled else [float("nan")] * len(FIGURES)
    share = float(np.mean([walk.labelled_share for walk in walks])) if walks else 0.0
    return ErrorSummary(sum(walk.count for walk in walks), share, *means)


def points_within_sigma(points: PointErrors, max_sigma_m: float) -> PointErrors:
    """Take away the labels whose stated sigma exceeds ``max_sigma_m``, metres; labels without a sigma stay."""
    unsure = points.sigma_m > max_sigma_m
    return replace(points, label_bcs=np.where(unsure[:, None], np.nan, points.label_bcs))


def frames_within_sigma(trajectory: Trajectory, max_sigma_m: float) -> BoolArray:
    """Mask (n,) of the frames with a position that is as sure as that."""
    return np.asarray(has_position(trajectory.status) & ~(trajectory.sigma_m > max_sigma_m))


def strategy_errors(
    points: PointErrors, method: str, strategy: str, dense: DenseFigures | None = None
) -> StrategyErrors:
    """Reduce errors to the figures of one walk."""
    error = points.error_m[points.labelled]
    summary = summarise(points.error_m)
    return StrategyErrors(
        truth=points.kind,
        method=method,
        strategy=strategy,
        points=len(points),
        labelled=len(error),
        headed=int(np.isfinite(points.along_m).sum()),
        along_m=_mean(np.abs(points.along_m)),
        across_m=_mean(np.abs(points.across_m)),
        ahead_m=_mean(points.along_m),
        errors=counts_of(error),
        truth_sigma_m=_root_mean_square(points.truth_sigma_m),
        sum_m=round(float(error.sum()), 6),
        sum_m2=round(float((error**2).sum()), 6),
        dense=dense,
        **{name: _rounded(getattr(summary, name)) for name in FIGURES},
    )


def retention(local: BoolArray, strategy: BoolArray) -> float | None:
    """Share of the frames labelled by ``local`` (n,) that a strategy (n,) labels; None where there are none."""
    return _rounded(float((local & strategy).sum() / local.sum())) if local.any() else None


def _root_mean_square(values: FloatArray) -> float | None:
    """Over the values (n,) that are known; None where none is."""
    known = values[np.isfinite(values)]
    return _rounded(float(np.sqrt(np.mean(known**2)))) if len(known) else None


def _mean(values: FloatArray) -> float | None:
    """Mean of the finite ones of values (n,); None where there is none."""
    known = values[np.isfinite(values)]
    return _rounded(float(known.mean())) if len(known) else None


def _rounded(value: float) -> float | None:
    return round(value, 6) if np.isfinite(value) else None


ALL = "all"
ALL_WALKS, WITHOUT_FAULTS = "all walks", "without faults"
OVER_WALKS, OVER_POINTS = "walks", "points"
QUANTILES = {"median_m": 0.5, "p75_m": 0.75, "p95_m": 0.95}
_EDGES_M = np.array([lower_edge_m(index) for index in range(BINS + 1)])

Statistics = dict[str, FloatArray]
"""By name of the figure, its value (rounds,) in each round."""


def table_rows(sessions: Sequence[SessionEvaluation]) -> list[ErrorRow]:
    """Make the rows of each truth, method and strategy: all walks, each floor, each device; with and without faults."""
    found = []
    for truth, method, strategy in dict.fromkeys((m.truth, m.method, m.strategy) for s in sessions for m in s.measured):
        for group, chosen in _groups(sessions):
            sound = [session for session in chosen if session.faulty is False]
            for selection, included in ((ALL_WALKS, chosen), (WITHOUT_FAULTS, sound)):
                every = [one for session in included for one in session.measured]
                mine = [one for one in every if (one.truth, one.method, one.strategy) == (truth, method, strategy)]
                found += [_row(mine, over, group, selection) for over in (OVER_WALKS, OVER_POINTS) if mine]
    return found


def _groups(sessions: Sequence[SessionEvaluation]) -> Iterator[tuple[str, list[SessionEvaluation]]]:
    """All sessions; those of each floor and of each device, where there are several."""
    yield ALL, list(sessions)
    floors, devices = sorted({s.floor for s in sessions}), sorted({s.device for s in sessions})
    for floor in floors if len(floors) > 1 else ():
        yield f"floor {floor}", [s for s in sessions if s.floor == floor]
    for device in devices if len(devices) > 1 else ():
        yield device, [s for s in sessions if s.device == device]


def _row(mine: Sequence[StrategyErrors], over: str, group: str, selection: str) -> ErrorRow:
    statistics = _over_walks if over == OVER_WALKS else _over_points
    once = statistics(mine, np.arange(len(mine))[None])
    labelled_walks = sum(one.labelled > 0 for one in mine)
    again = statistics(mine, draws(len(mine))) if labelled_walks >= FEWEST_WALKS else {}
    again.pop("max_m", None)  # drawn walks never exceed the greatest: the bootstrap says nothing of maxima
    return ErrorRow(
        truth=mine[0].truth,
        method=mine[0].method,
        strategy=mine[0].strategy,
        group=group,
        selection=selection,
        over=over,
        walks=labelled_walks,
        points=sum(one.points for one in mine),
        **{name: _figure(float(once[name][0]), again.get(name)) for name in once},
    )


def _figure(value: float, rounds: FloatArray | None) -> FigureWithInterval:
    """A figure with its interval by ``rounds`` (rounds,) of the bootstrap."""
    if not np.isfinite(value):
        return FigureWithInterval(value=None)
    bounds = None if rounds is None else interval(rounds)
    low, high = (None, None) if bounds is None else (round(bound, 4) for bound in bounds)
    return FigureWithInterval(value=round(value, 4), low=low, high=high)


def _over_walks(mine: Sequence[StrategyErrors], drawn: IntArray) -> Statistics:
    """Statistics of the mean errors of the walks ``drawn`` (rounds, w); those without any label count in the share
    only.
    """
    means = np.array([np.nan if one.mean_m is None else one.mean_m for one in mine])[drawn]
    shares = np.array([one.labelled / one.points if one.points else np.nan for one in mine])[drawn]
    labelled = np.isfinite(means)
    count = labelled.sum(axis=1)
    total, squares = np.where(labelled, means, 0.0).sum(axis=1), np.where(labelled, means**2, 0.0).sum(axis=1)
    ranked = np.sort(means, axis=1)  # walks without a label, NaN, come last
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "labelled": np.nansum(shares, axis=1) / np.isfinite(shares).sum(axis=1),
            "mean_m": total / count,
            "rmse_m": np.sqrt(squares / count),
            **{name: _ranked_quantile(ranked, count, share) for name, share in QUANTILES.items()},
            "max_m": _ranked_quantile(ranked, count, 1.0),
            **{name: _mean_of(mine, drawn, name, np.ones(len(mine))) for name in DIRECTED},
        }


def _mean_of(mine: Sequence[StrategyErrors], drawn: IntArray, name: str, weight: FloatArray) -> FloatArray:
    """Weighted mean (rounds,) of a figure of the walks that have it; to be called where division by zero is NaN."""
    values = np.array([getattr(one, name) for one in mine], dtype=np.float64)
    known = np.where(np.isnan(values), 0.0, weight)
    return np.asarray((known * np.nan_to_num(values))[drawn].sum(axis=1) / known[drawn].sum(axis=1))


def _ranked_quantile(ranked: FloatArray, count: IntArray, share: float) -> FloatArray:
    """Quantile (rounds,) of the first ``count`` (rounds,) of each round's rising values, linear between them."""
    place = np.maximum(share * (count - 1), 0.0)
    below = np.floor(place).astype(np.int64)
    above = np.minimum(below + 1, np.maximum(count - 1, 0))
    rows = np.arange(len(ranked))
    low = ranked[rows, below]
    return np.asarray(low + (place - below) * (ranked[rows, above] - low))


def _error_counts(mine: Sequence[StrategyErrors]) -> IntArray:
    """Errors of the walks by bin of length (w, bins)."""
    errors = np.zeros((len(mine), BINS), dtype=np.int64)
    for row, one in zip(errors, mine, strict=True):
        row[list(one.errors)] = list(one.errors.values())
    return errors


def _over_points(mine: Sequence[StrategyErrors], drawn: IntArray) -> Statistics:
    """Statistics of all points' errors over walks ``drawn`` (rounds, w); quantiles, from counts by length, are good to
    a few percent.
    """
    times = multiplicities(drawn)
    points, labelled, sum_m, sum_m2 = (
        times @ np.array([getattr(one, name) for one in mine]) for name in ("points", "labelled", "sum_m", "sum_m2")
    )
    errors = times @ _error_counts(mine)
    greatest = np.max(np.array([-np.inf if one.max_m is None else one.max_m for one in mine])[drawn], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "labelled": labelled / points,
            "mean_m": sum_m / labelled,
            "rmse_m": np.sqrt(sum_m2 / labelled),
            **{name: np.minimum(_counted_quantile(errors, share), greatest) for name, share in QUANTILES.items()},
            "max_m": np.where(labelled > 0, greatest, np.nan),
            **{name: _mean_of(mine, drawn, name, np.array([float(one.headed) for one in mine])) for name in DIRECTED},
        }


def _counted_quantile(errors: IntArray, share: float) -> FloatArray:
    """Quantile (rounds,) of counts (rounds, bins), evenly spread within a bin; NaN where nothing is counted."""
    upto = np.cumsum(errors, axis=1)
    wanted = share * upto[:, -1]
    place = np.argmax(upto >= wanted[:, None], axis=1)
    rows = np.arange(len(errors))
    inside = errors[rows, place]
    into = (wanted - (upto[rows, place] - inside)) / inside
    return np.asarray(_EDGES_M[place] + (_EDGES_M[place + 1] - _EDGES_M[place]) * into)


@dataclass(frozen=True)
class ErrorCurve:
    """Share (k,) of *all* true points whose label is at most ``error_m`` (k,) off: it ends at the share labelled.

    ``low`` and ``high`` (k,) bound it in 95 of 100 such surveys; None of too few walks.
    """

    error_m: FloatArray
    share: FloatArray
    low: FloatArray | None
    high: FloatArray | None


def error_curve(walks: Sequence[StrategyErrors]) -> ErrorCurve | None:
    """Add up the walks of one strategy against one truth; None where no point has a label."""
    errors = _error_counts(walks)
    used = np.flatnonzero(errors.any(axis=0))
    if not len(used):
        return None
    bins = np.arange(max(used[0] - 1, 0), used[-1] + 1)
    upto = np.cumsum(errors, axis=1)[:, bins]
    points = np.array([one.points for one in walks], dtype=np.float64)
    low, high = None, None
    if len(walks) >= FEWEST_WALKS:
        times = multiplicities(draws(len(walks)))
        shares = (times @ upto) / (times @ points)[:, None]
        low, high = np.quantile(shares, ((1 - LEVEL) / 2, (1 + LEVEL) / 2), axis=0)
    edges = np.array([lower_edge_m(int(index) + 1) for index in bins])
    return ErrorCurve(edges, upto.sum(axis=0) / points.sum(), low, high)


_ROW_KEYS = ("truth", "method", "strategy", "group", "selection", "over", "walks", "points")
_WALK_FIGURES = ("points", "labelled", *FIGURES, *DIRECTED)
HEADS = {name: name.removesuffix("_m").replace("rmse", "RMSE") for name in (*FIGURES, *DIRECTED)}
"""What the figures are called in tables for reading."""


def rows_csv(rows: Sequence[ErrorRow]) -> str:
    """One line a row; each figure with its bounds in ``..._low`` and ``..._high``, empty where not known."""
    names = ("labelled", *FIGURES, *DIRECTED)
    head = (*_ROW_KEYS, *(f"{name}{end}" for name in names for end in ("", "_low", "_high")))
    return csv_rows((head, *((*(getattr(row, key) for key in _ROW_KEYS), *_bounds(row, names)) for row in rows)))


def _bounds(row: ErrorRow, names: Sequence[str]) -> list[float | None]:
    figures: list[FigureWithInterval] = [getattr(row, name) for name in names]
    return [value for figure in figures for value in (figure.value, figure.low, figure.high)]


def sessions_csv(sessions: Sequence[SessionEvaluation]) -> str:
    """One line for each session, truth, method and strategy; one with empty figures for a session without any."""
    who = ("floor", "device", "session", "faulty", "movement_m")
    head = (*who, "truth", "method", "strategy", "retention", *_WALK_FIGURES, "error")
    lines: list[tuple[object, ...]] = []
    for session in sessions:
        own = tuple(getattr(session, name) for name in who)
        for one in session.measured:
            figures = (getattr(one, name) for name in _WALK_FIGURES)
            kept = session.retention.get(one.strategy)
            lines.append((*own, one.truth, one.method, one.strategy, kept, *figures, session.error))
        if not session.measured:
            empty = (None,) * (4 + len(_WALK_FIGURES))
            lines.append((*own, *empty, session.error or "; ".join(session.missing)))
    return csv_rows((head, *lines))


def dense_csv(rows: Sequence[DenseRow]) -> str:
    """One line for each strategy and distance or speed."""
    names = tuple(DenseRow.model_fields)
    return csv_rows((names, *(tuple(getattr(row, name) for name in names) for row in rows)))


def latex_text(rows: Sequence[ErrorRow]) -> str:
    """A ``tabular`` (package booktabs) for each truth and method: over walks, with and without faults, metres."""
    shown = [row for row in rows if row.group == ALL and row.over == OVER_WALKS]
    return "\n".join(
        _tabular(f"{truth_name(truth, method)}, over walks", list(group))
        for (truth, method), group in groupby(shown, key=lambda row: (row.truth, row.method))
    )


def truth_name(truth: str, method: str) -> str:
    """What a truth, made by a method, is called in tables: ``control points (nearest)``."""
    words = {"dense": "dense truth"}.get(truth, truth.replace("_", " "))
    return f"{words} ({method})" if method else words


def _tabular(title: str, rows: Sequence[ErrorRow]) -> str:
    heads = ("Trajectories", "Strategy", "Walks", "Labelled", *(head[0].upper() + head[1:] for head in HEADS.values()))
    groups = groupby(sorted(rows, key=lambda row: row.selection), key=lambda row: row.selection)
    caption = f"{title}; metres, 95 % intervals in brackets"
    return latex_table(caption, (heads,), (map(_latex_row, group) for _, group in groups), texts=2)


def _latex_row(row: ErrorRow) -> tuple[str, ...]:
    share = "-" if row.labelled.value is None else rf"{100 * row.labelled.value:.0f}\,\%"
    figures = (_latex_figure(name, getattr(row, name)) for name in HEADS)
    return (row.selection, latex_escaped(row.strategy), str(row.walks), share, *figures)


def _latex_figure(name: str, figure: FigureWithInterval) -> str:
    """Write a figure, the interval of mean and median only: a page is narrow."""
    text = figure_text(figure if name in ("mean_m", "median_m") else FigureWithInterval(value=figure.value))
    return text.replace(" to ", ", ")


def figure_text(figure: FigureWithInterval) -> str:
    """Write ``0.31 [0.25 to 0.40]``; a dash where the figure is not known."""
    if figure.value is None:
        return "-"
    bounds = "" if figure.low is None else f" [{figure.low:.2f} to {figure.high:.2f}]"
    return f"{figure.value:.2f}{bounds}"
