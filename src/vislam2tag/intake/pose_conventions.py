"""Check that poses can be those of a walking person: metres, y up, right-handed, camera to world, in line with the IMU.

If another convention makes implausible poses plausible, they are refused with the name of that convention. If no
convention does, a warning says what is implausible. Sessions that are too short are not judged.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.intake.pose_evidence import (
    CONVENTIONS,
    FAST_M_S,
    MIN_WAY_M,
    Inertial,
    InertialMatch,
    PoseEvidence,
    Poses,
    Sights,
    matrices,
)

MAX_FAST_SHARE = 0.05
MIN_SPEED_M_S = 0.05
"""A tenth of the usual median speed, and ten times that of a walk with positions in kilometres."""
MIN_LEVEL = 0.75
"""Hand-held phones have 0.9 and more; a frame with another axis up has at most 0.6."""
MAX_HEAVE = 0.4
"""Walks on one floor have about 0.15 and staircases up to 0.55, but no other convention fits them better."""
MIN_AHEAD = -0.5
"""People do not walk backwards during a whole walk."""
SAME_AHEAD = 0.02
MORE_AHEAD = 0.2
"""On stairs people look ahead as much as elsewhere; poses with wrong axes look sideways."""
MAX_STRETCH = 2.0
"""Landmarks are seen from a few metres, so distances between them have smaller errors than this; feet give 3.3."""
PERSON_M_S = (0.2, 3.0)
"""Range of a person's median speed, which another convention must reach."""
MAX_TILT_DEG = 10.0
MIN_EXPLAINED = 0.5
MIRRORED_BETTER = 0.02
MIN_FRAMES = 10
MAX_SIGHT_M = 10.0
"""Trackers recognise printed landmarks from a few metres."""
MAX_PICTURE_SIGHT_M = 30.0
"""Largest distance at which large tags are found in pictures."""
MAX_INVERTED_PART = 0.5
"""Landmark poses are inverted if their inverses are less than half as far from the camera."""
MIN_LANDMARKS = 2


def pose_findings(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, file: str) -> list[Finding]:
    """Report poses of ``file`` in another unit or convention, and landmarks that are seen from too far away.

    ``landmarks`` are the surveyed ones, in the frame in which the session is mapped.
    """
    usable = camera.usable
    time_ns = camera.time_ns[usable]
    if len(time_ns) < MIN_FRAMES:
        return [_not_judged(f"there are {len(time_ns)} usable poses", file)]
    poses = Poses.of(time_ns, camera.position_acs[usable], camera.orientation_acs[usable])
    way_m = np.linalg.norm(np.diff(poses.position, axis=0), axis=1).sum()
    if way_m < MIN_WAY_M:
        return [_not_judged(f"the path is {way_m:.1f} m long", file)]
    inertial = Inertial.of(camera.inertial, poses, int(time_ns[0]), camera.pose_lag_s or 0.0)
    sights = _sights(camera, log, landmarks, poses, int(time_ns[0]))
    return [*_conventions(poses, inertial, sights, file), *_far_landmarks(camera, log)]


def _not_judged(why: str, file: str) -> Finding:
    message = f"{why}: too little to check that units and axes (metres, y up) are plausible for a person who walks"
    return Finding(kind="poses_not_judged", file=file, count=1, message=message, severity=Severity.INFO)


def _sights(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, poses: Poses, start_ns: int) -> Sights:
    first = {name: row for name, row in _first_rows(log).items() if name in landmarks.surveyed_ids}
    time_s = (camera.time_ns[log.frame[list(first.values())]] - start_ns) * 1e-9
    pose = np.searchsorted(poses.time_s, time_s).clip(max=len(poses.time_s) - 1)
    return Sights(pose, landmarks.position_bcs[[landmarks.index[name] for name in first]])


def _first_rows(log: LandmarkLog) -> dict[str, int]:
    """Row in which each landmark is first logged, by id."""
    rows = {name: log.rows_of(index) for index, name in enumerate(log.ids)}
    return {name: row.start for name, row in rows.items() if row.stop > row.start}


def _conventions(poses: Poses, inertial: Inertial | None, sights: Sights, file: str) -> list[Finding]:
    evidence = PoseEvidence.of(poses, inertial, sights)
    odd = _oddities(evidence)
    if not odd:
        return []
    as_read = {each.name: PoseEvidence.of(each.read(poses), inertial, sights) for each in CONVENTIONS}
    others = [each for each in CONVENTIONS if _explains(as_read[each.name], evidence)]
    what = " and ".join(odd)
    if odd == [_up_and_down(evidence)]:
        # Stairs and lifts also go up and down, but the camera looks in the direction of the walk.
        others = [each for each in others if not as_read[each.name].ahead < evidence.ahead + MORE_AHEAD]
        if not others:
            return []
    if not others:
        message = f"{what}; labels of this session may be wrong. Check how the file was written"
        return [Finding(kind="implausible_poses", file=file, count=1, message=message)]
    # A phone can really be carried facing backwards, and vehicles are fast. Anything else makes positions wrong.
    harmless = odd == [_back(evidence)] or (others[0].vehicle_alike and np.isnan(evidence.stretch))
    severity = Severity.WARNING if harmless else Severity.ERROR
    message = f"{what}. Probably {', or '.join(other.name for other in others)}. {others[0].cure}"
    return [Finding(kind="pose_convention", file=file, count=1, message=message, severity=severity)]


def _explains(other: PoseEvidence, evidence: PoseEvidence) -> bool:
    """Whether poses read in another convention are those of a person who looks ahead at least as much."""
    least, greatest = PERSON_M_S
    as_much = not other.ahead < evidence.ahead - SAME_AHEAD
    as_long = not other.stretch < 1 / MAX_STRETCH
    return not _oddities(other) and least <= other.speed_m_s <= greatest and as_much and as_long


def _up_and_down(evidence: PoseEvidence) -> str:
    return f"{evidence.heave:.0%} of the path goes up and down"


def _back(evidence: PoseEvidence) -> str:
    return f"the camera looks backwards during the whole walk (mean cosine {evidence.ahead:.2f})"


def _oddities(evidence: PoseEvidence) -> list[str]:
    """What no real walk shows, in words."""
    odd = []
    if evidence.fast_share > MAX_FAST_SHARE:
        odd.append(f"the camera is faster than {FAST_M_S:g} m/s for {evidence.fast_share:.0%} of the time")
    if evidence.speed_m_s < MIN_SPEED_M_S:
        odd.append(f"the camera moves at {evidence.speed_m_s:.2g} m/s")
    if evidence.stretch > MAX_STRETCH:
        odd.append(f"landmarks are {evidence.stretch:.1f} times as far apart as surveyed (median)")
    if evidence.level < MIN_LEVEL and not _felt_level(evidence.inertial):
        odd.append(
            f"the camera is not held level (mean upward direction {evidence.level:.2f}, expected about 0.9 unless the "
            "phone was turned during the walk)"
        )
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
        return ["the gyroscope contradicts the turns of the poses (or the two have different clocks)"]
    return []


def _felt_level(match: InertialMatch | None) -> bool:
    """Whether the accelerometer confirms the poses' upward direction, however the phone was held."""
    return match is not None and match.tilt_deg <= MAX_TILT_DEG


def _far_landmarks(camera: CameraTrack, log: LandmarkLog) -> list[Finding]:
    """Report landmarks that are far from the camera when they are first logged: an error unless pictures explain it."""
    first = list(_first_rows(log).values())
    if len(first) < MIN_LANDMARKS:
        return []
    at, position = camera.position_acs[log.frame[first]], log.position_acs[first]
    inverted = -np.einsum("nji,nj->ni", matrices(log.orientation_acs[first]), position)
    away_m, inverted_m = (float(np.median(np.linalg.norm(each - at, axis=1))) for each in (position, inverted))
    far = np.linalg.norm(position - at, axis=1) > MAX_SIGHT_M
    near_if_inverted = far.sum() >= MIN_LANDMARKS and inverted_m < MAX_INVERTED_PART * away_m
    if away_m <= MAX_SIGHT_M and not near_if_inverted:
        return []
    message = (
        f"landmarks are {away_m:.0f} m from the camera when they are first seen (median), but a tracker recognises "
        f"them from {MAX_SIGHT_M:g} m at most. Their poses have another convention or origin than the camera's poses; "
        "landmark to ACS is expected"
    )
    severity = Severity.ERROR if near_if_inverted or away_m > MAX_PICTURE_SIGHT_M else Severity.WARNING
    return [Finding(kind="far_landmarks", file="", count=len(first), message=message, severity=severity)]
