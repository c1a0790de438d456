"""What an evaluation finds, as JSON (``evaluation.json``): one record a session, and rows that sum sessions up."""

from __future__ import annotations

from typing import ClassVar

from vislam2tag.common.findings import NOT_RUN, Finding, Judgement
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.quality.evaluation.odd_truth import OddPoint, PressOffset
from vislam2tag.quality.evaluation.truth import TruthKind


class ErrorBin(Record):
    """True points that have something in common: their number, how many have a label, and the sum of the errors."""

    points: int
    labelled: int
    sum_m: float


class RelativeErrorSums(Record):
    """Errors of the displacement over a distance walked: number of pairs, sum and sum of squares."""

    distance_m: float
    pairs: int
    sum_m: float
    sum_m2: float


class DriftSums(Record):
    """Sums over labelled points: of the distance since the last landmark, the error, and their products."""

    points: int = 0
    distance_m: float = 0.0
    error_m: float = 0.0
    distance_m2: float = 0.0
    distance_error_m2: float = 0.0


class DenseFigures(Record):
    """What only a truth of the whole walk shows; all of it adds up over sessions."""

    relative: list[RelativeErrorSums]
    since_landmark: list[ErrorBin]
    """By distance walked since the last landmark, :data:`~vislam2tag.quality.evaluation.dense.SINCE_EDGES_M`."""
    drift: DriftSums
    speed: list[ErrorBin]
    """Between first and last landmark, by speed, :data:`~vislam2tag.quality.evaluation.dense.SPEED_EDGES_M_S`."""


class StrategyErrors(Record):
    """One strategy in one session against one truth; metres, None where nothing is labelled."""

    truth: TruthKind
    method: str
    """How the truth was made of what was recorded; empty where there is only one method of making it."""
    strategy: str
    points: int
    labelled: int
    mean_m: float | None
    median_m: float | None
    rmse_m: float | None
    p75_m: float | None
    p95_m: float | None
    max_m: float | None
    headed: int
    """Labelled points at which the direction of walking is known."""
    along_m: float | None
    """Mean distance along the direction of walking, whatever its sign; None where no direction is known."""
    across_m: float | None
    ahead_m: float | None
    """Mean of the distance along with its sign: positive where labels are ahead of the truth."""
    truth_sigma_m: float | None
    """How exactly the true positions are known along each axis, root mean square; None if unknown."""
    errors: dict[int, int]
    """Number of errors by bin of length (:mod:`vislam2tag.common.error_statistics`)."""
    sum_m: float
    sum_m2: float
    dense: DenseFigures | None = None


class SessionEvaluation(Result):
    """One session."""

    main_table: ClassVar[str] = "measured"

    slug: str
    floor: int
    device: str
    session: str
    error: str | None = None
    """Why it could not be read or mapped; None where it could."""
    missing: list[str] = []
    """Why a truth that seems to be meant could not be used."""
    findings: list[Finding] = []
    faulty: bool | None = None
    """Whether ``local-corrected`` discards any frame that ``local`` maps; None where that maps none."""
    movement_m: float | None = None
    """Mean displacement of its landmarks' logged positions."""
    retention: dict[str, float | None] = {}
    """By strategy, the share that it labels of the frames that ``local`` labels."""
    estimates: dict[str, float | None] = {}
    """What was estimated of the truth: a lead, a clock, residuals of a frame; names end with the unit."""
    measured: list[StrategyErrors] = []
    presses: list[PressOffset] = []
    """Where the smoother's labels put the control points that were pressed at."""


class FigureWithInterval(Record):
    """A figure and its interval, which holds in 95 of 100 such surveys.

    The value is None where not known; the bounds are None of too few walks, and for maxima, for which the bootstrap is
    not valid.
    """

    value: float | None
    low: float | None = None
    high: float | None = None


class ErrorRow(Record):
    """One row of the table of errors: one strategy against one truth, over some walks."""

    truth: TruthKind
    method: str
    strategy: str
    group: str
    """``all``, or the floor or device that the walks have in common."""
    selection: str
    """``all walks`` or ``without faults``."""
    over: str
    """``walks``: statistics of the walks' mean errors; ``points``: of all points' errors."""
    walks: int
    """With a label at some true point."""
    points: int
    labelled: FigureWithInterval
    mean_m: FigureWithInterval
    median_m: FigureWithInterval
    rmse_m: FigureWithInterval
    p75_m: FigureWithInterval
    p95_m: FigureWithInterval
    max_m: FigureWithInterval
    along_m: FigureWithInterval
    """Mean distance along the direction of walking, whatever its sign."""
    across_m: FigureWithInterval
    ahead_m: FigureWithInterval
    """Mean of the distance along with its sign: positive where labels are ahead of the truth."""


class DenseRow(Record):
    """One strategy against dense truth, summed over all sessions."""

    strategy: str
    what: str
    """``relative error``, ``since landmark`` or ``speed``."""
    low: float
    """The distance, or the lower edge of the bin: metres, or metres per second."""
    high: float | None
    """Its upper edge; None where there is none."""
    points: int
    mean_m: float | None
    rmse_m: float | None = None
    """Root mean square; of relative errors only."""
    labelled: float | None = None
    """Share of the points; of bins only."""


class SurveyEvaluation(Result):
    """A whole survey (``evaluation.json``)."""

    main_table: ClassVar[str] = "rows"

    version: str
    strategies: list[str]
    max_sigma_m: float | str
    """Labels with a greater sigma are not counted as such."""
    rows: list[ErrorRow]
    dense: list[DenseRow]
    drift: dict[str, float | None]
    """By strategy, by how much the error grows with each metre walked since the last landmark."""
    retention: dict[str, float | None]
    """By strategy, mean over the sessions."""
    sessions: list[SessionEvaluation]
    odd_points: list[OddPoint] = []
    """Control points that several sessions put elsewhere, furthest first."""
    judgement: Judgement = NOT_RUN
    """Whether control points could be compared with one another; ``odd_points`` may be empty if not."""

    @property
    def failed(self) -> int:
        """Number of sessions that could not be read or mapped."""
        return sum(session.error is not None for session in self.sessions)
