"""What a tracker gets wrong on stairs and in lifts, beside what it gets wrong everywhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracking.dead_reckoning import CameraFrames
from vislam2tag.simulation.tracking.faults import CameraJump, FaultPlan

LOST_SHARE = 0.7
"""Share of the rides after which tracking is lost when the doors open; the camera jumps after the others."""
AFTER_RIDE_S = (0.5, 3.0)
"""Tracking is lost from the ride's end on for so long."""
JUMP_M = 3.0
"""Jump of the camera, per axis, where tracking is not lost; it jumps back some seconds later."""
JUMP_BACK_S = (3.0, 8.0)
CLIMBED_SIGMA = 0.02
"""Relative error of the height climbed on one walk."""
UPDATE_M, BREAK_M, FOUND_M = 0.08, 1.0, 0.1
"""Vertical steps at map updates (camera and landmarks together), breaks, and when tracking is found again."""


def with_rides(
    faults: FaultPlan, walk: TrueWalk, frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator
) -> FaultPlan:
    """Add what happens when the walker leaves a lift: tracking is lost, or the camera jumps."""
    if settings.severity == 0:
        return faults
    lost, breaks, last = [faults.lost], list(faults.breaks), len(frames.plane) - 1
    for end_ns in walk.rides_ns[:, 1]:
        start = int(np.searchsorted(frames.exposure_ns, end_ns))
        if start >= last:
            continue
        if rng.random() < LOST_SHARE:
            stop = start + round(float(rng.uniform(*AFTER_RIDE_S)) * settings.frame_rate_hz)
            lost.append(np.array([[start, min(stop, last)]]))
        else:
            jump = complex(*rng.normal(0, settings.severity * JUMP_M, 2))
            back = start + int(rng.uniform(*JUMP_BACK_S) * settings.frame_rate_hz)
            breaks.append(CameraJump(start, jump, float(rng.normal(0, 0.1)), back))
    runs = np.vstack(lost)
    ordered = tuple(sorted(breaks, key=lambda fault: fault.frame))
    return replace(faults, lost=runs[np.argsort(runs[:, 0], kind="stable")], breaks=ordered)


@dataclass(frozen=True)
class VerticalErrors:
    """What is added to heights at each frame (f,), metres: to the camera and what it sees then, and to everything."""

    camera_m: FloatArray
    map_m: FloatArray


def vertical_errors(
    faults: FaultPlan, frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator
) -> VerticalErrors:
    """Draw the vertical part of a walk's faults, and the error of the height climbed."""
    count, severity = len(frames.plane), settings.severity
    seen = frames.height - frames.unseen
    camera = severity * CLIMBED_SIGMA * float(rng.standard_normal()) * (seen - seen[0])
    for fault in faults.breaks:
        camera[fault.frame : fault.back] += severity * BREAK_M * rng.standard_normal()
    for found in faults.lost[:, 1].tolist():
        camera[found:] += severity * FOUND_M * rng.standard_normal()
    together = np.zeros(count)
    for update in faults.updates:
        together[update.frame : update.until] += severity * UPDATE_M * rng.standard_normal()
    return VerticalErrors(camera, together)
