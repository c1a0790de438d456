"""A walk put together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from second_generator.events import draw_events
from second_generator.floor import Floor, bent_grid, hang_sheets
from second_generator.gait import walk_route
from second_generator.habits import FAULTS, Habits, Severity
from second_generator.logs import camera_track, landmark_log
from second_generator.odometry import Odometry, dead_reckoning, draw_losses, while_lost
from second_generator.route import draw_route
from second_generator.sightings import draw_errors, draw_passes, seen_at
from second_generator.styles import Style, draw_style
from second_generator.surveying import survey_sheets
from second_generator.tracker import Tracker, World
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks

ATTEMPTS = 50
FEWEST_MET = 2


@dataclass(frozen=True)
class MadeWalk:
    """What a strategy maps, and the truth; ``n`` frames, ``m`` landmarks."""

    name: str
    camera: CameraTrack
    log: LandmarkLog
    landmarks: Landmarks
    truth_bcs: FloatArray
    """(n, 2) true camera positions, metres."""
    floor: Floor
    apart_m: FloatArray
    """(n, m) true distances from the camera to the landmarks."""
    seen: BoolArray
    """(n, m) frames that sight each landmark."""


def make_walk(seed: int, severity: Severity, only: Style | None = None) -> MadeWalk:
    """Make the walk of a seed, of any style or one alone; one that meets fewer than two surveyed landmarks is redrawn.

    Raises RuntimeError if that does not help.
    """
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, list(FAULTS).index(severity), attempt])
        style = only or draw_style(rng)
        walk = _put_together(f"{style.__name__}-{seed}", style(rng).at(severity), rng)
        if walk is not None:
            return walk
    raise RuntimeError(f"seed {seed} makes no {severity} walk past {FEWEST_MET} surveyed landmarks")


def _put_together(name: str, habits: Habits, rng: np.random.Generator) -> MadeWalk | None:
    """Make a walk; None where it meets too few surveyed landmarks."""
    gait = habits.gait
    floor = bent_grid(habits.sheets.spacing_m, rng)
    hung = hang_sheets(floor, habits.sheets, rng)
    route = draw_route(floor, gait.duration_s * gait.speed_mps * 1.6 + 5, rng)
    motion = walk_route(route, hung.place, gait, rng)
    frames = len(motion.time_s)
    surveyed = survey_sheets(hung, frames, habits.surveying, rng)
    world = World(motion, surveyed.sheets, hung.along_wall)
    lost = draw_losses(frames, gait, habits.losses, rng)
    passes = draw_passes(np.abs(world.offsets), lost, gait, habits.sight, rng)
    seen = seen_at(passes, world.sheets.shape)
    if np.count_nonzero(seen.any(axis=0) & surveyed.landmarks.surveyed) < FEWEST_MET:
        return None
    errors = draw_errors(passes, world.offsets, hung.along_wall, habits.errors, rng)
    walked = dead_reckoning(motion, habits.drift, rng)
    odometry = Odometry(while_lost(walked.place, lost, habits.losses, gait.rate_hz, rng), walked.from_bcs)
    events = draw_events(frames, lost, habits, rng)
    logged = Tracker(world, odometry, passes, errors, habits, rng).run(events)
    camera = camera_track(logged, motion, habits, rng)
    return MadeWalk(
        name=name,
        camera=camera,
        log=landmark_log(logged, camera, surveyed.landmarks.ids, lost, habits, rng),
        landmarks=surveyed.landmarks,
        truth_bcs=np.column_stack((motion.place.real, motion.place.imag)),
        floor=floor,
        apart_m=np.abs(world.offsets),
        seen=seen,
    )
