"""Tables of a tracker: the frames of the camera that count, and the rows of landmarks matched to them."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, FindingKind, Severity, at_lines_if
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_RECORDING_S, of_one_recording
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.model import landmark_id

POSE_COLUMNS = dict.fromkeys(("tx", "ty", "tz", "qx", "qy", "qz", "qw"), pl.Float64)
"""Position in metres and quaternion (x, y, z, w), both in the ACS."""
GREATEST = 1e6
"""No tracker's frame reaches this far, metres: such a number is a fault, and its square might overflow."""
FAR_TIMES = (
    f"times are more than {MAX_RECORDING_S / 3600:g} h from the median time, longer than a recording may last; they "
    "are not used: correct them, or split the recording"
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
    unturned = "an orientation is zero; these poses are not used"
    findings = findings_of(
        line,
        file,
        ("non_finite_values", ~finite, NOT_FINITE, Severity.WARNING),
        ("invalid_quaternions", finite & ~turned, unturned, Severity.WARNING),
    )
    return poses[:, :3].copy(), quaternion, turned, findings


def findings_of(line: IntArray, file: str, *odd: tuple[FindingKind, BoolArray, str, Severity]) -> list[Finding]:
    """A finding for each mask (n,) with any row, at their lines (n,), with its message."""
    return [
        finding
        for kind, mask, message, severity in odd
        for finding in at_lines_if(kind, file, line[mask].tolist(), message, severity)
    ]


CAMERA_SCHEMA = {"time_ns": pl.Int64, **POSE_COLUMNS}


def camera_track(rows: pl.DataFrame, file: str, settings: FindingSettings) -> tuple[CameraTrack, list[Finding]]:
    """Make the camera track of the parsed rows of a pose file (columns ``row`` and :data:`CAMERA_SCHEMA`).

    Of frames with the same time the first counts; a frame before the latest time so far is invalid.
    """
    position, orientation, sound, findings = poses_of(rows, file)
    time_ns, line = rows["time_ns"].to_numpy(), rows["row"].to_numpy()
    kept = sound.copy()
    kept[sound] = of_one_recording(time_ns[sound])
    sound, far = kept, sound & ~kept
    latest_ns = _latest_before(time_ns, sound)
    duplicate, backward = sound & (time_ns == latest_ns), sound & (time_ns < latest_ns)
    status = np.where(sound, np.int8(Status.OK), np.int8(Status.INVALID))
    status[duplicate] = Status.DUPLICATE
    status[backward] = Status.INVALID
    track = CameraTrack(time_ns, position, orientation, status, line)
    message = _backward_message(np.where(sound, time_ns, -1), latest_ns, backward, line)
    findings += findings_of(
        line,
        file,
        ("far_times", far, FAR_TIMES, Severity.WARNING),
        (
            "duplicate_times",
            duplicate,
            "frames repeat the time of an earlier one; only the first is used",
            Severity.WARNING,
        ),
        ("backward_times", backward, message, Severity.WARNING),
    )
    findings += _frame_gaps(track, line, file, settings)
    if not track.usable.any():
        message = "there is no usable camera pose; the session cannot be mapped"
        findings.append(Finding(kind="no_frames", file=file, count=1, message=message, severity=Severity.ERROR))
    return track, findings


def _latest_before(time_ns: IntArray, sound: BoolArray) -> IntArray:
    """Latest time (n,) of the sound frames before each frame; -1 where there is none."""
    latest_ns = np.full(len(time_ns), -1, dtype=np.int64)
    if len(time_ns) > 1:
        latest_ns[1:] = np.maximum.accumulate(np.where(sound, time_ns, -1))[:-1]
    return latest_ns


def _backward_message(time_ns: IntArray, latest_ns: IntArray, backward: BoolArray, line: IntArray) -> str:
    """What happened at frames (n,); where most are backward, one wrong time is probably to blame, and is named."""
    message = "frames are earlier than a preceding one; they are not used"
    if 2 * np.count_nonzero(backward) <= len(backward):
        return message
    values, counts = np.unique(latest_ns[backward], return_counts=True)
    culprit_ns = values[np.argmax(counts)]
    culprit = line[np.argmax(time_ns == culprit_ns)]
    return f"{message}: {counts.max()} of them are earlier than line {culprit}; if its time is wrong, remove that line"


def _frame_gaps(track: CameraTrack, line: IntArray, file: str, settings: FindingSettings) -> list[Finding]:
    """Holes between the usable frames, at their lines (n,)."""
    step_s = np.diff(track.time_ns[track.usable]) / 1e9
    after = line[track.usable][1:][step_s > settings.frame_gap_s].tolist()
    message = (
        f"there was no frame for more than {settings.frame_gap_s:g} s before these lines (longest "
        f"{step_s.max(initial=0):.1f} s); the path walked there is unknown"
    )
    return at_lines_if("frame_gap", file, after, message)


LANDMARK_SCHEMA = {"id": pl.String, "time_ns": pl.Int64, **POSE_COLUMNS}
SAME_POSITION_M = 1e-6
"""A landmark this close to the camera is the camera's own pose: poses are logged with six decimals."""


def landmark_log(rows: pl.DataFrame, file: str, camera: CameraTrack) -> tuple[LandmarkLog, list[Finding]]:
    """Make the landmark log of the parsed rows of a landmark file (``row`` and :data:`LANDMARK_SCHEMA`).

    A row belongs to the usable frame of exactly its time; of rows with the same landmark and time the first counts.
    """
    position, orientation, sound, findings = poses_of(rows, file)
    (frame, orphans), line = frames_of(rows["time_ns"].to_numpy(), camera), rows["row"].to_numpy()
    message = "there is no frame at the time of these rows; they are not used"
    findings += findings_of(line, file, ("landmark_rows_without_frame", sound & orphans, message, Severity.WARNING))
    ids, landmark = _landmarks_of(rows["id"])
    used = np.flatnonzero(sound & (frame >= 0))
    ids, landmark = _by_first_sighting(ids, landmark, frame, used)
    used, repeated = sorted_once(landmark, frame, used)
    message = "a landmark has several rows at the same time; only the first is used"
    findings += at_lines_if("duplicate_landmark_rows", file, sorted(line[repeated].tolist()), message)
    frame, position = frame[used], position.take(used, axis=0)
    offset = position - camera.position_acs.take(frame, axis=0)
    lost = np.einsum("ij,ij->i", offset, offset) <= SAME_POSITION_M**2
    log = LandmarkLog(ids, landmark[used], frame, position, orientation.take(used, axis=0), lost, line[used])
    return log, findings + _tracking_lost(log, file, len(camera.time_ns))


def frames_of(time_ns: IntArray, camera: CameraTrack) -> tuple[IntArray, BoolArray]:
    """Index (k,) of the usable frame at each time (k,), ns, -1 where there is none; mask (k,) of times of no frame."""
    usable = np.flatnonzero(camera.usable)
    at = np.searchsorted(camera.time_ns[usable], time_ns)
    padded = np.append(usable, -1)
    frame = padded[np.minimum(at, len(usable))]
    matched = (frame >= 0) & (camera.time_ns[frame] == time_ns) if len(usable) else np.zeros(len(time_ns), dtype=bool)
    orphans = ~matched
    if len(usable) < len(camera.time_ns):
        # Rows of an unusable frame are reported by that frame's own finding.
        orphans &= ~np.isin(time_ns, camera.time_ns)
    return np.where(matched, frame, -1), orphans


def _landmarks_of(raw_ids: pl.Series) -> tuple[tuple[str, ...], IntArray]:
    """The different ids in order of appearance, and the index (k,) of each row's among them."""
    spellings = raw_ids.unique(maintain_order=True).to_list()
    names = [landmark_id(spelling) for spelling in spellings]
    ids = tuple(dict.fromkeys(names))
    index = {landmark: i for i, landmark in enumerate(ids)}
    codes = np.array([index[name] for name in names], dtype=np.int64)
    spelled = raw_ids.cast(pl.Enum(spellings)).to_physical().to_numpy()
    return ids, codes[spelled]


def _by_first_sighting(
    ids: tuple[str, ...], landmark: IntArray, frame: IntArray, used: IntArray
) -> tuple[tuple[str, ...], IntArray]:
    """Number landmarks by the frame of their first used row, rows (k,); landmarks without one go."""
    never = np.iinfo(np.int64).max
    first = np.full(len(ids), never)
    np.minimum.at(first, landmark[used], frame[used])
    order = np.argsort(first, kind="stable")
    order = order[first[order] < never]
    rank = np.full(len(ids), -1, dtype=np.int64)
    rank[order] = np.arange(len(order))
    return tuple(ids[i] for i in order), rank[landmark]


def sorted_once(landmark: IntArray, frame: IntArray, used: IntArray) -> tuple[IntArray, IntArray]:
    """Indices of the used rows in (landmark, frame) order, the first of equals only; and those of the others."""
    if np.any(np.diff(frame[used]) < 0):
        used = used[np.argsort(frame[used], kind="stable")]
    # A stable sort of 16 bits is a radix sort, many times quicker.
    narrowest = np.int16 if landmark.max(initial=0) < np.iinfo(np.int16).max else np.int64
    order = used[np.argsort(landmark[used].astype(narrowest), kind="stable")]
    repeated = np.zeros(len(order), dtype=bool)
    repeated[1:] = (np.diff(landmark[order]) == 0) & (np.diff(frame[order]) == 0)
    return order[~repeated], order[repeated]


def _tracking_lost(log: LandmarkLog, file: str, frames: int) -> list[Finding]:
    """Report the frames at which every landmark logged has the camera's pose."""
    logged = np.bincount(log.frame, minlength=frames)
    lost = np.bincount(log.frame[log.lost], minlength=frames)
    critical = (logged > 0) & (lost == logged)
    first_line = np.full(frames, np.iinfo(np.int64).max)
    np.minimum.at(first_line, log.frame, log.row)
    runs = int(np.count_nonzero(np.diff(critical.astype(np.int8), prepend=0) == 1))
    message = (
        f"tracking was lost {runs} time{'s' if runs > 1 else ''}: at these frames every landmark has the camera's "
        "pose; the program continues at the next landmark"
    )
    return at_lines_if("tracking_lost", file, np.sort(first_line[critical]).tolist(), message)
