"""Slips: stretches between passes over which the tracker led elsewhere than its usual drift explains.

Unlike a break no step alone proves it; the landmarks before and after tell. Where some step of the stretch misses what
its neighbours predict in that direction, it happened there; otherwise nobody knows when.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.faults import EventKind, TrackerEvent
from vislam2tag.estimation.noise import ESTIMATED
from vislam2tag.estimation.smoothing import Smoothed

UNUSUAL_SIGMAS = 4.0
"""A slip led farther off than this many standard deviations of the stretch's usual drift ..."""
LEAST_M = 0.3
"""... and at least this far."""
WORTH_ASKING_M = 0.15
"""Less is made good by the drift of the stretch about as well as by knowing where it happened."""


def slips(smoothed: Smoothed) -> tuple[TrackerEvent, ...]:
    """Report slips: how far off they led, how much they turned, and at which frame at the likeliest."""
    observations, off = smoothed.model.observations, _led_off(smoothed)
    size = np.hypot(off[:, 0], off[:, 1])
    unusual = (size > UNUSUAL_SIGMAS * _usual_drift_m(smoothed)) & (size > LEAST_M) & ~_jumped(smoothed)
    found = []
    for k in np.flatnonzero(unusual).tolist():
        start, stop = observations.nodes[k : k + 2].tolist()
        doubt = observations.odometry.doubt[start:stop] * smoothed.model.turn[start:stop]
        along = np.abs((doubt * complex(off[k, 0], -off[k, 1])).real)
        at = start + int(along.argmax()) + 1 if doubt.any() else (start + stop) // 2
        frame = int(observations.odometry.frame[at])
        found.append(TrackerEvent(EventKind.SLIP, frame, float(size[k]), float(off[k, 3])))
    return tuple(found)


def may_have_slipped(smoothed: Smoothed) -> bool:
    """Whether a stretch led far enough elsewhere for it to be worth asking other sensors where it slipped."""
    off = _led_off(smoothed)
    return bool(((np.hypot(off[:, 0], off[:, 1]) > WORTH_ASKING_M) & ~_jumped(smoothed)).any())


def _led_off(smoothed: Smoothed) -> FloatArray:
    """(p + 1, 4) how far off each stretch led: x, y, metres in the BCS, scale and heading."""
    state = smoothed.solution.state
    off = state[1:] - np.einsum("kij,kj->ki", smoothed.model.carry, state[:-1])
    return np.asarray(off + smoothed.model.stretches_drifted)


def _jumped(smoothed: Smoothed) -> BoolArray:
    """Mask (p + 1,) of the stretches with a break, a correction or a loss."""
    observations = smoothed.model.observations
    until = np.concatenate(([0], np.cumsum(observations.odometry.jumped)))
    return np.asarray(np.diff(until[observations.nodes]) > 0)


def _usual_drift_m(smoothed: Smoothed) -> FloatArray:
    """(p + 1,) standard deviation per axis of where each stretch leads by the session's usual drift."""
    covariance = sum(smoothed.noise.level(source) ** 2 * smoothed.model.stretches[source] for source in ESTIMATED)
    return np.asarray(np.sqrt(np.trace(np.asarray(covariance)[:, :2, :2], axis1=1, axis2=2) / 2))
