"""What a session knows of its place besides its shape: landmarks seen, taps, the compass, other walks."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.tracks import CameraTrack
from vislam2tag.estimation.floor_plan.compass import compass_turn_rad
from vislam2tag.estimation.floor_plan.evidence import Fact, KnownPlace, KnownTurn, PossiblePlaces
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations

TAP_SIGMA_M = 0.7
"""A tap without a stated sigma: a person taps a point on the plan."""
SEEN_SIGMA_M = 0.3
"""Error of a sighting, per axis, beyond that of the survey."""
COMPASS_SIGMA_RAD = np.radians(25.0)
"""Error of the direction of a whole walk by the rotation vector: iron and currents turn it indoors."""
MOST_LANDMARKS = 40


def facts_of(camera: CameraTrack, observations: WalkObservations, priors: LandmarkPriors) -> list[Fact]:
    """All facts of a session, in the BCS of its floor."""
    return [*_landmarks(observations, priors), *_taps(camera, observations), *_hints(camera, observations)]


def _landmarks(observations: WalkObservations, priors: LandmarkPriors) -> list[Fact]:
    """Passes of surveyed landmarks."""
    passes = observations.passes
    rows = [row for row in range(len(passes.at)) if priors.surveyed[passes.landmark[row]]]
    rows = rows[:: max(1, -(-len(rows) // MOST_LANDMARKS))]
    found: list[Fact] = []
    for row in rows:
        landmark = passes.landmark[row]
        sigma = float(np.sqrt(np.trace(priors.covariance[landmark]) / 2 + SEEN_SIGMA_M**2))
        place, offset = complex(priors.position[landmark]), complex(passes.offset[row])
        found.append(KnownPlace(int(passes.at[row]), place, sigma, offset))
    return found


def _taps(camera: CameraTrack, observations: WalkObservations) -> list[Fact]:
    """Places that a person gave."""
    if camera.fixes is None:
        return []
    fixes = camera.fixes
    sigma_m = np.full(len(fixes.time_ns), np.nan) if fixes.sigma_m is None else fixes.sigma_m
    return [
        KnownPlace(_frame(camera, observations, time_ns), complex(x, y), TAP_SIGMA_M if np.isnan(sigma) else sigma)
        for time_ns, (x, y), sigma in zip(
            fixes.time_ns.tolist(), fixes.position_bcs.tolist(), sigma_m.tolist(), strict=True
        )
    ]


def _hints(camera: CameraTrack, observations: WalkObservations) -> list[Fact]:
    """What other walks of the floor say."""
    hints = camera.hints
    if hints is None:
        return []
    found: list[Fact] = [
        PossiblePlaces(
            _frame(camera, observations, hint.time_ns),
            hint.position_bcs[:, 0] + 1j * hint.position_bcs[:, 1],
            hint.weight,
            hint.sigma_m,
        )
        for hint in hints.places
    ]
    compass_rad = compass_turn_rad(camera, observations.odometry) if hints.north_rad is not None else None
    if hints.north_rad is not None and compass_rad is not None:
        middle = len(observations.odometry.path) // 2
        found.append(KnownTurn(middle, hints.north_rad + compass_rad, COMPASS_SIGMA_RAD))
    return found


def _frame(camera: CameraTrack, observations: WalkObservations, time_ns: int) -> int:
    """Index into the odometry of the frame nearest to a moment."""
    frames = camera.time_ns[observations.odometry.frame]
    after = int(np.searchsorted(frames, time_ns).clip(1, len(frames) - 1))
    return after if frames[after] - time_ns < time_ns - frames[after - 1] else after - 1
