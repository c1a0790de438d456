"""Findings about a walk that was placed on its floor's plan: what was placed, why the rest was not, and the plan."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import FixLog
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.floor_plan.acceptance import (
    LEAST_EXCHANGED_NATS,
    MIRRORED_NATS,
    MOST_MISFIT,
    plan_is_wrong,
    required_mirror_nats,
)
from vislam2tag.estimation.floor_plan.facts import TAP_SIGMA_M
from vislam2tag.sessions.prepared import PreparedSession

LEAST_SCALE_ERROR, SCALE_SIGMAS = 0.008, 3.0
"""Trackers are exact to about half a percent; a smaller difference says nothing about the plan."""
LEAST_SHOWN = 0.01
"""Less probable paths are not counted."""
LIKELY = 0.1
NO_FIXES = FixLog(np.empty(0, dtype=np.int64), np.empty((0, 2)), ())
FAR_M, FAR_SIGMAS = 1.0, 3.0
"""A known place disagrees if it is farther than both together from all paths of the probability :data:`LIKELY`."""


def placing_findings(prepared: PreparedSession, trajectory: Trajectory) -> list[Finding]:
    """All findings from placing a session on its plan; none if it was not."""
    placing = trajectory.placing
    if placing is None:
        return []
    return [
        *_placed(placing),
        *_not_placed(placing, trajectory, prepared),
        *_disagreeing(placing, trajectory, prepared),
        *_mirrored(placing),
        *_scale(placing),
    ]


def _placed(placing: Placing) -> list[Finding]:
    if placing.reason is not Status.OK:
        return []
    message = (
        f"{100 * placing.labelled_share:.0f} % of the walk was placed by its shape on the plan of the floor (strategy "
        "floor-plan). Labels are as exact as the plan; check some of them in the studio"
    )
    return [Finding(kind="placed_on_plan", file="", count=1, severity=Severity.INFO, message=message)]


def _not_placed(placing: Placing, trajectory: Trajectory, prepared: PreparedSession) -> list[Finding]:
    refused, reasons = round((1 - placing.labelled_share) * 100), _refusals(trajectory)
    if not refused or not reasons:  # landmarks may place what the plan does not
        return []
    number, status = prepared.task.floor.number, reasons[0]
    wrong = plan_is_wrong(placing)
    why = {
        Status.AMBIGUOUS: f"its shape fits {_places(placing)} of the plan of floor {number}",
        Status.FITS_NOWHERE: _fits_nowhere(placing, number),
        Status.FITS_MIRROR: _fits_mirror(placing, number),
        Status.FITS_OTHER_FLOOR: f"the plan of floor {_rival(placing)} fits it about as well as that of floor {number}",
        Status.TOO_SHORT: f"its way of {placing.way_m:.0f} m fits several places of the plan of floor {number}",
        Status.PLAN_TOO_OPEN: f"the plan of floor {number} shows so few walls that the walk fits almost anywhere",
    }[status]
    when = _when(placing, trajectory)
    tap = f"Tap one known place in the studio, or add set_tap to corrections.toml{when}"
    check = "Check the plan and its scale, and that the session is on this floor"
    cure = {
        Status.FITS_NOWHERE: check if wrong or placing.reason is Status.OK else tap,
        Status.FITS_MIRROR: check if wrong else tap,
        Status.FITS_OTHER_FLOOR: f"Check that the session is on this floor; a tap on a known place settles it{when}",
        Status.PLAN_TOO_OPEN: "Use landmarks in such places",
    }.get(status, tap)
    message = f"{refused} % of the walk has no position, because {why}. {cure}"
    return [Finding(kind="not_placed", file="", count=1, message=message)]


def _refusals(trajectory: Trajectory) -> list[Status]:
    """Reasons of frames without a position, the commonest first."""
    reasons = (
        Status.AMBIGUOUS,
        Status.FITS_NOWHERE,
        Status.FITS_MIRROR,
        Status.FITS_OTHER_FLOOR,
        Status.TOO_SHORT,
        Status.PLAN_TOO_OPEN,
    )
    counts = {reason: int((trajectory.status == reason).sum()) for reason in reasons}
    return sorted((reason for reason in reasons if counts[reason]), key=lambda reason: -counts[reason])


def _fits_nowhere(placing: Placing, number: int) -> str:
    if placing.misfit > MOST_MISFIT:
        return (
            f"its shape does not fit the plan of floor {number} ({math.ceil(100 * placing.misfit) / 100:.2f} nats per "
            f"10 m; at most {MOST_MISFIT:g} is accepted): wherever it is put, it goes through walls, or its tracker "
            "reported a wrong turn"
        )
    if placing.reason is Status.OK:
        return f"this part goes through walls of the plan of floor {number}, or its tracker erred here unnoticed"
    better = math.floor(10 * placing.exchanged) / 10
    return (
        f"the plan of floor {number} fits it about as well with left and right exchanged from its middle on (the "
        f"walk fits better by {better:.1f} nats; at least {LEAST_EXCHANGED_NATS:g} is required)"
    )


def _fits_mirror(placing: Placing, number: int) -> str:
    if placing.mirror < 0:
        return f"the plan of floor {number} fits its mirror image better"
    return (
        f"the plan of floor {number} fits its mirror image about as well (the walk fits better by "
        f"{math.floor(10 * placing.mirror) / 10:.1f} nats; for a walk that fits like this, at least "
        f"{math.ceil(10 * required_mirror_nats(placing.misfit)) / 10:.1f} are required)"
    )


def _places(placing: Placing) -> str:
    likely = [f"{100 * one.weight:.0f} %" for one in placing.candidates if one.weight >= LEAST_SHOWN]
    if len(likely) < 2:
        return "several places"
    return f"{len(likely)} or more places ({', '.join(likely[:3])} probable)"


def _rival(placing: Placing) -> int:
    """Number of the other floor that fits best."""
    return min(placing.floors, key=lambda floor: floor[1])[0] if placing.floors else 0


def _when(placing: Placing, trajectory: Trajectory) -> str:
    """The moment at which a tap helps most, as minutes and seconds of the walk."""
    if placing.best_tap is None:
        return ""
    seconds = round(_since_start_s(trajectory, int(trajectory.time_ns[placing.best_tap])))
    return f", best where the walk was at {seconds // 60}:{seconds % 60:02d} (at_s = {seconds})"


def _since_start_s(trajectory: Trajectory, time_ns: int) -> float:
    """Seconds since the first frame, from which ``at_s`` counts."""
    return float(time_ns - trajectory.time_ns[0]) * 1e-9


def _disagreeing(placing: Placing, trajectory: Trajectory, prepared: PreparedSession) -> list[Finding]:
    """Taps and surveyed landmarks that are far from all probable paths."""
    paths = () if plan_is_wrong(placing) else placing.candidates
    likely = [one.position_bcs for one in paths if one.weight >= LIKELY]
    path_ns, off_m = trajectory.time_ns[list(placing.frame)], dict[str, float]()
    for words, time_ns, place, allowed_m in _known_places(trajectory, prepared) if likely else ():
        there = [[np.interp(time_ns, path_ns, axis) for axis in path.T] for path in likely]
        away_m = float(np.linalg.norm(np.array(there) - place, axis=1).min())
        if away_m > allowed_m:
            off_m[words] = max(away_m, off_m.get(words, 0.0))
    found = []
    for words, away_m in off_m.items():
        message = (
            f"{words} is {away_m:.0f} m from where the walk fits the plan. Correct it, in the studio or in "
            "corrections.toml; if it is right, check the plan"
        )
        found.append(Finding(kind="place_disagrees", file="", count=1, message=message))
    return found


def _known_places(trajectory: Trajectory, prepared: PreparedSession) -> Iterator[tuple[str, int, FloatArray, float]]:
    """Name, moment and position of what is known, and how far from it the walk may be."""
    fixes, landmarks = prepared.session.camera.fixes or NO_FIXES, prepared.landmarks
    for row, time_ns in enumerate(fixes.time_ns.tolist()):
        seconds = _since_start_s(trajectory, time_ns)
        words = f"the tap at {int(seconds) // 60}:{int(seconds) % 60:02d} (at_s = {seconds:.1f})"
        sigma_m = TAP_SIGMA_M if fixes.sigma_m is None or np.isnan(fixes.sigma_m[row]) else fixes.sigma_m[row]
        yield words, time_ns, fixes.position_bcs[row], FAR_M + FAR_SIGMAS * sigma_m
    for visit in trajectory.visits:
        row = landmarks.index.get(visit.landmark, -1)
        if row >= 0 and landmarks.surveyed[row] and landmarks.floor[row] == prepared.task.floor.number:
            sigma_m = math.sqrt(np.trace(landmarks.covariance_bcs[row]) / 2)
            words, time_ns = f"landmark {visit.landmark}", int(trajectory.time_ns[visit.frame])
            yield words, time_ns, landmarks.position_bcs[row], visit.distance_m + FAR_M + FAR_SIGMAS * sigma_m


def _mirrored(placing: Placing) -> list[Finding]:
    if placing.mirror > -MIRRORED_NATS:
        return []
    message = (
        f"the plan fits the mirror image of the walk better than the walk, by {-placing.mirror:.0f} nats: the plan is "
        "probably mirrored, so flip it"
    )
    return [Finding(kind="plan_mirrored", file="", count=1, message=message)]


def _scale(placing: Placing) -> list[Finding]:
    off = placing.scale - 1
    if not abs(off) > max(LEAST_SCALE_ERROR, SCALE_SIGMAS * placing.scale_sigma):
        return []
    message = (
        f"the plan is {100 * abs(off):.1f} % too {'large' if off > 0 else 'small'} by the way walked (one standard "
        f"deviation {100 * placing.scale_sigma:.1f} %). If most walks say so, check its size in metres; one tracker "
        "alone may err as much. Labels are in the plan's metres"
    )
    return [Finding(kind="plan_scale", file="", count=1, message=message)]
