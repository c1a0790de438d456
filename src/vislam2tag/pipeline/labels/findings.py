"""What is odd about a session once it is mapped: landmarks too high or too few, or wrong, and late pose stamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.common.findings import Finding, Severity, counted, finding_if
from vislam2tag.core.limits import MAX_SOLVER_BLOCKS
from vislam2tag.core.status import Contradiction, Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.settings import MIN_JUDGED
from vislam2tag.estimation.strategy import surveyed_rows
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.sessions.prepared import PreparedSession


def walk_findings(
    prepared: PreparedSession, walk: LabelledWalk, settings: ProcessSettings, of_truth: Sequence[Finding] = ()
) -> list[Finding]:
    """All that is odd about a session: as it was read, as it was mapped, and its poses' stamps.

    ``of_truth`` are findings about the truth that its labels are compared with.
    """
    return [
        *prepared.findings(),
        *mapping_findings(prepared, walk.trajectory, settings.mapping.visit_radius_m, walk.needs),
        *of_truth,
        *pose_lag_findings(prepared.session.camera.pose_lag_s, settings),
    ]


def mapping_findings(prepared: PreparedSession, trajectory: Trajectory, radius_m: float, needs: str) -> list[Finding]:
    """All that mapping shows of a session.

    ``radius_m`` is a visit's, metres; ``needs`` is what the strategy says that a walk must have had.
    """
    session, landmarks = prepared.session, prepared.landmarks
    return [
        *landmark_findings(session.camera, session.landmarks, landmarks, trajectory, radius_m, needs),
        *(_contradiction(found, landmarks) for found in trajectory.contradictions),
        *_contradicting_fixes(trajectory, prepared),
        *_unjudged_fixes(trajectory),
        *_not_converged(trajectory),
        *_passes_left_out(trajectory, len(session.landmarks.ids)),
    ]


def landmark_findings(
    camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory, radius_m: float, needs: str
) -> list[Finding]:
    """Landmarks too high to be visited, or too few for the strategy, which says what it needs."""
    return [
        *_too_high(camera, surveyed_rows(log, landmarks), trajectory, radius_m),
        *_too_few(camera, trajectory, needs),
    ]


def _too_high(camera: CameraTrack, log: LandmarkLog, trajectory: Trajectory, radius_m: float) -> tuple[Finding, ...]:
    """Surveyed landmarks passed within the radius on the plan, but never in space."""
    visited = {visit.landmark for visit in trajectory.visits}
    unvisited = log.select([i for i, name in enumerate(log.ids) if name not in visited])
    apart = np.linalg.norm(camera.plane_acs[unvisited.frame] - unvisited.plane_acs, axis=1)
    missed = [unvisited.ids[i] for i in np.unique(unvisited.landmark[(apart < radius_m) & ~unvisited.lost])]
    message = (
        f"landmarks {', '.join(missed)} were passed but never within {radius_m:g} m in space, height included, and so "
        "not visited: hang them at the phone's height or raise --visit-radius-m"
    )
    return finding_if(len(missed), "landmark_never_passed", message, severity=Severity.WARNING)


def _too_few(camera: CameraTrack, trajectory: Trajectory, needs: str) -> list[Finding]:
    """What was missing where no frame at all could be mapped."""
    usable = trajectory.status[camera.usable]
    if len(usable) == 0 or (usable != Status.NO_MAPPING).any():
        return []
    visited = sorted({visit.landmark for visit in trajectory.visits})
    message = (
        f"the walk cannot be mapped: it needs {needs}; visited within the radius: {', '.join(visited) or 'none'}. Pass "
        "more landmarks, nearer, or survey more of those seen"
    )
    return [Finding(kind="too_few_landmarks", file="", count=1, severity=Severity.ERROR, message=message)]


def _contradiction(found: Contradiction, landmarks: Landmarks) -> Finding:
    """A landmark that contradicts the others, at its row in the file that surveys it."""
    row = landmarks.index[found.landmark]
    x, y = landmarks.position_bcs[row]
    file, _, line = (landmarks.source[row] if landmarks.source else "").rpartition(":")
    passes = f"{found.passes} pass{'' if found.passes == 1 else 'es'}"
    message = (
        f"landmark {found.landmark} contradicts the others by {found.size_m:.2f} m (one standard deviation is "
        f"{found.sigma_m:.2f} m; {passes}): surveyed at ({x:.2f}, {y:.2f}), the walk puts it at "
        f"({x + found.offset_bcs_m[0]:.2f}, {y + found.offset_bcs_m[1]:.2f}); measure it again and correct its row, or "
        "say in corrections.toml where it hung"
    )
    lines = (int(line),) if line else ()
    return Finding(kind="contradicting_landmark", file=file, count=1, message=message, lines=lines)


def _contradicting_fixes(trajectory: Trajectory, prepared: PreparedSession) -> list[Finding]:
    """Known positions that a walk without a tracker cannot have been at."""
    fixes = prepared.session.camera.fixes
    if not trajectory.fix_contradiction_m or fixes is None:
        return []
    message = (
        f"the walk cannot have been at its {len(fixes.time_ns)} known positions ({fixes.name[0]}, ...) at their times: "
        f"they contradict its steps, the time or each other by {trajectory.fix_contradiction_m:.0f} m (median). Its "
        "sigma covers that; check which points were pressed, and in which order. If the positions are right, the phone "
        "was rolled (on a cart), not carried: dead reckoning needs steps"
    )
    return [Finding(kind="contradicting_fixes", file="", count=len(fixes.time_ns), message=message)]


def _unjudged_fixes(trajectory: Trajectory) -> list[Finding]:
    """Known positions of a walk without a tracker that are too few to show whether its path is right."""
    used = trajectory.fixes_used
    if used is None or used >= MIN_JUDGED or trajectory.fix_contradiction_m:
        return []
    message = (
        f"the path could not be judged: the walk has {counted(used, 'known position')} within its readings, and fewer "
        f"than {MIN_JUDGED} agree with any speed and heading. Its sigma allows for that, so that frames far from them "
        "are 'uncertain'; tap more places, at least one a minute"
    )
    return [Finding(kind="unjudged_fixes", file="", count=used, message=message)]


def _not_converged(trajectory: Trajectory) -> list[Finding]:
    """What was still moving when re-weighting ended: so much of the walk contradicts itself that nothing is sure."""
    if not trajectory.not_converged:
        return []
    message = (
        f"the walk's {' and '.join(trajectory.not_converged)} did not settle: its observations contradict each other "
        "so much that several ways to weigh them fit alike, and labels may be farther off than their sigma says; look "
        "at its events and landmarks in the report, and leave out what is wrong in corrections.toml"
    )
    return [Finding(kind="not_converged", file="", count=1, message=message)]


def _passes_left_out(trajectory: Trajectory, landmarks: int) -> tuple[Finding, ...]:
    """Passes beyond those that can be solved for with so many landmarks."""
    message = (
        f"passes of {landmarks:,} landmarks were left out: passes times the square of the landmarks may be "
        f"{MAX_SOLVER_BLOCKS:,}; landmarks without a surveyed place that were passed once went first, then passes "
        "evenly over the walk: remove landmarks that do not exist, or split the recording"
    )
    return finding_if(trajectory.passes_left_out, "too_many_landmarks", message, severity=Severity.WARNING)


def pose_lag_findings(lag_s: float | None, settings: ProcessSettings) -> list[Finding]:
    """Poses stamped later (seconds) than the settings put up with, where the smoother does not allow for it."""
    allowed_for = settings.strategy == "smoother" and settings.mapping.smoother.allow_for_pose_lag
    if lag_s is None or abs(lag_s) <= settings.findings.pose_lag_s or allowed_for:
        return []
    message = (
        f"the poses are stamped {lag_s:+.2f} s after the gyroscope felt the same motion: labels are displaced by that "
        f"much walking; shift the camera clock by {-lag_s:.2f} s in corrections.toml, or let the smoother allow for it "
        "(--allow-for-pose-lag)"
    )
    return [Finding(kind="pose_lag", file="", count=1, message=message)]
