"""The paper's evaluation (section VI) by its own rules: each walk's errors by strategy, Tables I and II as text.

A table has one error a walk and strategy, then statistics over the walks, beside the paper's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import NamedTuple

import numpy as np

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table
from vislam2tag.core.tracks import LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.quality.evaluation.metrics import points_within_sigma
from vislam2tag.quality.evaluation.press_truth import is_faulty, nearest_point_errors, walk_error
from vislam2tag.quality.evaluation.station_clock import JUMP_M, clock_offset, station_point_errors
from vislam2tag.quality.evaluation.station_frame import StationTrack
from vislam2tag.quality.evaluation.truth import PointErrors, Truth
from vislam2tag.sessions.model import Session
from vislam2tag.site.model import Floor, SessionKey

PAPER_TABLE_1 = {
    "local": (0.91, 0.63, 4.51),
    "local-corrected": (0.53, 0.49, 0.87),
    "global-affine": (2.80, 0.54, 20.78),
}
"""Mean, median and maximum over all walks at control points, metres (the paper's global is an affine map here)."""
PAPER_TABLE_1_NON_FAULTY = {"local": (0.51, 0.49, 0.72), "global-affine": (0.43, 0.40, 0.72)}
PAPER_TABLE_2 = {"local": (0.73, 0.23, 2.68), "local-corrected": (0.18, 0.18, 0.31)}
"""Mean, median and maximum over the walks in the total station's view, metres."""
PUBLISHED = tuple(PAPER_TABLE_1)
"""Strategies that the paper evaluates."""
METRICS = ("mean", "median", "maximum")

_Published = dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class WalkErrors:
    """Mean error of one walk by strategy, metres; NaN where the strategy labels nothing."""

    key: SessionKey
    error_m: dict[str, float]
    faulty: bool


class WalkSummary(NamedTuple):
    """Statistics over walks, metres, in the order of :data:`METRICS`."""

    walks: int
    mean_m: float
    median_m: float
    max_m: float


def summarise_walks(walks: Sequence[WalkErrors], strategy: str) -> WalkSummary:
    """Reduce the walks that this strategy labels (at least in part) to mean, median and maximum."""
    errors = np.array([walk.error_m[strategy] for walk in walks])
    errors = errors[np.isfinite(errors)]
    if not errors.size:
        return WalkSummary(0, float("nan"), float("nan"), float("nan"))
    return WalkSummary(len(errors), float(errors.mean()), float(np.median(errors)), float(errors.max()))


@dataclass(frozen=True)
class Cell:
    """One statistic of one strategy, metres: ours (NaN where no walk is labelled) and the paper's, where it has one."""

    strategy: str
    here_m: float
    paper_m: float | None
    walks: int


@dataclass(frozen=True)
class TableRow:
    """One statistic over a selection of the walks, a cell for each strategy."""

    selection: str
    metric: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper: rows of the same strategies."""

    title: str
    rows: tuple[TableRow, ...]


def table_1(walks: Sequence[WalkErrors], strategies: Sequence[str]) -> PaperTable:
    """Errors at control points, over all walks and over those without faults."""
    sound = [walk for walk in walks if not walk.faulty]
    rows = _rows("all trajectories", walks, strategies, PAPER_TABLE_1)
    rows += _rows("non-faulty trajectories", sound, strategies, PAPER_TABLE_1_NON_FAULTY)
    return PaperTable("Table I: error at control points, over walks (metres)", rows)


def table_2(walks: Sequence[WalkErrors], strategies: Sequence[str]) -> PaperTable:
    """Errors against the total station, over all walks."""
    rows = _rows("all trajectories", walks, strategies, PAPER_TABLE_2)
    return PaperTable("Table II: error against the total station, over walks (metres)", rows)


def _rows(
    selection: str, walks: Sequence[WalkErrors], strategies: Sequence[str], published: _Published
) -> tuple[TableRow, ...]:
    ours = {name: summarise_walks(walks, name) for name in strategies}
    rows = []
    for number, metric in enumerate(METRICS):
        theirs = {name: figures[number] for name, figures in published.items()}
        cells = (Cell(name, ours[name][1 + number], theirs.get(name), ours[name].walks) for name in strategies)
        rows.append(TableRow(selection, metric, tuple(cells)))
    return tuple(rows)


CLOCK_STRATEGY = "local-corrected"
"""Whose errors the clock offset makes least, as in the paper."""


def station_settings(settings: MappingSettings) -> MappingSettings:
    """Settings with which the paper maps walks before the total station: shorter steps are breaks."""
    return settings.model_copy(update={"max_step_m": JUMP_M})


def station_walks(
    sessions: Sequence[tuple[Session, TrajectoryByStrategy, StationTrack]],
    bcs_T_station: Similarity2,
    max_sigma_m: float,
) -> list[PaperWalk]:
    """Compare the mapped sessions of one phone with the station's tracks (see :func:`paper_walk` for the labels).

    As in the paper the clock offset is fitted to the very errors it is then used for.
    """
    clock_ns = clock_offset([(mapped[CLOCK_STRATEGY], track) for _, mapped, track in sessions], bcs_T_station)
    walks = []
    for session, mapped, track in sessions:
        truth = Truth(track.time_ns - clock_ns, bcs_T_station @ track.position)
        walks.append(paper_walk(session, mapped, partial(station_point_errors, truth=truth), max_sigma_m))
    return walks


def landmark_movement_m(log: LandmarkLog) -> float:
    """Mean displacement of the logged landmarks in the plane of the ACS, metres; NaN where none was logged.

    A sheet hangs still, so its logged positions would be one. A landmark's displacement is the mean distance of its
    positions from their median, which is what a mapping of the whole walk takes for its place; rows of lost tracking do
    not count. Each landmark counts once.
    """
    plane = log.plane_acs
    means = []
    for index in range(len(log.ids)):
        rows = log.rows_of(index)
        logged = plane[rows][~log.lost[rows]]
        if len(logged):
            means.append(np.linalg.norm(logged - np.median(logged, axis=0), axis=1).mean())
    return float(np.mean(means)) if means else float("nan")


STRATEGIES = ("local", "local-corrected", "global-affine", "smoother")
"""The paper's three, whose least squares at control points is an affine map, and the smoother beside them."""

TrajectoryByStrategy = dict[str, Trajectory]


@dataclass(frozen=True)
class PaperWalk:
    """One walk's labels against one kind of truth, by strategy."""

    key: SessionKey
    points: dict[str, PointErrors]
    faulty: bool
    """Whether ``local-corrected`` discards anything that ``local`` maps."""
    movement_m: float
    """See :func:`~vislam2tag.quality.evaluation.paper.landmark_movement_m`."""
    max_sigma_m: float
    """Labels whose stated sigma exceeds this do not count, as the paper discards what it doubts; metres."""

    @property
    def counted(self) -> dict[str, PointErrors]:
        """The points with those labels only that count."""
        return {name: points_within_sigma(points, self.max_sigma_m) for name, points in self.points.items()}

    @property
    def errors(self) -> WalkErrors:
        """The walk's mean error by strategy."""
        means = {name: walk_error(points.error_m) for name, points in self.counted.items()}
        return WalkErrors(self.key, means, self.faulty)


def map_all(session: Session, landmarks: Landmarks, settings: MappingSettings) -> TrajectoryByStrategy:
    """Map a session with each of :data:`STRATEGIES`."""
    return {
        name: strategy_named(name, settings).map(session.camera, session.landmarks, landmarks) for name in STRATEGIES
    }


def paper_walk(
    session: Session, mapped: TrajectoryByStrategy, compare: Callable[[Trajectory], PointErrors], max_sigma_m: float
) -> PaperWalk:
    """Compare each of a session's trajectories with the truth."""
    points = {name: compare(trajectory) for name, trajectory in mapped.items()}
    faulty = is_faulty(mapped["local"], mapped["local-corrected"])
    return PaperWalk(session.key, points, faulty, landmark_movement_m(session.landmarks), max_sigma_m)


def press_walk(session: Session, floor: Floor, mapped: TrajectoryByStrategy, max_sigma_m: float) -> PaperWalk:
    """Compare a mapped session with the control points, at least one, nearest to its presses."""
    return paper_walk(session, mapped, lambda one: nearest_point_errors(one, session.presses_ns, floor), max_sigma_m)


def labelled_shares(walks: Sequence[PaperWalk]) -> dict[str, float]:
    """Share of all the walks' points that count as labelled, by strategy; nothing where there are no points."""
    counted = [walk.counted for walk in walks]
    labelled = {name: np.concatenate([one[name].labelled for one in counted]) for name in STRATEGIES if counted}
    return {name: float(mask.mean()) for name, mask in labelled.items() if len(mask)}


NONE = "-"


def csv_text(table: PaperTable) -> str:
    """One line for each cell: ``trajectories,metric,strategy,walks,here_m,paper_m``; empty where there is no figure."""
    rows: list[Sequence[object]] = [("trajectories", "metric", "strategy", "walks", "here_m", "paper_m")]
    for row in table.rows:
        for cell in row.cells:
            here = "" if math.isnan(cell.here_m) else f"{cell.here_m:.4f}"
            paper = "" if cell.paper_m is None else f"{cell.paper_m:.2f}"
            rows.append((row.selection, row.metric, cell.strategy, cell.walks, here, paper))
    return csv_rows(rows)


def walks_csv(walks: Sequence[PaperWalk]) -> str:
    """One line for each walk and strategy; ``error_m`` is empty where the strategy labels nothing."""
    head = ("floor", "device", "session", "truth", "faulty", "movement_m", "strategy", "points", "labelled", "error_m")
    rows: list[Sequence[object]] = [head]
    for walk in walks:
        means = walk.errors.error_m
        for name, points in walk.counted.items():
            key = (walk.key.floor, walk.key.device, walk.key.session, points.kind, walk.faulty)
            error = "" if math.isnan(means[name]) else f"{means[name]:.4f}"
            counts = (len(points), int(points.labelled.sum()))
            rows.append((*key, f"{walk.movement_m:.4f}", name, *counts, error))
    return csv_rows(rows)


def markdown_text(table: PaperTable, names: Mapping[str, str]) -> str:
    """Two columns for each strategy, called by ``names``: here, and in the paper."""
    heads = [head for cell in table.rows[0].cells for head in heads_of(cell, names[cell.strategy])]
    rows = [(f"{row.selection} ({_walks(row.cells)})", row.metric, *figures_in(row)) for row in table.rows]
    return markdown_table(table.title, ("trajectories", "metric", *heads), rows, texts=2)


def latex_text(table: PaperTable, names: Mapping[str, str]) -> str:
    """A ``tabular`` (packages booktabs and multirow), two columns for each strategy: here, and in the paper."""
    cells = table.rows[0].cells
    heads = [heads_of(cell, "here") for cell in cells]
    groups = [
        f"\\multicolumn{{{len(head)}}}{{c}}{{{latex_escaped(names[cell.strategy])}}}"
        for cell, head in zip(cells, heads, strict=True)
    ]
    title = (("Trajectories", "Metric", *groups), ("", "", *(head for pair in heads for head in pair)))
    rows = [list(group) for _, group in groupby(table.rows, key=lambda row: row.selection)]
    return latex_table(table.title, title, (_latex_group(group) for group in rows), texts=2)


def _latex_group(rows: Sequence[TableRow]) -> Iterator[tuple[str, ...]]:
    """Rows of one selection of trajectories, which is named once."""
    selection = rf"\multirow{{{len(rows)}}}{{*}}{{{rows[0].selection}}}"
    for number, row in enumerate(rows):
        yield ("" if number else selection, row.metric, *figures_in(row))


def figures_in(row: TableRow) -> list[str]:
    """The cells below the heads of a row's cells."""
    return [text for cell in row.cells for text in figures_of(cell)]


def heads_of(cell: Cell, name: str) -> tuple[str, ...]:
    """Heads of a cell's columns in a table for reading: the strategy's name, and "paper" where it has the strategy."""
    return (name, "paper") if cell.strategy in PUBLISHED else (name,)


def figures_of(cell: Cell) -> tuple[str, ...]:
    """The cells below :func:`heads_of`: metres with two decimals, a dash where there is no figure."""
    figures = (cell.here_m, math.nan if cell.paper_m is None else cell.paper_m)
    texts = tuple(NONE if math.isnan(figure) else f"{figure:.2f}" for figure in figures)
    return texts if cell.strategy in PUBLISHED else texts[:1]


def _walks(cells: Sequence[Cell]) -> str:
    """How many walks the strategies label: one number, or the least and the greatest."""
    counts = sorted({cell.walks for cell in cells})
    return f"{counts[0]} walks" if len(counts) == 1 else f"{counts[0]} to {counts[-1]} walks"
