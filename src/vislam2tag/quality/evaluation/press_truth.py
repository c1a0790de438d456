"""Label errors at control points: who pressed where, how late, and how far the label then was.

The truth of a press is found once a session, from one strategy's labels (the reference), and holds for all strategies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.interpolation import Labels, label_by_interpolation
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.settings import USUAL_TRUTH, TruthSettings
from vislam2tag.quality.evaluation.press_identity import identify_presses
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

MIN_PRESSES = 4
"""Below this many presses made while walking no lead is estimated."""
MIN_SPEED_M_S = 0.3
"""Who is slower is not taken to walk: the time of such a press says nothing."""

MAX_SPEED_M_S = 4.0
"""Nobody walks faster: the labels jump there."""


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
    """Median of the values (k,) with a weight (k,) above zero: half of all weight lies on either side."""
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
        raise SessionError("no presses at control points were recorded: refMarker.csv is missing or empty")
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
    labelled where there are too few to tell.
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

    The nearest point need not be the one pressed at: large errors come out too small where points stand close together.
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
    """Tell whether ``local-corrected`` discards any frame that ``local`` maps (the paper's faulty trajectories)."""
    return bool(np.any(has_position(local.status) & ~has_position(corrected.status)))


def press_truth_findings(truth: PressTruth) -> list[Finding]:
    """Report the presses that are not scored."""
    advice = "route.csv does not settle it" if truth.by_route else "a route.csv would tell"
    reasons: tuple[tuple[FindingKind, int, str], ...] = (
        ("ambiguous_presses", truth.ambiguous, f"made where two control points fit about as well ({advice})"),
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
        f"none of the {len(presses_ns)} presses lies within the walk: they come {off_s:.0f} s {side}; "
        "are refMarker.csv and poses.csv of one session and on one clock?"
    )
