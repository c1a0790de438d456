"""Steps in which the tracker rewrote its map: landmarks moved that nobody was looking at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.visits import usable_rank

MOVED_M = 1e-6
"""A landmark whose logged position changed by more than this was seen, or moved with the map."""
IN_VIEW_M = 4.0
"""A landmark that moved farther away than this from the camera was not seen: the tracker rewrote its map."""
LEVER_M = 1.0
"""A sheet's logged heading counts as much as a landmark's position at this distance, for the turn of an update."""


@dataclass(frozen=True)
class MapMoves:
    """What the landmarks say about each of the n - 1 steps.

    ``moved``: some did that nobody looked at; ``sighted``: one was seen; ``turn`` (complex, unit), ``centre_before``
    and ``centre_after``: the rigid motion that fits best; ``misfit_m``: root mean square distance from it; ``known``:
    number of landmarks that tell.
    """

    moved: BoolArray
    sighted: BoolArray
    turn: ComplexArray
    centre_before: ComplexArray
    centre_after: ComplexArray
    misfit_m: FloatArray
    known: IntArray

    def carry(self, points: ComplexArray) -> ComplexArray:
        """Move points (n - 1,) of before each step along with the map."""
        return np.asarray(self.centre_after + self.turn * (points - self.centre_before))


def map_moves(camera: CameraTrack, log: LandmarkLog, suspicious: BoolArray) -> MapMoves:
    """See which landmarks moved in each step, and fit the rigid motion that they made together.

    A rewritten map moves several landmarks out of view, or all there are in a step that is ``suspicious`` (n - 1,).
    """
    count = len(suspicious)
    before, after = _successive_rows(log)
    step = usable_rank(camera)[log.frame[after]] - 1
    plane, eye = as_complex(log.plane_acs), as_complex(camera.plane_acs)
    changed = np.abs(plane[after] - plane[before]) > MOVED_M
    away = np.minimum(*(np.abs(eye[log.frame[rows]] - plane[rows]) for rows in (before, after)))
    known, moving, far = (
        np.bincount(step, which, count) for which in (np.ones(len(step)), changed, changed & (away > IN_VIEW_M))
    )
    moved = np.asarray(((far > 1) & (2 * far >= known)) | (suspicious & (known > 0) & (moving == known)))
    sighted = (np.bincount(step, changed & (away <= IN_VIEW_M), count) > 0) & ~moved
    tells = moved[step] & changed
    return _fit(log, before[tells], after[tells], step[tells], moved, np.asarray(sighted))


def _successive_rows(log: LandmarkLog) -> tuple[IntArray, IntArray]:
    """Rows (k,) of landmarks that are not lost, each with the next one of the same landmark."""
    held = np.flatnonzero(~log.lost)
    same = log.landmark[held[1:]] == log.landmark[held[:-1]]
    return held[:-1][same], held[1:][same]


def _fit(
    log: LandmarkLog, before: IntArray, after: IntArray, step: IntArray, moved: BoolArray, sighted: BoolArray
) -> MapMoves:
    """Fit a turn and a shift to the landmarks that moved in each step, by their positions and the sheets' headings."""
    count = len(moved)
    plane, heading = as_complex(log.plane_acs), sheet_heading(log.orientation_acs)
    lever = LEVER_M if orientation_is_estimated(log) else 0.0
    known = np.bincount(step, minlength=count)
    share = np.maximum(known, 1)
    centre_before, centre_after = (group_sums(step, plane[rows], count) / share for rows in (before, after))
    arms = (plane[after] - centre_after[step]) * (plane[before] - centre_before[step]).conj()
    turn = _unit(group_sums(step, arms + lever**2 * heading[after] * heading[before].conj(), count))
    miss = plane[after] - centre_after[step] - turn[step] * (plane[before] - centre_before[step])
    misfit = np.sqrt(np.bincount(step, np.abs(miss) ** 2, count) / share)
    return MapMoves(moved, sighted, turn, centre_before, centre_after, misfit, known)


def orientation_is_estimated(log: LandmarkLog) -> bool:
    """Whether logged orientations say anything: some logs hold a constant for sheets that hang or move otherwise."""
    held = np.flatnonzero(~log.lost)
    first = held[:1]
    if (log.orientation_acs[held[-1:]] != log.orientation_acs[first]).any():
        return True
    constant = bool(np.all(log.orientation_acs[held] == log.orientation_acs[first]))
    return not (constant and np.any(np.abs(log.position_acs[held] - log.position_acs[first]) > MOVED_M))


def sheet_heading(orientation_acs: FloatArray) -> ComplexArray:
    """Horizontal direction (k,) of the logged sheets' X axis in the ACS plane, complex and as long as it is level."""
    x, y, z, w = orientation_acs.T
    return np.asarray(1 - 2 * (y * y + z * z) - 2j * (x * z - y * w))


def group_sums(group: IntArray, values: ComplexArray, count: int) -> ComplexArray:
    """Sums (count,) of complex values (k,) by the number (k,) of the group that each belongs to."""
    return np.asarray(np.bincount(group, values.real, count) + 1j * np.bincount(group, values.imag, count))


def _unit(values: ComplexArray) -> ComplexArray:
    length = np.abs(values)
    return np.asarray(np.where(length > 0, values / np.maximum(length, 1e-300), 1.0))
