"""Passes of landmarks: what the tracker saw of a sheet while the camera went by, condensed to one observation.

Only those rows count in which the sheet was seen at that moment (:func:`vislam2tag.estimation.map_moves.seen_rows`), near
enough. Hundreds of neighbouring frames share their error, so a pass counts once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.map_moves import group_sums, orientation_is_estimated, seen_rows, sheet_heading
from vislam2tag.estimation.odometry import Odometry

PAUSE_S = 2.0
"""A landmark not seen for longer than this is passed anew."""
NEAR_M = 0.5
"""Sightings count the more the nearer, but nearer than this no more."""
LEVEL = 0.5
"""A sheet whose X axis is shorter than this in the plane lies flat: it has no heading."""


@dataclass(frozen=True)
class Passes:
    """``p`` passes sorted by step index; positions relative to the camera, in the continuous frame.

    ``at`` (p,) index into the odometry's frames of the nearest approach; ``landmark`` (p,) index into the log's ids;
    ``offset`` (p,) complex, metres, from the camera then to the landmark; ``heading`` (p,) complex, unit, the sheet's
    X axis (0 where none is logged); ``distance_m`` (p,) of the nearest approach; ``spread_m`` (p,) root mean square
    scatter per axis of the sightings; ``count`` (p,) sightings.
    """

    at: IntArray
    landmark: IntArray
    offset: ComplexArray
    heading: ComplexArray
    distance_m: FloatArray
    spread_m: FloatArray
    count: IntArray

    def select(self, rows: IntArray) -> Passes:
        """Some of the passes (ascending)."""
        return Passes(
            at=self.at[rows],
            landmark=self.landmark[rows],
            offset=self.offset[rows],
            heading=self.heading[rows],
            distance_m=self.distance_m[rows],
            spread_m=self.spread_m[rows],
            count=self.count[rows],
        )


def find_passes(camera: CameraTrack, log: LandmarkLog, odometry: Odometry, range_m: float) -> Passes:
    """Condense the sightings within ``range_m`` (horizontal, metres) to passes.

    Where the tracker jumps amid a pass, only the sightings on the nearest one's side of the jump count.
    """
    rank = np.full(len(camera.time_ns), -1, dtype=np.int64)
    rank[odometry.frame] = np.arange(len(odometry.frame))
    rows = seen_rows(log, odometry.rewritten[rank[log.frame]])
    at = rank[log.frame[rows]]
    away = as_complex(log.plane_acs[rows]) - as_complex(camera.plane_acs[log.frame[rows]])
    distance = np.abs(away)
    near = distance < range_m
    rows, at, away, distance = rows[near], at[near], away[near], distance[near]
    group, count = _groups(log.landmark[rows], odometry.time_s[at])
    starts = np.searchsorted(group, np.arange(count))
    nearest = np.lexsort((distance, group))[starts]
    side_of_jumps = np.concatenate(([0], np.cumsum(odometry.jumped)))[at]
    together = side_of_jumps == side_of_jumps[nearest][group]
    weight = together / (NEAR_M**2 + distance**2)
    place = odometry.path[at] + odometry.turn[at] * away
    mean = _mean(place, weight, group, count)
    spread = np.sqrt(_mean(np.abs(place - mean[group]) ** 2 + 0j, weight, group, count).real / 2)
    heading = _mean(odometry.turn[at] * sheet_heading(log.orientation_acs[rows]), weight, group, count)
    heading *= orientation_is_estimated(log)
    order = np.argsort(at[nearest], kind="stable")
    return Passes(
        at=at[nearest][order],
        landmark=log.landmark[rows[starts]][order],
        offset=(mean - odometry.path[at[nearest]])[order],
        heading=np.where(np.abs(heading) > LEVEL, heading / np.maximum(np.abs(heading), LEVEL), 0)[order],
        distance_m=distance[nearest][order],
        spread_m=spread[order],
        count=np.bincount(group, together, count).astype(np.int64)[order],
    )


def _groups(landmark: IntArray, time_s: FloatArray) -> tuple[IntArray, int]:
    """Number the passes (r,) of sightings sorted by landmark and time, and count them."""
    new = (np.diff(landmark) != 0) | (np.diff(time_s) > PAUSE_S)
    group = np.concatenate((np.zeros(min(len(landmark), 1), dtype=np.int64), np.cumsum(new)))
    return group, int(group[-1]) + 1 if len(group) else 0


def _mean(values: ComplexArray, weight: FloatArray, group: IntArray, count: int) -> ComplexArray:
    """Means (p,) of complex values (r,) by weights (r,) over ``count`` groups, which ``group`` (r,) numbers."""
    return np.asarray(group_sums(group, weight * values, count) / np.bincount(group, weight, count))
