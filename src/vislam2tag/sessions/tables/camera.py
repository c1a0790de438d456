"""The camera track of a session: which frames count, and what is wrong with the others."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_RECORDING_S, of_one_recording
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.settings import FindingSettings

POSE_COLUMNS = dict.fromkeys(("tx", "ty", "tz", "qx", "qy", "qz", "qw"), pl.Float64)
"""Position in metres and quaternion (x, y, z, w), both in the ACS."""
GREATEST = 1e6
"""No tracker's frame reaches this far, metres: such a number is a fault, and its square might overflow."""
FAR_TIMES = (
    f"times are more than {MAX_RECORDING_S / 3600:g} h from the median time, the longest that one recording may last; "
    "they are not used: correct them, or split the recording"
)
NOT_FINITE = f"numbers must be finite and less than {GREATEST:g}; these poses are not used"


def poses_of(rows: pl.DataFrame, file: str) -> tuple[FloatArray, FloatArray, BoolArray, list[Finding]]:
    """Split pose columns into positions (n, 3), unit quaternions (n, 4) and a mask (n,) of usable poses.

    A pose that is not finite or beyond :data:`GREATEST`, or whose quaternion cannot be normalised, is unusable and a
    finding; its quaternion comes out as the identity.
    """
    poses = rows.select(list(POSE_COLUMNS)).to_numpy(order="c")
    line = rows["row"].to_numpy()
    with np.errstate(over="ignore", invalid="ignore"):
        finite = np.einsum("ij,ij->i", poses, poses) < GREATEST**2
        norm = np.sqrt(np.einsum("ij,ij->i", poses[:, 3:], poses[:, 3:]))
        turned = finite & (norm > 0)
    quaternion = poses[:, 3:].copy()
    quaternion[~turned] = 0.0, 0.0, 0.0, 1.0
    quaternion /= np.where(turned, norm, 1.0)[:, None]
    findings = [
        *_finding("non_finite_values", file, line[~finite], NOT_FINITE),
        *_finding(
            "invalid_quaternions",
            file,
            line[finite & ~turned],
            "an orientation is zero; these poses are not used",
        ),
    ]
    return poses[:, :3].copy(), quaternion, turned, findings


def _finding(kind: FindingKind, file: str, lines: IntArray, message: str) -> list[Finding]:
    """A finding at these lines (k,), as a list; empty where there is none."""
    return [Finding.at_lines(kind, file, lines.tolist(), message)] if len(lines) else []


CAMERA_SCHEMA = {"time_ns": pl.Int64, **POSE_COLUMNS}


def camera_track(rows: pl.DataFrame, file: str, settings: FindingSettings) -> tuple[CameraTrack, list[Finding]]:
    """Make the camera track of the parsed rows of a pose file (columns ``row`` and :data:`CAMERA_SCHEMA`).

    Of frames with the same time the first counts; a frame before the latest time so far is invalid.
    """
    position, orientation, sound, findings = poses_of(rows, file)
    time_ns = rows["time_ns"].to_numpy()
    line = rows["row"].to_numpy()
    sound, far = _without_far_times(time_ns, sound)
    latest_ns = _latest_before(time_ns, sound)
    duplicate, backward = sound & (time_ns == latest_ns), sound & (time_ns < latest_ns)
    status = np.where(sound, np.int8(Status.OK), np.int8(Status.INVALID))
    status[duplicate] = Status.DUPLICATE
    status[backward] = Status.INVALID
    track = CameraTrack(time_ns, position, orientation, status, line)
    unordered: tuple[tuple[FindingKind, BoolArray, str], ...] = (
        ("far_times", far, FAR_TIMES),
        ("duplicate_times", duplicate, "frames repeat the time of an earlier one; the first counts"),
        ("backward_times", backward, _backward_message(np.where(sound, time_ns, -1), latest_ns, backward, line)),
    )
    for kind, mask, message in unordered:
        if mask.any():
            findings.append(Finding.at_lines(kind, file, line[mask].tolist(), message))
    return track, findings + _frame_gaps(track, line, file, settings) + _unusable(track, file)


def _without_far_times(time_ns: IntArray, sound: BoolArray) -> tuple[BoolArray, BoolArray]:
    """The sound frames (n,) whose times can be of one recording, and the others of the sound ones."""
    kept = sound.copy()
    kept[sound] = of_one_recording(time_ns[sound])
    return kept, sound & ~kept


def _latest_before(time_ns: IntArray, sound: BoolArray) -> IntArray:
    """Latest time (n,) of the sound frames before each frame; -1 where there is none."""
    latest_ns = np.full(len(time_ns), -1, dtype=np.int64)
    if len(time_ns) > 1:
        latest_ns[1:] = np.maximum.accumulate(np.where(sound, time_ns, -1))[:-1]
    return latest_ns


def _backward_message(time_ns: IntArray, latest_ns: IntArray, backward: BoolArray, line: IntArray) -> str:
    """What happened at frames (n,); where most are backward, one wrong time is probably to blame, and is named."""
    message = "frames are earlier than one before them; they are not used"
    if 2 * np.count_nonzero(backward) <= len(backward):
        return message
    values, counts = np.unique(latest_ns[backward], return_counts=True)
    culprit_ns = values[np.argmax(counts)]
    culprit = line[np.argmax(time_ns == culprit_ns)]
    return f"{message}: {counts.max()} of them are earlier than line {culprit}; if its time is wrong, remove that line"


def _frame_gaps(track: CameraTrack, line: IntArray, file: str, settings: FindingSettings) -> list[Finding]:
    """Holes between the usable frames, at their lines (n,)."""
    step_s = np.diff(track.time_ns[track.usable]) / 1e9
    gaps = step_s > settings.frame_gap_s
    if not gaps.any():
        return []
    after = line[track.usable][1:][gaps].tolist()
    message = (
        f"no frame for more than {settings.frame_gap_s:g} s before these lines (longest {step_s.max():.1f} s); "
        "nothing is known of the way walked there"
    )
    return [Finding.at_lines("frame_gap", file, after, message)]


def _unusable(track: CameraTrack, file: str) -> list[Finding]:
    if track.usable.any():
        return []
    message = "no usable camera pose; the session cannot be mapped"
    return [Finding(kind="no_frames", file=file, count=1, message=message, severity=Severity.ERROR)]
