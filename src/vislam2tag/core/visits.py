"""Landmark visits and the boundaries that split a walk into sub-trajectories (paper, section V-B)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Visit

NO_LANDMARK = ""
"""Landmark name of a boundary of lost tracking ("none" in the published program)."""


def usable_rank(camera: CameraTrack) -> IntArray:
    """(n,) position of each frame among the usable ones, so that neighbours differ by one."""
    rank: IntArray = np.cumsum(camera.usable, dtype=np.int64) - 1
    return rank


def find_visits(camera: CameraTrack, log: LandmarkLog, radius_m: float) -> tuple[Visit, ...]:
    """Closest approaches to each landmark, sorted by frame.

    For each landmark every maximal run of neighbouring usable frames closer than ``radius_m`` (3-D distance between
    camera and logged pose, metres; rows of lost tracking do not count) gives one visit at its least distance.
    """
    rank = usable_rank(camera)
    distance = np.linalg.norm(camera.position_acs[log.frame] - log.position_acs, axis=1)
    near = np.flatnonzero((distance < radius_m) & ~log.lost)
    if near.size == 0:
        return ()
    starts = _run_starts(log.landmark[near], rank[log.frame[near]])
    nearest = near[_argmin_of_runs(distance[near], starts)]
    nearest = nearest[np.argsort(log.frame[nearest], kind="stable")]
    return tuple(Visit(int(log.frame[row]), log.ids[log.landmark[row]], float(distance[row])) for row in nearest)


def _run_starts(landmark: IntArray, rank: IntArray) -> IntArray:
    """Indices (r,) at which a new run of one landmark's neighbouring frames begins; ``rank`` (k,) of each row."""
    new = np.ones(len(landmark), dtype=bool)
    new[1:] = (np.diff(landmark) != 0) | (np.diff(rank) != 1)
    return np.flatnonzero(new)


def _argmin_of_runs(values: FloatArray, starts: IntArray) -> IntArray:
    """Index (r,) of the first least of the values (k,) of each run, which begin at ``starts`` (r,)."""
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(values))))
    order = np.lexsort((values, run))
    return order[np.searchsorted(run[order], np.arange(len(starts)))]


def frames_without_landmark(camera: CameraTrack, log: LandmarkLog) -> BoolArray:
    """(n,) mask of the usable frames at which every landmark is unknown: not yet seen, or lost."""
    in_sight = np.zeros(len(camera.time_ns), dtype=bool)
    in_sight[log.frame[~log.lost]] = True
    if camera.state is not None and log.frame.size:
        # Landmarks fall silent where the tracker follows too many of them; that is not a loss.
        in_sight[log.frame.min() :] |= camera.state.tracking[log.frame.min() :]
    nothing_in_sight: BoolArray = camera.usable & ~in_sight
    return nothing_in_sight


def boundaries_of_loss(camera: CameraTrack, log: LandmarkLog) -> tuple[Visit, ...]:
    """First and last frame of each run of frames without any known landmark, as nameless boundaries."""
    critical = np.flatnonzero(frames_without_landmark(camera, log))
    if critical.size == 0:
        return ()
    rank = usable_rank(camera)[critical]
    breaks = np.flatnonzero(np.diff(rank) != 1)
    first = critical[np.concatenate(([0], breaks + 1))]
    last = critical[np.concatenate((breaks, [len(critical) - 1]))]
    return tuple(
        Visit(int(frame), NO_LANDMARK, float("nan")) for pair in zip(first, last, strict=True) for frame in pair
    )


def merge_boundaries(*groups: tuple[Visit, ...]) -> tuple[Visit, ...]:
    """Sort boundaries by frame and drop each one whose predecessor has the same landmark."""
    ordered = sorted((visit for group in groups for visit in group), key=lambda visit: visit.frame)
    return tuple(visit for i, visit in enumerate(ordered) if i == 0 or visit.landmark != ordered[i - 1].landmark)
