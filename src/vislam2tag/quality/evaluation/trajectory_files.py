"""Trajectories as other tools have them: TUM out; TUM, EuRoC and KITTI in, as truth.

All are read as positions in the BCS on the session's boot clock; only the plane is used. A track in a frame or on a
clock of its own has to be brought there first, for instance with ``evo_traj --transform_left``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.intake.extents import MAX_LOCAL_M
from vislam2tag.quality.evaluation.truth import LATEST_NS, Truth, read_truth, rows_left_out

NO_TURN = (0.0, 0.0, 0.0, 1.0)
"""Quaternion (x, y, z, w) written where the orientation is not known."""
LATEST_S = 9.0e9
"""Later times do not fit into nanoseconds."""


def tum_text(trajectory: Trajectory) -> str:
    """Write the frames that have a position as lines ``t tx ty tz qx qy qz qw``: seconds, metres in the BCS.

    Seconds have nine decimals, so that no time is lost. An unknown height is written as 0, an unknown orientation as no
    turn: the format has no gaps.
    """
    labelled = has_position(trajectory.status)
    position = np.nan_to_num(trajectory.position_bcs[labelled], nan=0.0)
    orientation = trajectory.orientation_bcs[labelled]
    known = np.isfinite(orientation).all(axis=1, keepdims=True)
    poses = np.column_stack((position, np.where(known, orientation, NO_TURN)))
    return _timed_lines(trajectory.time_ns[labelled], poses, ".6f")


def covariance_text(trajectory: Trajectory) -> str:
    """Write the covariances of the lines of :func:`tum_text` as lines ``t xx xy yy``: seconds, m2 in the BCS.

    One that is not known is ``nan``.
    """
    labelled = has_position(trajectory.status)
    entries = trajectory.covariance_bcs[labelled].reshape(-1, 4)[:, (0, 1, 3)]
    return "# time_s xx xy yy (m2)\n" + _timed_lines(trajectory.time_ns[labelled], entries, ".9g")


def _timed_lines(time_ns: IntArray, values: FloatArray, form: str) -> str:
    """Lines of times (n,) and numbers (n, c) in a ``form``.

    Times are written digit by digit: as floating-point numbers of seconds whole nanoseconds would be rounded.
    """
    times = (divmod(time, 1_000_000_000) for time in time_ns.tolist())
    rows = (" ".join(format(value, form) for value in row) for row in values.tolist())
    return "".join(f"{seconds}.{rest:09d} {row}\n" for (seconds, rest), row in zip(times, rows, strict=True))


def tum_text_of_truth(truth: Truth) -> str:
    """Write a truth the same way, at height 0 and without turn."""
    poses = np.column_stack((truth.position_bcs, np.tile((0.0, *NO_TURN), (len(truth.time_ns), 1))))
    return _timed_lines(truth.time_ns, poses, ".6f")


def read_tum(path: Path) -> Truth:
    """Read lines ``t tx ty tz qx qy qz qw``, t in seconds; raises SessionError where it contains others."""
    rows, lines = _numbers(path, None, 8, "t tx ty tz qx qy qz qw (t in seconds)")
    return _truth(path, _nanoseconds(path, rows[:, 0]), rows[:, 1:3], lines)


def read_euroc(path: Path) -> Truth:
    """Read EuRoC's table: ``ns, x, y, z, qw, qx, ...``, commas between; raises SessionError where it is none."""
    expected = "time in ns, x, y, z, qw, qx, qy, qz, ... separated by commas"
    rows, lines = _numbers(path, ",", 8, expected, exact=False)
    if np.abs(rows[:, 0]).max() > LATEST_NS:
        raise SessionError(f"{path}: its times are not nanoseconds, because they exceed {LATEST_NS:.0e}")
    # The first field is read again as a whole number: nanoseconds since 1970 exceed a float's 53 bits.
    time_ns = [int(field) if field.lstrip("+-").isdecimal() else int(float(field)) for field in _first_fields(path)]
    return _truth(path, np.array(time_ns, dtype=np.int64), rows[:, 1:3], lines)


def read_kitti(path: Path) -> Truth:
    """Read KITTI's poses, 12 numbers a line (rows of a 3 x 4 matrix), and their times from beside the file.

    The format has no time: ``NAME.times`` contains one number a line, seconds. Raises SessionError where either is
    wrong.
    """
    poses, lines = _numbers(path, None, 12, "the 12 numbers of a 3 x 4 pose matrix", timed=False)
    beside = path.with_suffix(".times")
    if not beside.is_file():
        raise SessionError(
            f"{path}: KITTI poses have no times; write them in seconds, one a line, into {beside.name} next to it"
        )
    seconds, _ = _numbers(beside, None, 1, "one time in seconds")
    if len(seconds) != len(poses):
        raise SessionError(f"{beside}: contains {len(seconds)} times for the {len(poses)} poses of {path.name}")
    return _truth(path, _nanoseconds(beside, seconds[:, 0]), poses[:, (3, 7)], lines)


READERS: dict[str, Callable[[Path], Truth]] = {
    ".csv": read_truth,
    ".tum": read_tum,
    ".euroc": read_euroc,
    ".kitti": read_kitti,
}
"""Reader of each format by the suffix of its file, in the order in which they are looked for."""


def find_truth(folder: Path, stem: str) -> Truth | None:
    """Read ``STEM.csv``, ``.tum``, ``.euroc`` or ``.kitti`` in a folder, the first there is; None where none is.

    Raises SessionError where it cannot be read.
    """
    for suffix, read in READERS.items():
        path = folder / f"{stem}{suffix}"
        if path.is_file():
            return read(path)
    return None


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines with their numbers, without comments and blank ones; raises SessionError where unreadable."""
    try:
        text = read_bytes(path).decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise SessionError(f"{path}: cannot be read ({error.strerror})") from error
    numbered = ((number, line.strip()) for number, line in enumerate(text.splitlines(), start=1))
    return [(number, line) for number, line in numbered if line and not line.startswith("#")]


def _first_fields(path: Path) -> list[str]:
    return [line.split(",", 1)[0].strip() for _, line in _lines(path)]


def _numbers(
    path: Path, separator: str | None, columns: int, expected: str, *, exact: bool = True, timed: bool = True
) -> tuple[FloatArray, list[int]]:
    """Return the first ``columns`` numbers of each line (n, columns), and the lines (n,), 1-based.

    Raises SessionError with the line that has others; where lines are ``timed`` the first number is finite.
    """
    rows, numbers = [], []
    for number, line in _lines(path):
        fields = line.split(separator)
        try:
            values = [float(field) for field in fields[:columns]]
        except ValueError:
            values = []
        if len(values) < columns or (exact and len(fields) > columns) or (timed and not np.isfinite(values[0])):
            raise SessionError(f"{path}:{number}: expected {expected}")
        rows.append(values)
        numbers.append(number)
    if not rows:
        raise SessionError(f"{path}: contains no line; expected {expected}")
    return np.array(rows), numbers


def _nanoseconds(path: Path, seconds: FloatArray) -> IntArray:
    """Times (n,) in ns of seconds (n,); raises SessionError where they cannot be seconds."""
    if np.abs(seconds).max() > LATEST_S:
        raise SessionError(
            f"{path}: its times are not seconds, because they exceed {LATEST_S:.0e}; check whether they are nanoseconds"
        )
    return np.rint(seconds * 1e9).astype(np.int64)


def _truth(path: Path, time_ns: IntArray, position_bcs: FloatArray, lines: list[int]) -> Truth:
    """Make a truth of rising times (n,), ns, and positions (n, 2), metres, of these lines (n,).

    Of equal times the first counts; lines without a finite position are left out and counted.
    """
    if (time_ns[1:] < time_ns[:-1]).any():
        raise SessionError(f"{path}: its times go backwards; sort the lines by time")
    known = np.all(np.abs(position_bcs) <= MAX_LOCAL_M, axis=1)
    if not known.any():
        raise SessionError(f"{path}: no line has a finite position")
    left_out = [line for line, usable in zip(lines, known.tolist(), strict=True) if not usable]
    time_ns, position_bcs = time_ns[known], position_bcs[known]
    first = np.append(True, time_ns[1:] > time_ns[:-1])
    return Truth(time_ns[first], position_bcs[first], rows_left_out(path.name, left_out))
