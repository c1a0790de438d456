"""Learns the speed model of dead reckoning from walks with taps: each leg between two taps tells its windows' speeds.

    python benchmarks/training.py site1/F1 src/vislam2tag/estimation/dead_reckoning/speed_model.json

The folder is a floor of the Indoor Location Competition 2.0 (MIT licence; ../shared/data/ilc20/site1-F1.tar.xz); what
was learned from is written beside the coefficients.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from carrying import swung

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import NAMES, SpeedModel
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk, SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.sessions.without_poses import inertial_log

ROUNDS = 3
REWEIGHTINGS = 5
RIDGE = 30.0
USUAL_M_S = 1.2
"""The speed of everybody before anything is learned."""
LEG_SIGMA_M = 0.7
LEG_SIGMA_GROWTH = 0.1
"""Error of a leg by its taps, metres, and what its time adds, metres per square root of a second."""
TAIL = 4.0


def carried_walks(walks: Sequence[tuple[InertialLog, FixLog]]) -> list[tuple[SensedWalk, FixLog]]:
    """Walks to learn from, each as it was recorded, phone in the hand, and as a swinging hand would have recorded it.

    Those without two fixes, or without inertial readings of a few seconds, are left out.
    """
    logs = [(each, fixes) for log, fixes in walks if len(fixes.time_ns) > 1 for each in (log, swung(log))]
    return [(sensed, fixes) for log, fixes in logs if (sensed := SensedWalk.of(log)) is not None]


def train(walks: Sequence[tuple[SensedWalk, FixLog]], settings: DeadReckoningSettings) -> SpeedModel:
    """Learn the speed from walks whose fixes are dense, by ridge regression; each must have two fixes or more.

    The headings come from the smoothed paths of the model before, so that it is learned in a few rounds.
    """
    spread = np.concatenate([sensed.features.values for sensed, _ in walks]).std(axis=0)
    usual = np.array([USUAL_M_S * name.startswith("one") for name in NAMES])
    model = SpeedModel(usual)
    for _ in range(ROUNDS):
        legs = [_legs(sensed.path(fixes, model, settings)) for sensed, fixes in walks]
        rows, lengths = (np.concatenate(part) for part in zip(*legs, strict=True))
        model = SpeedModel(usual + _robust_ridge(rows, lengths - rows @ usual, RIDGE * spread**2))
    return model


def _legs(walk: ReckonedWalk) -> tuple[FloatArray, FloatArray]:
    """Sums (2 l, 28) of the features along the l legs of a walk, east and north, and what they make (2 l,), metres.

    Both are in parts of what a leg's length is known to.
    """
    time_s, features = walk.sensed.signals.time_s, walk.sensed.features
    windows = (features.values * features.moving[:, None]).T
    values = np.stack([np.interp(time_s, features.time_s, column) for column in windows], axis=1)
    ahead = np.cumsum(values * np.exp(1j * walk.course_rad)[:, None], axis=0) / RATE_HZ
    tie_s = walk.nodes.time_s[walk.fixes.node]
    rows = np.diff(ahead[np.round(tie_s * RATE_HZ).astype(np.int64).clip(0, len(ahead) - 1)], axis=0)
    leg = np.diff(walk.fixes.position)
    sigma = np.tile(np.hypot(LEG_SIGMA_M, LEG_SIGMA_GROWTH * np.sqrt(np.diff(tie_s))), 2)
    rows_by_axis = np.concatenate((rows.real, rows.imag))
    return rows_by_axis / sigma[:, None], np.concatenate((leg.real, leg.imag)) / sigma


def _robust_ridge(rows: FloatArray, target: FloatArray, penalty: FloatArray) -> FloatArray:
    """Coefficients (c,) of rows (r, c) for targets (r,) in units of their sigma, with Student-like weights."""
    weight, solution = np.ones(len(target)), np.zeros(rows.shape[1])
    shrink = np.diag(np.maximum(penalty, 1e-6))
    for _ in range(REWEIGHTINGS):
        weighted = rows * weight[:, None]
        solution = np.linalg.solve(weighted.T @ rows + shrink, weighted.T @ target)
        weight = 1 / (1 + (target - rows @ solution) ** 2 / TAIL)
    return solution


def logged_walks(folder: Path) -> list[tuple[InertialLog, FixLog]]:
    """Read the traces below a floor's folder that have inertial readings, and their taps."""
    walks = []
    for path in sorted(folder.glob("path_data_files/*.txt")):
        trace = parse_trace(path.read_bytes(), path.name)
        inertial = inertial_log(trace.sensors)
        if inertial is not None:
            walks.append((inertial, trace.taps))
    return walks


def main() -> None:
    """Train and write."""
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    walks = logged_walks(folder)
    model = train(carried_walks(walks), DeadReckoningSettings())
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(folder.glob("path_data_files/*.txt"))))
    record = {
        "learned_from": f"Indoor Location Competition 2.0, {folder.parent.name}/{folder.name}",
        "licence": "MIT (data: Microsoft Research, location-competition/indoor-location-competition-20)",
        "walks": len(walks),
        "each_walk": "as recorded, phone in the hand, and as a swinging hand would have recorded it",
        "sha256": digest.hexdigest(),
        "command": "python benchmarks/training.py site1/F1 src/vislam2tag/estimation/dead_reckoning/speed_model.json",
        "unit": "m/s",
        "coefficients": dict(zip(NAMES, model.coefficients.round(5).tolist(), strict=True)),
    }
    target.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
