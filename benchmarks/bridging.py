"""Errors inside losses, breaks and slips of simulated walks with a tracker, with and without inertial sensors.

    python benchmarks/bridging.py                       12 walks of 3 minutes for each seed and severity
    python benchmarks/bridging.py --slips               trackers that are led off by 0.7 m in half a second, unreported

Frames count as inside where the tracker told nothing of the walk (losses and holes), as near where that is less than
ten seconds away. The share of them inside the stated regions stands beside the errors.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np
from data_sets import TRUTH_FILE, Walk, landmarks_on

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.evaluation.truth import read_truth
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.without_poses import inertial_log
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.survey import simulate
from vislam2tag.simulation.tracking import tracker
from vislam2tag.simulation.tracking.dead_reckoning import CameraFrames, DeadReckoning, dead_reckon
from vislam2tag.smoother.odometry import continuous_odometry

NEAR_S = 10.0
SLIP_M, SLIP_S, SLIP_EVERY_S = 0.7, 0.5, 40.0
WITHIN = {"68 %": 2.279, "95 %": 5.991}
"""Squared Mahalanobis distances (two axes) within which a stated region holds the truth."""


@dataclass(frozen=True)
class Frames:
    """Errors (k,), metres, of some frames, and their squared Mahalanobis distances (k,)."""

    error_m: FloatArray
    distance: FloatArray


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[31, 32])
    parser.add_argument("--severity", nargs="+", default=["mild", "default", "severe"])
    parser.add_argument("--slips", action="store_true")
    options = parser.parse_args()
    shown = ("near a slip",) if options.slips else ("inside", "near", "elsewhere")
    print("| severity | frames | bridges | mean / p95, m | inside 68 % / 95 % |\n| --- | --- | --- | --- | --- |")
    for severity in options.severity:
        with mock.patch.object(tracker, "dead_reckon", slipping if options.slips else dead_reckon):
            walks = [walk for seed in options.seeds for walk in walks_with_readings(seed, severity)]
        masks = [near_slips(walk) if options.slips else places(walk) for walk in walks]
        for place in shown:
            for bridges in (False, True):
                parts = [errors(walk, mask[place], bridges) for walk, mask in zip(walks, masks, strict=True) if mask]
                error_m = np.concatenate([part.error_m for part in parts])
                distance = np.concatenate([part.distance for part in parts])
                held = " / ".join(f"{np.mean(distance < limit):.0%}" for limit in WITHIN.values())
                cells = (severity, f"{place} ({len(error_m)})", "with" if bridges else "without")
                print(f"| {' | '.join(cells)} | {error_m.mean():.3f} / {np.percentile(error_m, 95):.2f} | {held} |")


def walks_with_readings(seed: int, severity: str) -> Iterator[Walk]:
    """Walks of a simulated survey with their inertial readings."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(regular_survey(seed, severity, sessions=3), root)
        survey = open_survey(root)
        for ref in survey.sessions:
            session = read_session(ref)
            camera = replace(session.camera, inertial=inertial_log(session.tables["sensors"]))
            landmarks = landmarks_on(survey, ref.key.floor)
            yield Walk(ref.slug, camera, session.landmarks, landmarks, read_truth(ref.folder / TRUTH_FILE))


def places(walk: Walk) -> dict[str, BoolArray]:
    """Masks (n,) of the frames of a walk inside what is bridged, near it and elsewhere; none where nothing is."""
    odometry = continuous_odometry(walk.camera, walk.log)
    untold = odometry.jump_m2 > 0
    if not untold.any():
        return {}
    count = len(walk.camera.time_ns)
    inside, near = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    lost = untold & odometry.blind
    inside[odometry.frame[1:-1][lost[1:] & lost[:-1]]] = True
    at_s = odometry.time_s[1:][untold]
    near[odometry.frame] = np.abs(odometry.time_s[:, None] - at_s).min(axis=1) < NEAR_S
    return {"inside": inside, "near": near & ~inside, "elsewhere": ~near & ~inside}


def slip_times_s(end_s: float) -> FloatArray:
    """When (k,) a tracker slips on a walk of so many seconds."""
    return np.arange(SLIP_EVERY_S / 2, end_s - NEAR_S, SLIP_EVERY_S)


def slipping(frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator) -> DeadReckoning:
    """Dead reckoning of a tracker that also slips, each time another way."""
    reckoned, time_s = dead_reckon(frames, settings, rng), (frames.exposure_ns - frames.exposure_ns[0]) * 1e-9
    ways = np.random.default_rng(len(time_s))
    slips = sum(
        SLIP_M * np.exp(1j * ways.uniform(-np.pi, np.pi)) * np.clip((time_s - at_s) / SLIP_S, 0, 1)
        for at_s in slip_times_s(time_s[-1]).tolist()
    )
    return replace(reckoned, plane=reckoned.plane + slips)


def near_slips(walk: Walk) -> dict[str, BoolArray]:
    """Mask (n,) of the frames less than ten seconds from a slip."""
    time_s = (walk.camera.time_ns - walk.camera.time_ns[0]) * 1e-9
    return {"near a slip": np.abs(time_s[:, None] - slip_times_s(time_s[-1])).min(axis=1) < NEAR_S}


def errors(walk: Walk, frames: BoolArray, bridges: bool) -> Frames:
    """Errors of a walk's frames in a mask (n,)."""
    camera = walk.camera if bridges else replace(walk.camera, inertial=None)
    trajectory = strategy_named("smoother", MappingSettings()).map(camera, walk.log, walk.landmarks)
    assert walk.truth is not None
    time_ns = walk.truth.time_ns - walk.truth.time_ns[0]
    at_ns = camera.time_ns - walk.truth.time_ns[0]
    kept = frames & camera.usable & (at_ns >= 0) & (at_ns <= time_ns[-1]) & np.isfinite(trajectory.sigma_m)
    true = np.column_stack([np.interp(at_ns[kept], time_ns, axis) for axis in walk.truth.position_bcs.T])
    error = trajectory.position_bcs[kept, :2] - true
    distance = np.einsum("ni,nij,nj->n", error, np.linalg.inv(trajectory.covariance_bcs[kept]), error)
    return Frames(np.linalg.norm(error, axis=1), distance)


if __name__ == "__main__":
    main()
