"""All files of a session should run on one clock: tables that never meet the frames are found here."""

from __future__ import annotations

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.findings import Finding


def clock_mismatch(times_ns: IntArray, file: str, camera: CameraTrack) -> list[Finding]:
    """Report a table whose times (any order, nanoseconds) do not overlap those of the usable frames at all."""
    frames_ns = camera.time_ns[camera.usable]
    if len(times_ns) == 0 or len(frames_ns) == 0:
        return []
    first, last = int(times_ns.min()), int(times_ns.max())
    before_s = (int(frames_ns[0]) - last) / 1e9
    after_s = (first - int(frames_ns[-1])) / 1e9
    if before_s <= 0 and after_s <= 0:
        return []
    where = f"end {before_s:.3f} s before the first" if before_s > 0 else f"begin {after_s:.3f} s after the last"
    message = (
        f"the times {where} camera frame: another clock; nothing of this file can be labelled unless "
        "corrections.toml shifts it ([[shift_clock]])"
    )
    return [Finding(kind="clock_mismatch", file=file, count=len(times_ns), message=message)]
