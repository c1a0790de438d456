"""Whether poses can be those of a walking person: in metres, y up, right-handed, camera to world, as the IMU felt it.

Poses that cannot, while another convention makes them plausible, are refused by the name of that convention. If no
convention makes them plausible, a warning says what is odd. Sessions that are too short are not judged.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.pose_conventions import CONVENTIONS, Convention
from vislam2tag.intake.pose_evidence import FAST_M_S, MIN_WAY_M, Inertial, InertialMatch, PoseEvidence, Poses

MAX_FAST_SHARE = 0.05
MIN_SPEED_M_S = 0.05
"""Median speeds of walks are ten times as much, those of walks in kilometres a tenth."""
MIN_LEVEL = 0.75
"""Hand-held phones have 0.9 and more; a frame with another axis up has 0.6 and less."""
MAX_HEAVE = 0.4
"""Walks on floors have about 0.15, staircases up to 0.55, and no other convention makes them look ahead more."""
MIN_AHEAD = -0.5
"""Nobody walks backwards all the way."""
SAME_AHEAD = 0.02
PERSON_M_S = (0.2, 3.0)
"""Another convention must make the median speed that of a person."""
MAX_TILT_DEG = 10.0
MIN_EXPLAINED = 0.5
MIRRORED_BETTER = 0.02
MIN_FRAMES = 10
MAX_SIGHT_M = 10.0
"""Printed landmarks are recognised from a few metres."""
MIN_LANDMARKS = 2


def pose_findings(camera: CameraTrack, log: LandmarkLog, file: str) -> list[Finding]:
    """Report poses of ``file`` in another unit or convention, and landmarks that are seen from too far away."""
    usable = camera.usable
    if usable.sum() < MIN_FRAMES:
        return []
    time_ns = camera.time_ns[usable]
    poses = Poses.of(time_ns, camera.position_acs[usable], camera.orientation_acs[usable])
    if np.linalg.norm(np.diff(poses.position, axis=0), axis=1).sum() < MIN_WAY_M:
        return []
    inertial = Inertial.of(camera.inertial, poses, int(time_ns[0]), camera.pose_lag_s or 0.0)
    return [*_conventions(poses, inertial, file), *_far_landmarks(camera, log)]


def _conventions(poses: Poses, inertial: Inertial | None, file: str) -> list[Finding]:
    evidence = PoseEvidence.of(poses, inertial)
    odd = _oddities(evidence)
    if not odd:
        return []
    others = [each for each in CONVENTIONS if _explains(PoseEvidence.of(each.read(poses), inertial), evidence)]
    what = " and ".join(odd)
    if not others and odd == [_up_and_down(evidence)]:  # a staircase
        return []
    if not others:
        message = f"{what}: labels of this session are doubtful; check how the file was written"
        return [Finding(kind="implausible_poses", file=file, count=1, message=message)]
    # A camera that looks back may really be carried so; all else makes positions wrong.
    harmless = odd == [_back(evidence)]
    severity = Severity.WARNING if harmless else Severity.ERROR
    message = f"{what}. It looks as if {_listed(others)}. {others[0].cure}"
    return [Finding(kind="pose_convention", file=file, count=1, message=message, severity=severity)]


def _explains(other: PoseEvidence, evidence: PoseEvidence) -> bool:
    """Whether poses read in another convention are those of a person who looks ahead at least as much."""
    least, greatest = PERSON_M_S
    as_much = not other.ahead < evidence.ahead - SAME_AHEAD
    return not _oddities(other) and least <= other.speed_m_s <= greatest and as_much


def _up_and_down(evidence: PoseEvidence) -> str:
    return f"{evidence.heave:.0%} of the way leads up and down"


def _listed(others: list[Convention]) -> str:
    return ", or ".join(other.name for other in others)


def _back(evidence: PoseEvidence) -> str:
    return f"the camera looks back all the way (mean cosine {evidence.ahead:.2f})"


def _oddities(evidence: PoseEvidence) -> list[str]:
    """What no walk has, in words."""
    odd = []
    if evidence.fast_share > MAX_FAST_SHARE:
        odd.append(f"the camera is faster than {FAST_M_S:g} m/s for {evidence.fast_share:.0%} of the time")
    if evidence.speed_m_s < MIN_SPEED_M_S:
        odd.append(f"the camera moves at {evidence.speed_m_s:.2g} m/s")
    if evidence.level < MIN_LEVEL:
        odd.append(f"the camera is not held level (mean upward direction {evidence.level:.2f}, expected about 0.9)")
    if evidence.heave > MAX_HEAVE:
        odd.append(_up_and_down(evidence))
    if evidence.ahead < MIN_AHEAD:
        odd.append(_back(evidence))
    return odd + _against_imu(evidence.inertial)


def _against_imu(match: InertialMatch | None) -> list[str]:
    if match is None:
        return []
    if match.tilt_deg > MAX_TILT_DEG:
        return [f"gravity in the accelerometer is {match.tilt_deg:.0f} degrees from the poses' upward direction"]
    if match.explained < MIN_EXPLAINED or match.explained_mirrored > match.explained + MIRRORED_BETTER:
        return ["the gyroscope contradicts the turns of the poses"]
    return []


def _far_landmarks(camera: CameraTrack, log: LandmarkLog) -> list[Finding]:
    """Report landmarks that are far from the camera when they are first logged."""
    first = [rows.start for rows in map(log.rows_of, range(len(log.ids))) if rows.stop > rows.start]
    away_m = np.linalg.norm(log.position_acs[first] - camera.position_acs[log.frame[first]], axis=1)
    if len(first) < MIN_LANDMARKS or np.median(away_m) <= MAX_SIGHT_M:
        return []
    message = (
        f"landmarks are {np.median(away_m):.0f} m from the camera when they are first seen (median), and are "
        f"recognised from {MAX_SIGHT_M:g} m at most: their poses have another convention than those of the camera, or "
        "another origin; landmark to ACS is expected"
    )
    return [Finding(kind="far_landmarks", file="", count=len(first), message=message, severity=Severity.ERROR)]
