"""Findings about a walk that was placed on its floor's plan: what was placed, why the rest was not, and the plan."""

from __future__ import annotations

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.sessions.prepared import PreparedSession

MIRRORED_NATS = -5.0
"""If the plan prefers the walk's mirror image by so much, it is probably mirrored itself."""
LEAST_SCALE_ERROR, SCALE_SIGMAS = 0.008, 3.0
"""Trackers are exact to about half a percent; a smaller difference says nothing about the plan."""


def placing_findings(prepared: PreparedSession, trajectory: Trajectory) -> list[Finding]:
    """All findings from placing a session on its plan; none if it was not."""
    placing = trajectory.placing
    if placing is None:
        return []
    return [*_placed(placing), *_not_placed(placing, trajectory, prepared), *_mirrored(placing), *_scale(placing)]


def _placed(placing: Placing) -> list[Finding]:
    if placing.reason is not Status.OK:
        return []
    message = (
        f"{placing.labelled_share:.0%} of the walk was placed by its shape on the plan of the floor (strategy "
        "floor-plan). Labels are as exact as the plan; check some of them in the studio"
    )
    return [Finding(kind="placed_on_plan", file="", count=1, severity=Severity.INFO, message=message)]


def _not_placed(placing: Placing, trajectory: Trajectory, prepared: PreparedSession) -> list[Finding]:
    refused, reasons = round((1 - placing.labelled_share) * 100), _refusals(trajectory)
    if not refused or not reasons:  # landmarks may place what the plan does not
        return []
    number, status = prepared.task.floor.number, reasons[0]
    why = {
        Status.AMBIGUOUS: f"its shape fits {_places(placing)} of the plan of floor {number}",
        Status.FITS_NOWHERE: (
            f"its shape does not fit the plan of floor {number} ({placing.misfit:.2f} nats per 10 m; at most 0.25 is "
            "accepted): wherever it is put, it goes through walls, or its tracker turned unseen"
        ),
        Status.FITS_MIRROR: (
            f"the plan of floor {number} fits its mirror image about as well ({placing.mirror:.1f} nats apart; at "
            "least 3 are required, more if it fits badly)"
        ),
        Status.FITS_OTHER_FLOOR: f"the plan of floor {_rival(placing)} fits it about as well as that of floor {number}",
        Status.TOO_SHORT: f"its way of {placing.way_m:.0f} m fits several places of the plan of floor {number}",
        Status.PLAN_TOO_OPEN: f"the plan of floor {number} shows so few walls that the walk fits almost anywhere",
    }[status]
    cure = {
        Status.FITS_NOWHERE: "Check the plan and its scale, and that the session is on this floor",
        Status.FITS_OTHER_FLOOR: "Check that the session is on this floor; a tap on a known place settles it",
        Status.PLAN_TOO_OPEN: "Use landmarks in such places",
    }.get(status, f"Tap one known place in the studio, or add set_tap to corrections.toml{_when(placing, trajectory)}")
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


def _places(placing: Placing) -> str:
    likely = [f"{one.weight:.0%}" for one in placing.candidates[:3]]
    if len(likely) < 2:
        return "several places"
    return f"{len(placing.candidates)} or more places ({', '.join(likely)} probable)"


def _rival(placing: Placing) -> int:
    """Number of the other floor that fits best."""
    return min(placing.floors, key=lambda floor: floor[1])[0] if placing.floors else 0


def _when(placing: Placing, trajectory: Trajectory) -> str:
    """The moment at which a tap helps most, as minutes and seconds of the walk."""
    if placing.best_tap is None:
        return ""
    seconds = round(float(trajectory.time_ns[placing.best_tap] - trajectory.time_ns[0]) * 1e-9)
    return f", best where the walk was at {seconds // 60}:{seconds % 60:02d} (at_s = {seconds})"


def _mirrored(placing: Placing) -> list[Finding]:
    if placing.mirror > MIRRORED_NATS:
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
        f"the plan is {abs(off):.1%} too {'large' if off > 0 else 'small'} by the way walked (one standard deviation "
        f"{placing.scale_sigma:.1%}): check its size in metres. Labels are in the plan's metres"
    )
    return [Finding(kind="plan_scale", file="", count=1, message=message)]
