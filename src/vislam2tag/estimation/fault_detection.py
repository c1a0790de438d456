"""Faults detected in a solved walk: landmarks that do not fit the others, and slips of the tracker.

Heavy tails keep a landmark that is wrongly surveyed, moved, or has another's id from distorting the walk. Here it is
identified: each suspect in turn is treated as unsurveyed, so that only the others determine its place.

A slip is a stretch between passes with a larger deviation than the tracker's usual drift explains. Unlike a break it is
not visible in a single step, but in the landmarks before and after.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.status import Contradiction, EventKind, TrackerEvent
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.smoother import SolvedWalk
from vislam2tag.estimation.tracker_errors import DOUBTED, ESTIMATED

CERTAIN_SIGMAS = 5.0
"""A landmark contradicts the others if they put it this many standard deviations from its surveyed place ..."""
LEAST_M = 0.15
"""... and at least this far."""
FEWEST_OTHERS = 2
"""Number of other surveyed landmarks that must have been passed."""
UNUSUAL_SIGMAS = 4.0
"""A slip is larger than this many standard deviations of the stretch's usual drift ..."""
LEAST_SLIP_M = 0.3
"""... and at least this far."""
WORTH_ASKING_M = 0.15
"""Smaller slips are corrected about as well by the drift of the stretch as by knowing their frame."""


def contradictions(smoothed: SolvedWalk) -> tuple[Contradiction, ...]:
    """Return the landmarks that contradict all others, the greatest contradiction first."""
    named = np.array([bool(name) for name in smoothed.model.observations.ids], dtype=np.bool_)  # others are places
    known = np.flatnonzero(smoothed.priors.surveyed & named)
    passed = np.intersect1d(known, smoothed.model.observations.passes.landmark)
    if len(passed) <= FEWEST_OTHERS:
        return ()
    doubt = smoothed.variance_factors.landmark.copy()
    np.maximum.at(doubt, smoothed.model.observations.passes.landmark, smoothed.variance_factors.sighting)
    suspects = passed[doubt[passed] > DOUBTED]  # none of the others can contradict the rest
    found = [one for landmark in suspects.tolist() if (one := _contradiction(smoothed, landmark)) is not None]
    return tuple(sorted(found, key=lambda one: -one.size_m))


def predicted(smoothed: SolvedWalk, landmark: int) -> SolvedWalk:
    """Solve again with one landmark treated as unsurveyed, and with its best pass treated as a usual one."""
    own = smoothed.model.observations.passes.landmark == landmark
    sighting = smoothed.variance_factors.sighting.copy()
    sighting[own] /= sighting[own].min()
    priors, variance_factors = smoothed.priors.without(landmark), replace(smoothed.variance_factors, sighting=sighting)
    return SolvedWalk.of(replace(smoothed.linear, priors=priors, variance_factors=variance_factors))


def discrepancy(smoothed: SolvedWalk, trial: SolvedWalk, landmark: int) -> tuple[FloatArray, FloatArray]:
    """Offset (2,) from a landmark's surveyed place to its place in the trial, metres, and its covariance (2, 2)."""
    priors = smoothed.priors
    offset = as_points(trial.landmark_position[landmark] - priors.position[landmark])
    return offset, trial.landmark_covariance()[landmark] + priors.covariance[landmark]


def _contradiction(smoothed: SolvedWalk, landmark: int) -> Contradiction | None:
    offset, covariance = discrepancy(smoothed, predicted(smoothed, landmark), landmark)
    size_m = float(np.hypot(*offset))
    # Places far away leave a covariance that is not positive.
    sigmas = float(np.sqrt(max(float(offset @ np.linalg.solve(covariance, offset)), 0.0)))
    if sigmas < CERTAIN_SIGMAS or size_m < LEAST_M:
        return None
    return Contradiction(
        landmark=smoothed.model.observations.ids[landmark],
        size_m=size_m,
        sigma_m=size_m / sigmas,
        offset_bcs_m=(float(offset[0]), float(offset[1])),
        passes=int(np.sum(smoothed.model.observations.passes.landmark == landmark)),
    )


def slips(smoothed: SolvedWalk) -> tuple[TrackerEvent, ...]:
    """Report slips: size, turn, and the most likely frame."""
    if smoothed.priors.places is not None:  # between places on a plan stretches are too short to show slips
        return ()
    observations, off = smoothed.model.observations, smoothed.drift_residual
    size = np.hypot(off[:, 0], off[:, 1])
    unusual = (size > UNUSUAL_SIGMAS * _usual_drift_m(smoothed)) & (size > LEAST_SLIP_M) & ~_jumped(smoothed)
    found = []
    for k in np.flatnonzero(unusual).tolist():
        start, stop = observations.nodes[k : k + 2].tolist()
        doubt = observations.odometry.doubt[start:stop] * smoothed.model.turn[start:stop]
        along = np.abs((doubt * complex(off[k, 0], -off[k, 1])).real)
        at = start + int(along.argmax()) + 1 if doubt.any() else (start + stop) // 2
        frame = int(observations.odometry.frame[at])
        found.append(TrackerEvent(EventKind.SLIP, frame, float(size[k]), float(off[k, 3])))
    return tuple(found)


def may_have_slipped(smoothed: SolvedWalk) -> bool:
    """Whether the deviation of a stretch is large enough to ask other sensors for the frame of a slip."""
    off = smoothed.drift_residual
    return bool(((np.hypot(off[:, 0], off[:, 1]) > WORTH_ASKING_M) & ~_jumped(smoothed)).any())


def _jumped(smoothed: SolvedWalk) -> BoolArray:
    """Mask (p + 1,) of the stretches with a break, a correction or a loss."""
    observations = smoothed.model.observations
    until = np.concatenate(([0], np.cumsum(observations.odometry.jumped)))
    return np.asarray(np.diff(until[observations.nodes]) > 0)


def _usual_drift_m(smoothed: SolvedWalk) -> FloatArray:
    """(p + 1,) standard deviation per axis at the end of each stretch by the session's usual drift."""
    covariance = sum(smoothed.noise.level(source) ** 2 * smoothed.model.stretches[source] for source in ESTIMATED)
    return np.asarray(np.sqrt(np.trace(np.asarray(covariance)[:, :2, :2], axis1=1, axis2=2) / 2))
