"""How exactly `attach` finds the clock of a second device, on recordings cut in two halves that share no sample.

`python benchmarks/clock_ties.py [TRACES...]`: folders or archives with traces of the Indoor Location Competition 2.0,
whose walks are real; without any, walks of the simulator alone. Every second sample stays the walk's own; of the others
a second device is made: carried up to half a metre away (its acceleration is that of a point so far off on the same
rigid body), turned, with a bias, a scale and noise of its own, sampled at 40 Hz by a clock that is off by up to 50 ppm.
Five such devices a walk; walks too short to be tied are left out. The error is the largest anywhere on the walk. What
it does not hold: two bodies that move against each other, as hand and pocket do.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl
from scipy.spatial.transform import Rotation

from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import LEAST_OVERLAP_S, ClockAlignment, align_by_motion
from vislam2tag.sessions.companions.clocks import by_acceleration
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.tables.ilc20_trace import parse_trace
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate

RATE_HZ, GREATEST_DRIFT, FARTHEST_M = 40.0, 5e-5, 0.5
FORCE_NOISE, TURN_NOISE = 0.3, 0.05
"""Of the second device, m/s2 and rad/s."""
SEEDS, WALK_S, DRAWS = 10, 120.0, 5
Sample = tuple[IntArray, FloatArray]
"""Times (n,), ns, and values (n, 3)."""


def samples_of(sensors: pl.DataFrame, sensor: str) -> Sample:
    """Times and values of a sensor's readings, sorted."""
    rows = sensors.filter((pl.col("sensor") == sensor) & ~pl.col("repeated")).unique("time_ns").sort("time_ns")
    return rows["time_ns"].to_numpy(), rows.select("v1", "v2", "v3").to_numpy()


def halves(sample: Sample) -> tuple[Sample, Sample]:
    """Every second sample, and the others."""
    time_ns, values = sample
    return (time_ns[::2], values[::2]), (time_ns[1::2], values[1::2])


def at(sample: Sample, time_ns: FloatArray) -> FloatArray:
    """Values (m, 3) between those of a sample."""
    return np.column_stack([np.interp(time_ns, sample[0], axis) for axis in sample[1].T])


def second_device(force: Sample, turn: Sample, rng: np.random.Generator) -> tuple[FloatArray, IntArray, Sample, Sample]:
    """When it sampled on the walk's clock, its stamps, and its two sensors."""
    start, end = max(force[0][0], turn[0][0]) + 3e9, min(force[0][-1], turn[0][-1]) - 3e9
    taken_ns = np.arange(start + rng.uniform(0, 2e7), end, 1e9 / RATE_HZ)
    stamps = np.round(taken_ns * (1 + rng.uniform(-1, 1) * GREATEST_DRIFT) + rng.uniform(-1e12, 1e12)).astype(np.int64)
    rate = at(turn, taken_ns)
    arm = rng.normal(size=3)
    arm *= rng.uniform(0.1, FARTHEST_M) / np.linalg.norm(arm)
    turning = np.gradient(rate, taken_ns * 1e-9, axis=0)
    felt = at(force, taken_ns) + np.cross(turning, arm) + np.cross(rate, np.cross(rate, arm))
    mounted = Rotation.random(random_state=int(rng.integers(2**31)))
    scale, bias = 1 + 0.01 * rng.normal(size=(2, 3)), rng.normal(size=(2, 3)) * ((0.1,), (0.01,))
    felt = mounted.apply(felt) * scale[0] + bias[0] + rng.normal(0, FORCE_NOISE, felt.shape)
    rate = mounted.apply(rate) * scale[1] + bias[1] + rng.normal(0, TURN_NOISE, rate.shape)
    return taken_ns, stamps, (stamps, felt), (stamps, rate)


def aligned(theirs: Sample, ours: Sample) -> ClockAlignment:
    """By the norms of what both felt."""
    return align_by_motion(theirs[0], np.linalg.norm(theirs[1], axis=1), ours[0], np.linalg.norm(ours[1], axis=1))


def real_walks(paths: list[Path]) -> Iterator[pl.DataFrame]:
    """Sensors of each trace."""
    for path in paths:
        with scratch_folder() as scratch:
            for file in sorted(folder_of(path, scratch).rglob("path_data_files/*.txt")):
                yield parse_trace(file.read_bytes(), file.name).sensors


def simulated_walks() -> Iterator[pl.DataFrame]:
    """Sensors of generated walks, a survey of two for each seed."""
    for seed in range(SEEDS):
        with scratch_folder() as scratch:
            survey = scratch / "survey"
            simulate(regular_survey(seed, "none", (0,), ("LG", "OnePlus"), 1, WALK_S), survey, WritingOptions())
            for ref in open_survey(survey).sessions:
                yield read_session(ref).tables["sensors"]


def table(name: str, walks: Iterator[pl.DataFrame]) -> list[str]:
    """Lines of the table for one set of walks."""
    errors: dict[str, list[float]] = {"turns": [], "accelerations": [], "as attach does": []}
    within: dict[str, list[bool]] = {way: [] for way in errors}
    count = 0
    for number, sensors in enumerate(walks):
        (own_force, force), (own_turn, turn) = (halves(samples_of(sensors, sensor)) for sensor in ("ACC", "GYRO"))
        if len(force[0]) < 2 or (force[0][-1] - force[0][0]) * 1e-9 < LEAST_OVERLAP_S + 7:
            continue  # refused in any case
        for draw in range(DRAWS):
            count += 1
            rng = np.random.default_rng((number, draw))
            taken_ns, stamps, their_force, their_turn = second_device(force, turn, rng)
            by_turns, by_force = aligned(their_turn, own_turn), by_acceleration(aligned(their_force, own_force))
            first = by_turns if by_turns.offset_ns is not None else by_force
            for way, found in zip(errors, (by_turns, by_force, first), strict=True):
                if found.offset_ns is not None:
                    error_s = float(np.abs(found.ours(stamps) - taken_ns).max()) * 1e-9
                    errors[way].append(error_s)
                    within[way].append(error_s <= 2 * found.sigma_s)
    lines = []
    for way, found_s in errors.items():
        ms = np.array(found_s) * 1e3
        figures = f"{np.median(ms):.1f} | {np.percentile(ms, 95):.1f} | {ms.max():.1f}" if len(ms) else "- | - | -"
        share = f"{100 * np.mean(within[way]):.0f} %" if within[way] else "-"
        lines.append(f"| {name} | {way} | {count} | {count - len(ms)} | {figures} | {share} |")
    return lines


def main() -> None:
    """Print the table."""
    print("| walks | by | pairs | refused | median, ms | 95th percentile, ms | greatest, ms | within two sigma |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for line in table("simulated", simulated_walks()):
        print(line, flush=True)
    for path in map(Path, sys.argv[1:]):
        for line in table(path.name.partition(".")[0], real_walks([path])):
            print(line, flush=True)


if __name__ == "__main__":
    main()
