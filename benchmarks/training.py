"""Learns the speed model of dead reckoning from walks with taps, also with simulated ways of carrying the phone.

Each leg between two taps gives the speed of its windows.

    python benchmarks/training.py site1/F1 src/vislam2tag/estimation/dead_reckoning/speed_model.json

The folder is a floor of the Indoor Location Competition 2.0 (MIT licence; ../shared/data/ilc20/site1-F1.tar.xz). The
training data are recorded with the coefficients.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import CADENCE_RANGE_HZ, NAMES, SpeedModel, WindowFeatures
from vislam2tag.estimation.dead_reckoning.signals import BAND_HZ, RATE_HZ, Headings, WalkSignals, low_pass
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
SWING_RAD = np.radians(25)
SWING_HZ = 0.95
"""An arm swings once in two steps."""
ARM_M = 0.5
THIGH_RAD = np.radians(20)
"""A hip bends from 10 degrees back to 30 degrees ahead while its leg walks ..."""
RECOIL = 0.25
"""... and goes ahead faster than back: so much of the swing has twice its frequency."""
THIGH_M = 0.3
"""From the hip to a trouser pocket."""
IN_POCKET_DEG = (100.0, 20.0, 75.0)
"""How a phone is turned in a pocket, about its z, y and x axes in turn."""


def held(log: InertialLog, angles_deg: tuple[float, float, float]) -> InertialLog:
    """The same phone turned about its z, y and x axes in turn, degrees."""
    hold = Rotation.from_euler("zyx", angles_deg, degrees=True)
    orientation = (Rotation.from_quat(np.array(log.orientation)) * hold).as_quat()
    force, rate = (hold.inv().apply(np.array(values)) for values in (log.force, log.rate))
    return replace(log, force=force, rate=rate, orientation=orientation)


def swung(log: InertialLog) -> InertialLog:
    """The same phone in a hand that swings about a shoulder :data:`ARM_M` away, as a pendulum about its x axis."""
    pace = 2 * np.pi * SWING_HZ

    def arm(time_ns: IntArray) -> _Swing:
        phase = pace * (time_ns - log.force_ns[0]) * 1e-9
        sine = SWING_RAD * np.sin(phase)
        return _Swing(sine, SWING_RAD * pace * np.cos(phase), -(pace**2) * sine)

    return _swinging(log, ARM_M, arm)


def on_thigh(log: InertialLog) -> InertialLog:
    """The same phone in a trouser pocket: turned, and swinging about the hip in time with the steps that it felt.

    A log without a few seconds of readings is only turned.
    """
    signals = WalkSignals.of(log)
    if signals is None:
        return held(log, IN_POCKET_DEG)
    angle = _thigh_rad(signals, log)
    rate = np.gradient(angle, 1 / RATE_HZ)
    curves = angle, rate, np.gradient(rate, 1 / RATE_HZ)

    def thigh(time_ns: IntArray) -> _Swing:
        at_s = (time_ns - signals.start_ns) * 1e-9
        return _Swing(*(np.interp(at_s, signals.time_s, curve) for curve in curves))

    return held(_swinging(log, THIGH_M, thigh), IN_POCKET_DEG)


def sampled(log: InertialLog, every: int, noise_m_s2: float) -> InertialLog:
    """Every so many readings only, with noise, a tenth of which (rad/s) the gyroscope has."""
    rng = np.random.default_rng(0)
    force, rate = log.force[::every], log.rate[::every]
    force = force + rng.normal(0, noise_m_s2, force.shape)
    rate = rate + rng.normal(0, noise_m_s2 / 10, rate.shape)
    return replace(log, force_ns=log.force_ns[::every], force=force, rate_ns=log.rate_ns[::every], rate=rate)


@dataclass(frozen=True)
class _Swing:
    """``angle_rad`` (k,) of a pendulum, its ``rate`` (k,), rad/s, and how that changes (k,), rad/s^2."""

    angle_rad: FloatArray
    rate: FloatArray
    change: FloatArray


def _swinging(log: InertialLog, length_m: float, swing: Callable[[IntArray], _Swing]) -> InertialLog:
    """The same phone at the end of a pendulum about its x axis, whose angle is ``swing`` at times (k,), ns."""

    def turn(time_ns: IntArray) -> Rotation:
        return Rotation.from_rotvec(np.outer(swing(time_ns).angle_rad, (1.0, 0.0, 0.0)))

    felt, turned = swing(log.force_ns), swing(log.rate_ns)
    moved = length_m * np.column_stack((0 * felt.rate, felt.change, felt.rate**2))
    force = turn(log.force_ns).inv().apply(np.array(log.force)) + moved
    rate = turn(log.rate_ns).inv().apply(np.array(log.rate)) + np.outer(turned.rate, (1.0, 0.0, 0.0))
    orientation = log.orientation
    if len(orientation):
        orientation = (Rotation.from_quat(np.array(orientation)) * turn(log.orientation_ns)).as_quat()
    return replace(log, force=force, rate=rate, orientation=orientation)


def _thigh_rad(signals: WalkSignals, log: InertialLog) -> FloatArray:
    """How far ahead (n,) a thigh is at each moment, rad: one swing in two steps, none while standing."""
    from scipy.signal import butter, hilbert, sosfiltfilt

    up = Headings.of(signals, log).up
    features = WindowFeatures.of(signals, up)
    steps = butter(3, CADENCE_RANGE_HZ, "band", fs=RATE_HZ, output="sos")
    vertical = sosfiltfilt(steps, np.einsum("ni,ni->n", signals.force, up))
    phase = np.unwrap(np.angle(hilbert(vertical))) / 2
    moving = np.interp(signals.time_s, features.time_s, features.moving)
    return low_pass(THIGH_RAD * moving * (0.5 + np.sin(phase) + RECOIL * np.sin(2 * phase)), BAND_HZ)


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
