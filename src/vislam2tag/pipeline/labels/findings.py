"""Findings about a mapped session: landmarks that are too high, too few or wrong, and late pose stamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.common.findings import Finding, Severity, counted, finding_if
from vislam2tag.core.limits import MAX_SOLVER_BLOCKS
from vislam2tag.core.status import Contradiction, Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.settings import BY_LANDMARKS, MIN_JUDGED, ON_PLAN
from vislam2tag.estimation.strategy import surveyed_rows
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.pipeline.labels.placing_findings import placing_findings
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.site.walkable.plan_costs import plan_fault


def walk_findings(
    prepared: PreparedSession, walk: LabelledWalk, settings: ProcessSettings, of_truth: Sequence[Finding] = ()
) -> list[Finding]:
    """All findings about a session: from reading, from mapping, and about its pose stamps.

    ``of_truth`` are findings about the truth that its labels are compared with.
    """
    return [
        *prepared.findings(),
        *mapping_findings(prepared, walk.trajectory, settings.mapping.visit_radius_m, walk.needs),
        *_unusable_plan(prepared, walk.trajectory, settings.strategy),
        *of_truth,
        *pose_lag_findings(prepared.session.camera.pose_lag_s, settings),
    ]


def mapping_findings(prepared: PreparedSession, trajectory: Trajectory, radius_m: float, needs: str) -> list[Finding]:
    """Findings from mapping a session.

    ``radius_m`` is that of visits, metres; ``needs`` are the requirements of the strategy.
    """
    session, landmarks = prepared.session, prepared.landmarks
    return [
        *landmark_findings(session.camera, session.landmarks, landmarks, trajectory, radius_m, needs),
        *(_contradiction(found, landmarks) for found in trajectory.contradictions),
        *_contradicting_fixes(trajectory, prepared),
        *_unjudged_fixes(trajectory),
        *_not_converged(trajectory),
        *placing_findings(prepared, trajectory),
        *_passes_left_out(trajectory, len(session.landmarks.ids)),
    ]


def landmark_findings(
    camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory, radius_m: float, needs: str
) -> list[Finding]:
    """Landmarks that are too high to be visited, or too few for the strategy."""
    return [
        *_too_high(camera, surveyed_rows(log, landmarks), trajectory, radius_m),
        *_too_few(camera, trajectory, needs),
    ]


def _too_high(camera: CameraTrack, log: LandmarkLog, trajectory: Trajectory, radius_m: float) -> tuple[Finding, ...]:
    """Surveyed landmarks passed within the radius on the plan, but not in space."""
    visited = {visit.landmark for visit in trajectory.visits}
    unvisited = log.select([i for i, name in enumerate(log.ids) if name not in visited])
    apart = np.linalg.norm(camera.plane_acs[unvisited.frame] - unvisited.plane_acs, axis=1)
    missed = [unvisited.ids[i] for i in np.unique(unvisited.landmark[(apart < radius_m) & ~unvisited.lost])]
    message = (
        f"landmarks {', '.join(missed)} do not count as visited, because the phone never came within {radius_m:g} m of "
        "them, including height; hang them at the phone's height or increase --visit-radius-m"
    )
    return finding_if(len(missed), "landmark_never_passed", message, severity=Severity.WARNING)


def _too_few(camera: CameraTrack, trajectory: Trajectory, needs: str) -> list[Finding]:
    """The missing requirements if no frame could be mapped."""
    usable = trajectory.status[camera.usable]
    if len(usable) == 0 or (usable != Status.NO_MAPPING).any():
        return []
    visited = sorted({visit.landmark for visit in trajectory.visits})
    message = (
        f"the walk cannot be mapped: it needs {needs}. Tap known positions at different places during the walk"
        if camera.without_poses
        else f"the walk cannot be mapped: it needs {needs}; visited within the radius: {', '.join(visited) or 'none'}. "
        "Pass more landmarks more closely, or survey more of those seen"
    )
    return [Finding(kind="too_few_landmarks", file="", count=1, severity=Severity.ERROR, message=message)]


def _unusable_plan(prepared: PreparedSession, trajectory: Trajectory, strategy: str) -> list[Finding]:
    """Why the plan of its floor could not place a walk, if the strategy would have needed it."""
    camera = prepared.session.camera
    mapped = (trajectory.status[camera.usable] != Status.NO_MAPPING).any()
    needed = strategy == ON_PLAN or (strategy == BY_LANDMARKS and not mapped)
    if not camera.plans or trajectory.placing is not None or not needed:
        return []
    if (fault := plan_fault(prepared.task.floor)) is None:
        return []
    message = f"the plan of floor {prepared.task.floor.number} cannot place the walk: {fault}"
    return [Finding(kind="unusable_plan", file="", count=1, message=message)]


def _contradiction(found: Contradiction, landmarks: Landmarks) -> Finding:
    """A landmark that contradicts the others, with its row in the landmark file."""
    row = landmarks.index[found.landmark]
    x, y = landmarks.position_bcs[row]
    file, _, line = (landmarks.source[row] if landmarks.source else "").rpartition(":")
    passes = f"{found.passes} pass{'' if found.passes == 1 else 'es'}"
    message = (
        f"landmark {found.landmark} contradicts the others by {found.size_m:.2f} m (one standard deviation is "
        f"{found.sigma_m:.2f} m; {passes}): its surveyed position is ({x:.2f}, {y:.2f}), the walk places it at "
        f"({x + found.offset_bcs_m[0]:.2f}, {y + found.offset_bcs_m[1]:.2f}). Measure it again and correct its row, or "
        "enter its actual position in corrections.toml"
    )
    lines = (int(line),) if line else ()
    return Finding(kind="contradicting_landmark", file=file, count=1, message=message, lines=lines)


def _contradicting_fixes(trajectory: Trajectory, prepared: PreparedSession) -> list[Finding]:
    """Known positions that contradict a walk without a tracker."""
    fixes = prepared.session.camera.fixes
    if not trajectory.fix_contradiction_m or fixes is None:
        return []
    message = (
        f"the {len(fixes.time_ns)} known positions of the walk ({fixes.name[0]}, ...) contradict its steps, the time "
        f"or each other by {trajectory.fix_contradiction_m:.0f} m (median). Its sigma allows for that. Check which "
        "points were pressed, and in which order. If they are correct, the phone was probably on a cart and not "
        "carried: dead reckoning needs steps"
    )
    return [Finding(kind="contradicting_fixes", file="", count=len(fixes.time_ns), message=message)]


def _unjudged_fixes(trajectory: Trajectory) -> list[Finding]:
    """Known positions of a walk without a tracker that are too few to show whether its path is right."""
    used = trajectory.fixes_used
    if used is None or used >= MIN_JUDGED or trajectory.fix_contradiction_m:
        return []
    message = (
        f"the path could not be verified: the walk has {counted(used, 'known position')} within its readings, and "
        f"{MIN_JUDGED} are needed to check speed and heading. Its sigma allows for that, so frames far from them are "
        "'uncertain'; tap more places, at least one per minute"
    )
    return [Finding(kind="unjudged_fixes", file="", count=used, message=message)]


def _not_converged(trajectory: Trajectory) -> list[Finding]:
    """Estimates that did not converge, because large parts of the walk contradict each other."""
    if not trajectory.not_converged:
        return []
    message = (
        f"the walk's {' and '.join(trajectory.not_converged)} did not converge, because its observations contradict "
        "each other; errors of labels may be larger than their sigma. Check its events and landmarks in the report, "
        "and exclude what is wrong in corrections.toml"
    )
    return [Finding(kind="not_converged", file="", count=1, message=message)]


def _passes_left_out(trajectory: Trajectory, landmarks: int) -> tuple[Finding, ...]:
    """Landmark observations beyond the limit of the solver."""
    message = (
        f"observations of {landmarks:,} landmarks were skipped: the number of observations times the square of the "
        f"number of landmarks may be at most {MAX_SOLVER_BLOCKS:,}. Unsurveyed landmarks observed once were skipped "
        "first, then observations evenly over the walk; remove landmarks that do not exist, or split the recording"
    )
    return finding_if(trajectory.passes_left_out, "too_many_landmarks", message, severity=Severity.WARNING)


def pose_lag_findings(lag_s: float | None, settings: ProcessSettings) -> list[Finding]:
    """Poses stamped later (seconds) than the settings tolerate, unless the smoother allows for it."""
    allowed_for = settings.strategy == "smoother" and settings.mapping.smoother.allow_for_pose_lag
    if lag_s is None or abs(lag_s) <= settings.findings.pose_lag_s or allowed_for:
        return []
    message = (
        f"the poses are stamped {lag_s:+.2f} s later than the gyroscope measured the same motion, which displaces "
        f"labels along the walk. Shift the camera clock by {-lag_s:.2f} s in corrections.toml, or use "
        "--allow-for-pose-lag with the strategy smoother"
    )
    return [Finding(kind="pose_lag", file="", count=1, message=message)]
