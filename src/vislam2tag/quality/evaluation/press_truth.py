"""Label errors at control points: who pressed where, how late, and how far the label then was.

The truth of a press is found once per session from one strategy's labels (the reference), for all strategies. A written
route (``route.csv``) and all presses of a session determine the control points. The presses are a hidden Markov chain
over the points: a label's error is small and independent, or like that of the press before. Therefore a walk with
shifted labels finds its points. Forward and backward recursion give the probabilities (Rabiner 1989, section III).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.interpolation import Labels, label_by_interpolation
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.intake.ids import compare_ids
from vislam2tag.labeling.settings import USUAL_TRUTH, TruthSettings
from vislam2tag.quality.evaluation.truth import (
    MAX_GAP_S,
    PointErrors,
    TruthKind,
    nearest_points,
    press_covariance,
    usable_path,
    walking_velocity,
)
from vislam2tag.site.model import Floor
from vislam2tag.site.site_table import SiteTable, is_file, read_site_table

ROUTE_FILE = "route.csv"


def read_route(root: Path, session: Path, ids: Sequence[str]) -> IntArray | None:
    """Indices (r,) among the control points ``ids`` in walking order; None where no route is written down.

    The file in the ``session`` folder counts, else that of its floor (``floor_K/route.csv``). Its header is ``point``,
    then one id a line. Raises SurveyError where it cannot be read, has another header or names an unknown point.
    """
    paths = [folder / ROUTE_FILE for folder in (session, session.parent.parent)]
    path = next(filter(is_file, paths), None)
    if path is None:
        return None
    try:
        table = read_site_table(root, path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror}); check its permissions") from error
    if table.header[:1] != ("point",) or not table.rows:
        raise SurveyError(f"{path}: expected the header 'point', then the ids of control points in walking order")
    return np.array([_index(path, table, row, ids) for row in range(len(table.rows))], dtype=np.int64)


def _index(path: Path, table: SiteTable, row: int, ids: Sequence[str]) -> int:
    line, fields = table.rows[row]
    if fields[0] not in ids:
        named = tuple(dict.fromkeys(row[0] for _, row in table.rows))
        found = compare_ids(ids, named, ("refmarker.csv", "the route"))
        from_one = {str(number) for number in range(1, len(ids) + 1)}
        counting = "; control points are counted from 0" if ids and from_one.issuperset(named) else ""
        what = f"there is no control point '{fields[0]}' on this floor: {found.text}{counting}"
        raise SurveyError(f"{path}:{line}: {what}; correct the route")
    return list(ids).index(fields[0])


HAND_M = 0.5
"""How far the label at a press may usually lie from the point: a finger some tenths of a second off, metres."""
DRIFT_M_PER_S = 0.02
"""How fast the labels' own error may usually change, metres per second."""
ANEW = 0.5
"""Probability that a label's error is drawn again instead of like the one before."""
AGAIN = 0.02
"""Probability that a press is at the same point as the one before (a second tap)."""
SKIPPED = 0.03
"""Probability that a point of a given route is passed without a press."""
CLEAR = 10.0
"""A press is identified where its best point is so many times as probable as the second best."""


@dataclass(frozen=True)
class _Chain:
    """States ``s``: the point (s,) that each stands for, probabilities to start in (s,) and to go on to (s, s)."""

    point: IntArray
    start: FloatArray
    onward: FloatArray


def identify_presses(
    time_ns: IntArray,
    label_bcs: FloatArray,
    sigma_m: FloatArray,
    points_bcs: FloatArray,
    route: IntArray | None = None,
) -> tuple[IntArray, FloatArray]:
    """At which of the points (p, 2) each press was made: their indices (k,), -1 where it is not clear, and the
    probability (k,) of the best one, clear or not.

    ``time_ns`` (k,) of the presses, rising. ``label_bcs`` (k, 2) metres, NaN without a label, and ``sigma_m`` (k,), NaN
    where not stated, are where a strategy puts them. ``route`` (r,) are the indices of the points in the order in which
    they were passed, if that is known: presses may then be missing or double, but not out of order.
    """
    chain = _free_chain(len(points_bcs)) if route is None else _route_chain(route)
    if not len(time_ns):
        return np.empty(0, dtype=np.int64), np.empty(0)
    errors = label_bcs[:, None] - points_bcs[chain.point]
    found = _posterior(chain, errors, np.nan_to_num(sigma_m), np.diff(time_ns) * 1e-9)
    posterior = np.zeros((len(time_ns), len(points_bcs)))
    np.add.at(posterior.T, chain.point, found.T)
    return _clear_ones(posterior)


def _free_chain(points: int) -> _Chain:
    """Any point may follow any other; seldom the same."""
    onward = np.full((points, points), (1 - AGAIN) / max(points - 1, 1))
    np.fill_diagonal(onward, AGAIN if points > 1 else 1.0)
    return _Chain(np.arange(points), np.full(points, 1 / max(points, 1)), onward)


def _route_chain(route: IntArray) -> _Chain:
    """The states are the places of the route (r,): on to the next, seldom to one after it or the same."""
    place = np.arange(len(route), dtype=np.float64)
    ahead = place - place[:, None]
    onward = np.where(ahead > 0, (1 - AGAIN) * (1 - SKIPPED) * SKIPPED ** np.maximum(ahead - 1, 0), 0.0)
    return _Chain(route, (1 - SKIPPED) * SKIPPED**place, onward + AGAIN * np.eye(len(route)))


def _between(error_bcs: FloatArray, sigma_m: FloatArray, gap_s: FloatArray, press: int) -> FloatArray:
    """Density (s, s) of the labels' errors (k, s, 2) at a press in each state, from each state of the one before."""
    alone = np.broadcast_to(_alone(error_bcs[press], sigma_m[press]), (error_bcs.shape[1],) * 2)
    change = error_bcs[press] - error_bcs[press - 1][:, None]
    if not np.isfinite(change).all():
        return alone
    scale = np.hypot(np.sqrt(2) * HAND_M, DRIFT_M_PER_S * gap_s[press - 1])
    return ANEW * alone + (1 - ANEW) * _heavy_tailed(change, float(scale))


def _alone(error_bcs: FloatArray, sigma_m: float) -> FloatArray:
    """Density (s,) of the errors (s, 2) at a press, whatever they were at the one before."""
    if not np.isfinite(error_bcs).all():
        return np.ones(len(error_bcs))
    return _heavy_tailed(error_bcs, float(np.hypot(HAND_M, sigma_m)))


def _heavy_tailed(error_m: FloatArray, scale_m: float) -> FloatArray:
    """Density (...) of errors (..., 2): Student's t in the plane with two degrees of freedom."""
    squared = (error_m**2).sum(axis=-1) / scale_m**2
    return np.asarray((1 + squared / 2) ** -2 / (2 * np.pi * scale_m**2))


def _posterior(chain: _Chain, error_bcs: FloatArray, sigma_m: FloatArray, gap_s: FloatArray) -> FloatArray:
    """Probability (k, s) of each state at each press, given all labels."""
    between = partial(_between, error_bcs, sigma_m, gap_s)
    presses = len(error_bcs)
    forward = np.empty((presses, len(chain.point)))
    forward[0] = _normalised(chain.start * _alone(error_bcs[0], sigma_m[0]))
    for press in range(1, presses):
        forward[press] = _normalised(forward[press - 1] @ (chain.onward * between(press)))
    backward = np.ones(len(chain.point))
    posterior = forward.copy()
    for press in range(presses - 1, 0, -1):
        backward = _normalised((chain.onward * between(press)) @ backward)
        posterior[press - 1] = _normalised(forward[press - 1] * backward)
    return posterior


def _normalised(values: FloatArray) -> FloatArray:
    """Scale values (s,) to a sum of one."""
    return np.asarray(values / values.sum())


def _clear_ones(posterior: FloatArray) -> tuple[IntArray, FloatArray]:
    """The best point (k,) of each press by its probabilities (k, p), and its own."""
    best = posterior.argmax(axis=1)
    ranked = np.sort(np.column_stack((np.zeros(len(posterior)), posterior)), axis=1)
    clear = ranked[:, -1] >= CLEAR * ranked[:, -2]
    return np.where(clear, best, -1).astype(np.int64), ranked[:, -1]


MIN_PRESSES = 4
"""Below this many presses made while walking no lead is estimated."""
MIN_SPEED_M_S = 0.3
"""Who is slower is not taken to walk: the time of such a press says nothing."""

MAX_SPEED_M_S = 4.0
"""No one walks faster: the labels jump there."""


@dataclass(frozen=True)
class PressLead:
    """A session's constant lead: the label was at the point ``lead_s`` before the press (negative: after it).

    ``without_s`` (k,) is the lead by all presses but the one, so that no press corrects itself. All are NaN where there
    are too few presses.
    """

    lead_s: float
    sigma_s: float
    without_s: FloatArray


def estimate_lead(along_m: FloatArray, speed_m_s: FloatArray) -> PressLead:
    """Estimate the lead from how far (k,) each label is ahead of its point, and the walking speed (k,) there.

    Either may be NaN. The least sum of absolute rests of ``along = lead x speed``: the median of the quotients,
    weighted by speed.
    """
    speed_m_s = np.nan_to_num(speed_m_s)
    usable = np.isfinite(along_m) & (speed_m_s >= MIN_SPEED_M_S) & (speed_m_s <= MAX_SPEED_M_S)
    quotient = along_m / np.where(usable, speed_m_s, np.nan)
    if usable.sum() < MIN_PRESSES:
        return PressLead(float("nan"), float("nan"), np.full(len(along_m), np.nan))
    weight = np.where(usable, speed_m_s, 0.0)
    lead_s = _weighted_median(quotient, weight)
    others = (np.where(np.arange(len(weight)) == press, 0.0, weight) for press in range(len(weight)))
    without_s = np.array([_weighted_median(quotient, one) for one in others])
    rest_m = np.abs(along_m - lead_s * speed_m_s)[usable]
    scatter_m = 1.4826 * float(np.median(rest_m))
    return PressLead(lead_s, float(np.sqrt(np.pi / 2) * scatter_m / np.linalg.norm(weight)), without_s)


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """Median of the values (k,) with a weight (k,) above zero: half of all weight is on either side."""
    kept = np.flatnonzero(weights > 0)
    order = kept[np.argsort(values[kept], kind="stable")]
    upto = np.cumsum(weights[order]) - weights[order] / 2
    return float(np.interp(weights[order].sum() / 2, upto, values[order]))


@dataclass(frozen=True)
class PressTruth:
    """Where a session's presses were made: those inside the walk and on the session's own floor, ``k`` of them."""

    time_ns: IntArray
    """(k,) boot-clock nanoseconds, rising."""
    point: IntArray
    """(k,) index of the control point of each, -1 where it is not clear."""
    points_bcs: FloatArray
    """(p, 2) of the floor's control points, metres."""
    lead: PressLead
    """Estimated from the reference's labels."""
    by_route: bool
    """Whether a written route gave the order of the points."""
    outside: int
    """Further presses, before the first or after the last frame."""
    elsewhere: int
    """Further presses, on other floors."""
    velocity_bcs: FloatArray
    """(k, 2) of the walk by the reference, metres per second; NaN where not known."""

    @property
    def identified(self) -> BoolArray:
        """Mask (k,) of the presses whose point is clear."""
        return self.point >= 0

    @property
    def ambiguous(self) -> int:
        """Presses whose point is not clear; they are not scored."""
        return int((~self.identified).sum())


def press_truth(reference: Trajectory, presses_ns: IntArray, floor: Floor, route: IntArray | None = None) -> PressTruth:
    """Identify a session's presses at the control points of its floor, and estimate their lead.

    ``reference`` is the session mapped by a strategy that is seldom far off; ``route`` (r,) the points' indices in
    walking order, where known. Raises SessionError where there is no press, no control point, or no press in the walk.
    """
    points = floor.control_points.position_bcs
    if not len(points):
        raise SessionError(f"floor {floor.number} has no control points: add its refmarker.csv (rows x,y, metres)")
    if not len(presses_ns):
        raise SessionError(
            "no presses at control points were recorded: refMarker.csv (ControlPoint.csv of the app) is missing or has "
            "none"
        )
    inside = _inside(reference, presses_ns)
    if not inside.any():
        raise SessionError(_far_off(reference, presses_ns))
    presses_ns, outside = np.unique(presses_ns[inside]), int((~inside).sum())
    here = _on_floor(reference, presses_ns, floor.number)
    presses_ns, elsewhere = presses_ns[here], int((~here).sum())
    labels = label_by_interpolation(presses_ns, reference, MAX_GAP_S)
    plane = labels.position_bcs[:, :2]
    point, _ = identify_presses(presses_ns, plane, labels.sigma_m, points, route)
    velocity = walking_velocity(presses_ns, *usable_path(reference))
    lead = _lead(plane - _places(points, point), velocity)
    return PressTruth(presses_ns, point, points, lead, route is not None, outside, elsewhere, velocity)


def press_errors(
    trajectory: Trajectory, truth: PressTruth, settings: TruthSettings = USUAL_TRUTH, *, without_lead: bool = False
) -> PointErrors:
    """Labels at the identified presses against their points.

    ``without_lead``: labels are taken earlier by the lead that the session's other presses show; no press is then
    labelled where there are too few to decide.
    """
    keep = truth.identified
    lead_s = truth.lead.without_s[keep] if without_lead else np.zeros(int(keep.sum()))
    earlier_ns = (np.nan_to_num(lead_s) * 1e9).astype(np.int64)
    labels = label_by_interpolation(truth.time_ns[keep] - earlier_ns, trajectory, MAX_GAP_S)
    known = np.where(np.isnan(lead_s)[:, None], np.nan, labels.position_bcs)
    places = truth.points_bcs[truth.point[keep]]
    labels = replace(labels, position_bcs=known)
    return _compared(truth.time_ns[keep], places, labels, truth.velocity_bcs[keep], settings)


def nearest_point_errors(
    trajectory: Trajectory, presses_ns: IntArray, floor: Floor, settings: TruthSettings = USUAL_TRUTH
) -> PointErrors:
    """Labels at the presses (k,), ns, against the *nearest* control point, as the paper takes them (section VI-A).

    The nearest point need not be the one pressed at: large errors come out too small where points are close together.
    A press without a label has an arbitrary point. The floor has at least one.
    """
    presses_ns = np.unique(presses_ns)
    presses_ns = presses_ns[_on_floor(trajectory, presses_ns, floor.number)]
    labels = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S)
    nearest = nearest_points(labels.position_bcs[:, :2], floor.control_points.position_bcs)
    return _compared(presses_ns, nearest, labels, walking_velocity(presses_ns, *usable_path(trajectory)), settings)


def walk_error(errors_m: FloatArray) -> float:
    """Mean of the errors (k,) over the labelled presses of a walk, metres; NaN where there is none."""
    labelled = errors_m[np.isfinite(errors_m)]
    return float(labelled.mean()) if labelled.size else float("nan")


def is_faulty(local: Trajectory, corrected: Trajectory) -> bool:
    """Return whether ``local-corrected`` discards any frame that ``local`` maps (the paper's faulty trajectories)."""
    return bool(np.any(has_position(local.status) & ~has_position(corrected.status)))


def press_truth_findings(truth: PressTruth) -> list[Finding]:
    """Report the presses that are not scored."""
    advice = "route.csv does not settle it" if truth.by_route else "add a route.csv to settle it"
    reasons: tuple[tuple[FindingKind, int, str], ...] = (
        ("ambiguous_presses", truth.ambiguous, f"for which two control points fit about equally well ({advice})"),
        ("presses_outside_walk", truth.outside, "made before the first or after the last camera frame"),
        ("presses_on_other_floors", truth.elsewhere, "made on another floor than the session's own"),
    )
    return [
        Finding(kind=kind, file="", count=count, message=f"presses {why}; not scored", severity=Severity.INFO)
        for kind, count, why in reasons
        if count
    ]


def _compared(
    time_ns: IntArray, truth_bcs: FloatArray, labels: Labels, velocity_bcs: FloatArray, settings: TruthSettings
) -> PointErrors:
    """Put true places (k, 2) at ``time_ns`` (k,), passed with these velocities (k, 2), beside their labels."""
    own_m = np.sqrt(np.trace(press_covariance(velocity_bcs, settings), axis1=1, axis2=2) / 2)
    return PointErrors.of((TruthKind.CONTROL_POINTS, time_ns, truth_bcs), labels, velocity_bcs, own_m)


def _places(points_bcs: FloatArray, point: IntArray) -> FloatArray:
    """Positions (k, 2) of the points (k,), NaN where one is not known."""
    return np.where((point >= 0)[:, None], points_bcs[point], np.nan)


def _lead(residual_bcs: FloatArray, velocity_bcs: FloatArray) -> PressLead:
    """The lead by residuals (k, 2), metres, and velocities (k, 2), m/s."""
    speed_m_s = np.linalg.norm(velocity_bcs, axis=1)
    along_m = (residual_bcs * velocity_bcs).sum(axis=1) / np.where(speed_m_s > 0, speed_m_s, np.nan)
    return estimate_lead(along_m, speed_m_s)


def _inside(trajectory: Trajectory, presses_ns: IntArray) -> BoolArray:
    """Mask (k,) of the presses between the first and the last usable frame."""
    time_ns, _ = usable_path(trajectory)
    if not len(time_ns):
        return np.zeros(len(presses_ns), dtype=np.bool_)
    return np.asarray((presses_ns >= time_ns[0]) & (presses_ns <= time_ns[-1]))


def _on_floor(trajectory: Trajectory, presses_ns: IntArray, number: int) -> BoolArray:
    """Mask (k,) of the presses made on this floor, which is the session's own."""
    where = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S).floor
    return where == number if len(where) else np.ones(len(presses_ns), dtype=np.bool_)


def _far_off(trajectory: Trajectory, presses_ns: IntArray) -> str:
    """Say how far the presses (k,), ns, are from the walk in time."""
    time_ns, _ = usable_path(trajectory)
    if not len(time_ns):
        return f"none of the {len(presses_ns)} presses can be scored: the session has no usable camera frame"
    early, late = time_ns[0] - presses_ns.max(), presses_ns.min() - time_ns[-1]
    off_s, side = max((early * 1e-9, "before it begins"), (late * 1e-9, "after it ends"))
    return (
        f"none of the {len(presses_ns)} presses is within the walk: they are {off_s:.0f} s {side}. Check that "
        "presses and poses are of the same session and clock"
    )
