"""Error at hidden taps of walks without a tracker, by the number of kept taps, compared with simpler methods.

    python benchmarks/dead_reckoning.py site2/F4                 # with the speed model of the package
    python benchmarks/dead_reckoning.py site1/F1 --cross-validate # learned on the other four fifths of these walks
    python benchmarks/dead_reckoning.py site2/F4 --carried        # other phones, carried otherwise

The folder is a floor of the Indoor Location Competition 2.0. The step model is that of its organisers: steps from peaks
of the accelerometer, stride from their period and strength, heading from the rotation vector. Its closing error is
spread over the time between kept taps. The plan shows the shops. Nothing is snapped to other walks' taps.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import butter, lfilter
from scipy.spatial.transform import Rotation
from training import IN_POCKET_DEG, carried_walks, held, on_thigh, sampled, swung, train

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import SpeedModel, speed_model
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.sessions.without_poses import inertial_log
from vislam2tag.site.discover import read_site
from vislam2tag.site.walkable.drawn_cells import drawn_area

COLUMNS = {"all but one": None, "every 3rd": 3, "every 5th": 5, "first and last": 0}
FOLDS = 5
INSIDE = {"68 %": 2.279, "95 %": 5.991}
"""Squared Mahalanobis distances (two axes) within which a stated region holds the truth."""
SETTINGS = DeadReckoningSettings()
STRIDE_RANGE = (0.4, 0.8)


@dataclass(frozen=True)
class Walk:
    """One trace: its sensors as they were logged and as they are used, and its taps."""

    log: InertialLog
    sensed: SensedWalk
    taps: FixLog


Guess = Callable[[Walk, BoolArray], tuple[FloatArray, FloatArray | None]]
"""Positions (h, 2) and covariances at the hidden taps of a walk, by the mask (k,) of those kept."""


def main() -> None:
    """Print the table of a floor."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cross-validate", action="store_true")
    parser.add_argument("--carried", action="store_true")
    options = parser.parse_args()
    folder: Path = options.folder
    walks, reading = read_walks(folder)
    area = drawn_area(next(floor for floor in read_site(folder.parent)[0].floors if floor.name == folder.name))
    if options.carried:
        carried_table(walks, area)
        return
    models = cross_validated(walks) if options.cross_validate else [speed_model()] * len(walks)
    own = {id(walk): model for walk, model in zip(walks, models, strict=True)}
    steps = {id(walk): step_path(walk.log, walk.taps) for walk in walks}
    ways: dict[str, Guess] = {
        "straight line": lambda walk, kept: (between(walk.taps, kept, np.zeros_like(walk.taps.position_bcs)), None),
        "step model": lambda walk, kept: (between(walk.taps, kept, steps[id(walk)]), None),
        "without the plan": lambda walk, kept: reckoned(walk, kept, own[id(walk)], None),
        "dead reckoning": lambda walk, kept: reckoned(walk, kept, own[id(walk)], area),
    }
    start = time.process_time()
    for walk in walks:
        walk.sensed.path(walk.taps, own[id(walk)], SETTINGS, area)
    solving = (time.process_time() - start) / len(walks)
    print(
        f"Walks: {len(walks)}; processor time of one: {reading:.2f} s from its file to its features, {solving:.2f} s "
        f"to its path, together {(reading + solving) / counting_s():.2f} times that of counting to ten million"
    )
    print("| way | " + " | ".join(COLUMNS) + " |")
    for name, guess in ways.items():
        print(f"| {name} | " + " | ".join(cell(walks, every, guess) for every in COLUMNS.values()) + " |")


def carried_table(walks: list[Walk], area: WalkableArea | None) -> None:
    """Print the errors of dead reckoning by how the phone is carried and what its sensors are like."""
    print("| phone | " + " | ".join(COLUMNS) + " |")
    for name, change in CARRIED.items():
        logs = [change(walk.log) for walk in walks]
        changed = [
            Walk(log, sensed, walk.taps)
            for walk, log in zip(walks, logs, strict=True)
            if (sensed := SensedWalk.of(log)) is not None
        ]
        cells = (
            cell(changed, every, lambda walk, kept: reckoned(walk, kept, speed_model(), area))
            for every in COLUMNS.values()
        )
        print(f"| {name} | " + " | ".join(cells) + " |")


CARRIED: dict[str, Callable[[InertialLog], InertialLog]] = {
    "as recorded: in the hand": lambda log: log,
    "upright": lambda log: held(log, (0, 0, 75)),
    "pocket, turned only": lambda log: held(log, IN_POCKET_DEG),
    "pocket on a thigh": on_thigh,
    "swinging hand": swung,
    "16.7 Hz": lambda log: sampled(log, 3, 0.0),
    "noise of 0.3 m/s^2": lambda log: sampled(log, 1, 0.3),
}


def read_walks(folder: Path) -> tuple[list[Walk], float]:
    """Read the walks of a floor that have two taps or more; also the processor time that one takes, seconds."""
    walks, start = [], time.process_time()
    for path in sorted(folder.glob("path_data_files/*.txt")):
        trace = parse_trace(path.read_bytes(), path.name)
        log = inertial_log(trace.sensors)
        sensed = None if log is None else SensedWalk.of(log)
        if log is not None and sensed is not None and len(trace.taps.time_ns) > 1:
            walks.append(Walk(log, sensed, trace.taps))
    return walks, (time.process_time() - start) / max(len(walks), 1)


def counting_s() -> float:
    """Processor time of a loop that says how quick this machine is just now, seconds: 0.2 to 0.3 s on an idle one."""
    start = time.process_time()
    for _ in range(10_000_000):
        pass
    return time.process_time() - start


def cross_validated(walks: list[Walk]) -> list[SpeedModel]:
    """The model for each walk, learned from the other folds."""
    learned = []
    for fold in range(FOLDS):
        others = [(walk.log, walk.taps) for i, walk in enumerate(walks) if i % FOLDS != fold]
        learned.append(train(carried_walks(others), SETTINGS))
    return [learned[i % FOLDS] for i in range(len(walks))]


def cell(walks: list[Walk], every: int | None, guess: Guess) -> str:
    """Mean and 95th percentile of the error, metres, and the share of hidden taps inside the stated regions."""
    errors, distances = [], []
    for walk in walks:
        for kept in masks(len(walk.taps.time_ns), every):
            position, covariance = guess(walk, kept)
            error = position - walk.taps.position_bcs[~kept]
            errors.append(np.linalg.norm(error, axis=1))
            if covariance is not None:
                distances.append(np.einsum("hi,hij,hj->h", error, np.linalg.inv(covariance), error))
    all_errors = np.concatenate(errors)
    text = f"{all_errors.mean():.2f} / {np.percentile(all_errors, 95):.2f}"
    for name, limit in INSIDE.items() if distances else ():
        text += f"; {name}: {np.mean(np.concatenate(distances) < limit):.0%}"
    return text


def masks(count: int, every: int | None) -> Iterator[BoolArray]:
    """Taps that are kept (k,): all but each inner one in turn, or every so many and both ends."""
    if every is None:
        yield from (np.arange(count) != hidden for hidden in range(1, count - 1))
        return
    kept = np.arange(count) % every == 0 if every else np.zeros(count, dtype=bool)
    kept[[0, -1]] = True
    if not kept.all():
        yield kept


def between(taps: FixLog, kept: BoolArray, path: FloatArray) -> FloatArray:
    """A path's positions (k, 2) at the hidden taps, its errors at the kept ones spread over the time between them."""
    at_s = (taps.time_ns - taps.time_ns[0]) * 1e-9
    error = taps.position_bcs[kept] - path[kept]
    spread = [np.interp(at_s[~kept], at_s[kept], error[:, axis]) for axis in (0, 1)]
    return np.asarray(path[~kept] + np.column_stack(spread))


def reckoned(
    walk: Walk, kept: BoolArray, model: SpeedModel, area: WalkableArea | None
) -> tuple[FloatArray, FloatArray]:
    """Positions and covariances at the hidden taps by the path through the kept ones."""
    fixes = FixLog(walk.taps.time_ns[kept], walk.taps.position_bcs[kept], ("",) * int(kept.sum()))
    signals = walk.sensed.signals
    hidden_s = (walk.taps.time_ns[~kept] - signals.start_ns) * 1e-9
    return walk.sensed.path(fixes, model, SETTINGS, area).at(np.clip(hidden_s, 0, signals.time_s[-1]))


def step_path(log: InertialLog, taps: FixLog) -> FloatArray:
    """Positions (k, 2) at the taps by the organisers' step model, from the start of the walk."""
    strength = np.linalg.norm(log.force, axis=1)
    low, high = butter(4, 2 / 25)
    smooth = lfilter(low, high, np.concatenate((np.full(200, 9.81), strength)))[200:]
    window = np.lib.stride_tricks.sliding_window_view(np.concatenate((np.zeros(21), smooth)), 22)
    spread, off = window.std(axis=1), smooth - window.mean(axis=1)
    least = np.maximum(0.6, 0.4 * spread)
    before = np.concatenate(([0.0], off[:-1]))
    rising, falling = off > np.maximum(before, least), off < np.minimum(before, -least)
    peaks = np.flatnonzero(rising[:-1] & ~rising[1:] & ~falling[1:]) + 1
    valleys = np.flatnonzero(falling[:-1] & ~falling[1:] & ~rising[1:]) + 1
    steps: list[tuple[int, int]] = []
    for valley in valleys.tolist():
        earlier = peaks[(peaks < valley) & (peaks > (steps[-1][1] if steps else -1))]
        if len(earlier) and (not steps or log.force_ns[valley] - log.force_ns[steps[-1][1]] > 250_000_000):
            steps.append((int(earlier[np.argmax(smooth[earlier])]), valley))
    if len(steps) < 2:
        return np.zeros_like(taps.position_bcs)
    peak, valley_at = np.array(steps).T
    period = np.diff(log.force_ns[valley_at]) * 1e-9
    period = np.concatenate((period[:1], (period[1:] + period[:-1]) / 2))
    factor = (0.21468084 + 0.09154517 / period + 0.02301998 * spread[valley_at[:-1]] ** 2).clip(*STRIDE_RANGE)
    stride = np.maximum(smooth[peak] - smooth[valley_at], 1.0) ** 0.25 * np.concatenate(([0.4], factor))
    turned = Rotation.from_quat(log.orientation).as_matrix()
    heading = np.unwrap(np.arctan2(turned[:, 1, 1], turned[:, 0, 1]))
    since = log.force_ns[valley_at] - log.force_ns[0]
    course = np.interp(since, log.orientation_ns - log.force_ns[0], heading)
    path = np.cumsum(stride[:, None] * np.column_stack((np.cos(course), np.sin(course))), axis=0)
    moments = np.concatenate(((since[0] - 500_000_000,), since))
    tapped = taps.time_ns - log.force_ns[0]
    return np.column_stack([np.interp(tapped, moments, np.concatenate(([0.0], axis))) for axis in path.T])


if __name__ == "__main__":
    main()
