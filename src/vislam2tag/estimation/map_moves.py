"""Sightings of landmarks, and their movements out of view when the tracker rewrote its map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, to_plane
from vislam2tag.core.transforms import as_complex
from vislam2tag.core.visits import usable_rank

MOVED_M = 1e-6
"""A landmark with a larger change of its logged position was seen, or moved with the map."""
IN_VIEW_M = 4.0
"""A landmark that moved at a larger distance from the camera was not seen: the tracker rewrote its map."""
LEVER_M = 1.0
"""A sheet's logged heading has the weight of a landmark's position at this distance, for the turn of an update."""


@dataclass(frozen=True)
class MapMoves:
    """Evidence of landmarks and anchors about each of the n - 1 steps.

    ``moved``: some moved out of view; ``sighted``: one was seen; ``turn`` (complex, unit), ``centre_before`` and
    ``centre_after``: the rigid motion that fits best; ``misfit_m``: root mean square distance from it; ``points``:
    number of landmarks and anchors in the fit.
    """

    moved: BoolArray
    sighted: BoolArray
    turn: ComplexArray
    centre_before: ComplexArray
    centre_after: ComplexArray
    misfit_m: FloatArray
    points: IntArray

    def carry(self, points: ComplexArray) -> ComplexArray:
        """Move points (n - 1,) of before each step along with the map."""
        return np.asarray(self.centre_after + self.turn * (points - self.centre_before))


@dataclass(frozen=True)
class _Points:
    """Poses in the map, ``k`` rows sorted by point and frame: landmarks that are not lost, then anchors."""

    point: IntArray
    frame: IntArray
    plane: ComplexArray
    heading: ComplexArray
    seen: BoolArray | None
    """Rows in which the point was seen according to the tracker."""


def map_moves(camera: CameraTrack, log: LandmarkLog, suspicious: BoolArray) -> MapMoves:
    """Find landmarks and anchors that moved in each step, and fit their common rigid motion.

    A rewritten map moves several points out of view, or all of them in a step that is ``suspicious`` (n - 1,).
    """
    count = len(suspicious)
    points = _points(camera, log)
    before, after = _successive_rows(points)
    step = usable_rank(camera)[points.frame[after]] - 1
    plane, eye = points.plane, as_complex(camera.plane_acs)
    changed = np.abs(plane[after] - plane[before]) > MOVED_M
    if points.seen is None:
        away = np.minimum(*(np.abs(eye[points.frame[rows]] - plane[rows]) for rows in (before, after)))
        in_view = away <= IN_VIEW_M
    else:
        in_view = points.seen[before] | points.seen[after]
    held, moving, far = (np.bincount(step, which, count) for which in (np.ones(len(step)), changed, changed & ~in_view))
    moved = np.asarray(((far > 1) & (2 * far >= held)) | (suspicious & (held > 0) & (moving == held)))
    sighted = (np.bincount(step, changed & in_view, count) > 0) & ~moved
    carried = moved[step] & changed
    lever = LEVER_M if orientation_is_estimated(log) else 0.0
    return _fit(points, lever, before[carried], after[carried], step[carried], moved, np.asarray(sighted))


def seen_rows(log: LandmarkLog, rewritten: BoolArray) -> IntArray:
    """Rows (r,) in which a landmark was seen at that moment, according to the tracker if the log contains it.

    Otherwise these are a landmark's first row, and rows with a change of its place in the plane without a rewrite of
    the map. ``rewritten`` (k,) is whether there was a rewrite at the frame of each row. Unseen landmarks do not move.
    """
    if log.seen is not None:
        return np.flatnonzero(log.seen & ~log.lost)
    held = np.flatnonzero(~log.lost)
    first = np.diff(log.landmark[held], prepend=-1) != 0
    changed = np.abs(np.diff(as_complex(log.plane_acs[held]), prepend=np.inf)) > MOVED_M
    return np.asarray(held[first | (changed & ~rewritten[held])])


def _points(camera: CameraTrack, log: LandmarkLog) -> _Points:
    held = np.flatnonzero(~log.lost)
    plane, heading = as_complex(log.plane_acs[held]), sheet_heading(log.orientation_acs[held])
    seen = None if log.seen is None else log.seen[held]
    point, frame = log.landmark[held], log.frame[held]
    anchors = camera.anchors
    if anchors is None:
        return _Points(point, frame, plane, heading, seen)
    used = np.flatnonzero(camera.usable[anchors.frame])
    return _Points(
        np.concatenate((point, len(log.ids) + anchors.anchor[used])),
        np.concatenate((frame, anchors.frame[used])),
        np.concatenate((plane, as_complex(to_plane(anchors.position_acs[used])))),
        np.concatenate((heading, sheet_heading(anchors.orientation_acs[used]))),
        None if seen is None else np.concatenate((seen, np.zeros(len(used), dtype=bool))),
    )


def _successive_rows(points: _Points) -> tuple[IntArray, IntArray]:
    """Rows (k,), each with the next row of the same point."""
    rows = np.flatnonzero(points.point[1:] == points.point[:-1])
    return rows, rows + 1


def _fit(
    points: _Points,
    lever: float,
    before: IntArray,
    after: IntArray,
    step: IntArray,
    moved: BoolArray,
    sighted: BoolArray,
) -> MapMoves:
    """Fit a turn and a shift in each step (n - 1,) to the points that moved: rows ``before`` and ``after`` (k,)."""
    count = len(moved)
    plane, heading = points.plane, points.heading
    fitted = np.bincount(step, minlength=count)
    share = np.maximum(fitted, 1)
    centre_before, centre_after = (group_sums(step, plane[rows], count) / share for rows in (before, after))
    arms = (plane[after] - centre_after[step]) * (plane[before] - centre_before[step]).conj()
    turn = _unit(group_sums(step, arms + lever**2 * heading[after] * heading[before].conj(), count))
    miss = plane[after] - centre_after[step] - turn[step] * (plane[before] - centre_before[step])
    misfit = np.sqrt(np.bincount(step, np.abs(miss) ** 2, count) / share)
    return MapMoves(moved, sighted, turn, centre_before, centre_after, misfit, fitted)


def orientation_is_estimated(log: LandmarkLog) -> bool:
    """Whether logged orientations are meaningful: some logs contain a constant if sheets are not on walls."""
    held = np.flatnonzero(~log.lost)
    first = held[:1]
    if (log.orientation_acs[held[-1:]] != log.orientation_acs[first]).any():
        return True
    constant = bool(np.all(log.orientation_acs[held] == log.orientation_acs[first]))
    return not (constant and np.any(np.abs(log.position_acs[held] - log.position_acs[first]) > MOVED_M))


def sheet_heading(orientation_acs: FloatArray) -> ComplexArray:
    """Horizontal direction (k,) of the logged sheets' X axis in the ACS plane, complex, shorter if it is not level."""
    x, y, z, w = orientation_acs.T
    return np.asarray(1 - 2 * (y * y + z * z) - 2j * (x * z - y * w))


def group_sums(group: IntArray, values: ComplexArray, count: int) -> ComplexArray:
    """Sums (count,) of complex values (k,) by the number (k,) of their group."""
    return np.asarray(np.bincount(group, values.real, count) + 1j * np.bincount(group, values.imag, count))


def _unit(values: ComplexArray) -> ComplexArray:
    """Complex numbers (n,) of length one in the same directions; 1 if there is none."""
    length = np.abs(values)
    return np.asarray(np.where(length > 0, values / np.maximum(length, 1e-300), 1.0))
