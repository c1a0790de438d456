"""The least error that any estimator without truth can have on generated walks, beside what the strategies have.

The estimator here is told what nobody knows: every noise level of the session, all faults (nothing but drift and
sighting errors is left), the pose lag, and the true path to linearise about. Then drift and sightings are jointly
normal, and the spread of what stays unknown is a matter of linear algebra; its mean length is the floor. It takes

- one observation each time that a sheet is in view without a pause, at the nearest approach: the simulator draws the
  error of sightings anew each time; or
- frames all over the pass, and knows the simulator's law: that error is one vector times (1 + distance / 1 m) / 2.

    python benchmarks/best_possible.py                          96 walks at default severity (ratios in brackets)
    python benchmarks/best_possible.py --seeds 1 --severity severe
    python benchmarks/best_possible.py --scatter                whether real sightings follow that law
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from data_sets import Walk, agreement, generated, walks_of
from scipy.special import ellipe

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.simulation.scenario import PlannedSession, Scenario, regular_survey
from vislam2tag.simulation.settings import SEVERITIES, TrackerSettings, stream
from vislam2tag.simulation.survey import simulate, simulated_floor
from vislam2tag.simulation.tracking.dead_reckoning import RUNNING_M_S, CameraFrames, dead_reckon, expose
from vislam2tag.simulation.tracking.faults import fault_level, plan_faults
from vislam2tag.simulation.tracking.sightings import Sightings, sight
from vislam2tag.simulation.tracking.tracker import of_rank
from vislam2tag.simulation.walking.walk import make_walk
from vislam2tag.smoother.observations import WalkObservations
from vislam2tag.smoother.settings import SmootherSettings
from vislam2tag.survey.names import session_slugs

OURS, THEIRS = "smoother", "local-corrected"
EVERY = 15
"""Drift is summed over this many frames (half a second)."""
FRAMES_A_PASS = 16
"""Many enough to tell how the error of a pass grows."""
MANY = 10
"""Sightings of a pass whose scatter means something."""
PLACE_SIGMA_M, HEADING_SIGMA_RAD = 10.0, 0.3
"""Where the walk starts, and how it is turned, is not known."""


@dataclass(frozen=True)
class Known:
    """What the estimator is told of one walk."""

    frames: CameraFrames
    sightings: Sightings
    landmarks: ComplexArray
    settings: TrackerSettings


def known(scenario: Scenario, planned: PlannedSession) -> Known:
    """Draw the frames and sightings of a session again, as its simulation did."""
    floor = simulated_floor(scenario, planned.key.floor)
    drawn = stream(scenario.seed, "walk", planned.key)
    walk = make_walk(floor, planned.duration_s, planned.walk, drawn, planned.start_ns, None)
    rng = stream(scenario.seed, "tracker", planned.key)
    settings = of_rank(planned.tracker, planned.fault_quantile)
    frames = expose(walk, settings, rng)
    dead_reckon(frames, settings, rng)
    faults = plan_faults(frames, settings, planned.fault_quantile, rng)
    sightings = sight(frames, floor, faults.lost_frames(len(frames.plane)), settings, rng)
    place = floor.landmark_position[:, 0] + 1j * floor.landmark_position[:, 1]
    return Known(frames, sightings, place, settings)


def unit_noises(at: IntArray, told: Known) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Linear maps from independent unit noises to position (2 k, u), scale and heading errors (k, u) at frames (k,)."""
    settings, frames = told.settings, told.frames
    way_m, position, heading = _drift(told)
    summed = [np.add.reduceat(values, at[:-1] + 1) for values in (position, heading)]
    path, count = frames.plane[at], len(at)
    keep = np.exp(-np.diff(np.concatenate(([0.0], np.cumsum(way_m)))[at]) / settings.scale_length_m)
    scale = settings.severity * settings.scale_sigma * _remembered(keep)
    turn = np.hstack((np.full((count, 1), HEADING_SIGMA_RAD), _so_far(np.sqrt(summed[1]))))
    step = np.diff(path)
    bend = np.vstack((np.zeros(turn.shape[1]), np.cumsum(1j * step[:, None] * (turn[1:] + turn[:-1]) / 2, axis=0)))
    stretch = np.vstack((np.zeros(count), np.cumsum(step[:, None] * (scale[1:] + scale[:-1]) / 2, axis=0)))
    slip = np.hstack((np.full((count, 1), PLACE_SIGMA_M), _so_far(np.sqrt(summed[0]))))
    place = np.hstack((slip + 0j, 1j * slip, bend, stretch))
    nothing = np.zeros((count, 2 * slip.shape[1]))
    turned = np.hstack((nothing, turn, np.zeros_like(scale)))
    scaled = np.hstack((nothing, np.zeros_like(turn), scale))
    return np.stack((place.real, place.imag), axis=1).reshape(2 * count, -1), scaled, turned


def _drift(told: Known) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Way (f,) and variances (f,) of position, per axis, and of heading that each frame adds."""
    settings, frames = told.settings, told.frames
    way_m = frames.speed / settings.frame_rate_hz
    effort = settings.severity * np.where(frames.speed > RUNNING_M_S, settings.running_factor, 1.0)
    yaw = np.unwrap(np.arctan2(frames.looking[:, 1], frames.looking[:, 0]))
    turned = np.abs(np.diff(yaw, prepend=yaw[0]))
    heading = settings.heading_drift_rad**2 * way_m + settings.turning_drift**2 * turned
    return way_m, effort**2 * settings.position_drift_m**2 * way_m, effort**2 * heading


def _so_far(sigma: FloatArray) -> FloatArray:
    """Map (k + 1, k) of unit noises to their running sum."""
    return np.tril(np.ones((len(sigma) + 1, len(sigma))), -1) * sigma


def _remembered(keep: FloatArray) -> FloatArray:
    """Map (k, k) of unit noises to a stationary value that keeps this share (k - 1,) from each time to the next."""
    rows = [np.eye(1, len(keep) + 1)[0]]
    for number, share in enumerate(keep.tolist(), start=1):
        rows.append(share * rows[-1])
        rows[-1][number] = np.sqrt(1 - share**2)
    return np.array(rows)


def seen(told: Known, *, law: bool) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """Observations: pass and landmark (s,), frame (s,), and by how much the error of the pass has grown there (s,)."""
    rows = []
    for number, (landmark, start, stop) in enumerate(told.sightings.passes.tolist()):
        span = np.arange(start, stop)
        away = np.abs(told.landmarks[landmark] - told.frames.plane[span])
        chosen = np.linspace(0, len(span) - 1, FRAMES_A_PASS).astype(np.int64) if law else [int(np.argmin(away))]
        rows += [(number, landmark, int(span[i]), 0.5 + 0.5 * float(away[i])) for i in sorted(set(chosen))]
    table = np.array(rows).reshape(-1, 4)
    number, landmark, frame = table[:, :3].astype(np.int64).T
    return number, landmark, frame, table[:, 3]


def floor_m(told: Known, *, law: bool) -> FloatArray:
    """Mean error (f,) at each frame of the best estimator, metres."""
    count, settings = len(told.frames.plane), told.settings
    number, landmark, frame, growth = seen(told, law=law)
    at = np.unique(np.concatenate((np.arange(0, count, EVERY), [count - 1], frame)))
    place, scaled, turned = unit_noises(at, told)
    row = np.searchsorted(at, frame)
    offset = told.landmarks[landmark] - told.frames.plane[frame]
    sight_x = place[2 * row] + offset.real[:, None] * scaled[row] - offset.imag[:, None] * turned[row]
    sight_y = place[2 * row + 1] + offset.imag[:, None] * scaled[row] + offset.real[:, None] * turned[row]
    same_pass, same_sheet = (which[:, None] == which for which in (number, landmark))
    grown = same_pass * np.outer(growth, growth)
    white = np.diag((settings.sighting_noise_m * (2 * growth - 1)) ** 2)  # with the distance
    bias = (settings.severity * settings.sighting_bias_m) ** 2 * grown + white
    sheet = (settings.severity * settings.sighting_heading_sigma_rad) ** 2 * grown + same_sheet * np.pi**2
    told_by = np.vstack((sight_x, sight_y, turned[row]))
    nothing = np.zeros_like(bias)
    noise = np.block([[bias, nothing, nothing], [nothing, bias, nothing], [nothing, nothing, sheet]])
    noise += 1e-8 * np.eye(len(noise))
    gain = np.linalg.solve(told_by @ told_by.T + noise, told_by)
    unknown = place - (place @ told_by.T) @ gain
    pairs, left = place.reshape(len(at), 2, -1), unknown.reshape(len(at), 2, -1)
    return np.asarray(np.interp(np.arange(count), at, mean_length(np.einsum("kiu,kju->kij", left, pairs))))


def mean_length(covariance: FloatArray) -> FloatArray:
    """Mean length (k,) of normal vectors in the plane with these covariances (k, 2, 2)."""
    least, most = np.maximum(np.linalg.eigvalsh(covariance), 1e-12).T
    return np.asarray(np.sqrt(2 * most / np.pi) * ellipe(1 - least / most))


def errors_of(scenario: Scenario) -> Iterator[tuple[bool, tuple[float, ...]]]:
    """For each walk whether it has faults, and mean errors on the frames that both strategies label.

    Theirs, ours, and the two floors, in metres.
    """
    planned = dict(zip(session_slugs([one.key for one in scenario.sessions]), scenario.sessions, strict=True))
    strategies = [strategy_named(name, MappingSettings()) for name in (THEIRS, OURS)]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(scenario, root)
        for walk in walks_of(root, truth_at_frames=True):
            theirs, ours = (walk.errors(one.map(walk.camera, walk.log, walk.landmarks)) for one in strategies)
            told = known(scenario, planned[walk.name])
            both = np.isfinite(theirs) & np.isfinite(ours)
            if both.any():
                errors = (theirs, ours, floor_m(told, law=False), floor_m(told, law=True))
                faulty = fault_level(planned[walk.name].fault_quantile, scenario.severity) > 0
                yield faulty, tuple(float(one[both].mean()) for one in errors)


def main() -> None:
    """Print the table of each severity as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 9)))
    parser.add_argument("--severity", nargs="+", choices=list(SEVERITIES), default=["default"])
    parser.add_argument("--scatter", action="store_true", help="only how far sightings of one pass scatter")
    options = parser.parse_args()
    if options.scatter:
        print_scatter("sessions that the published program was run on", agreement())
        print_scatter("generated, default", generated(options.seeds))
        return
    print(f"| severity | | walks | {THEIRS} | {OURS} | floor | floor, law known |")
    print("| --- " * 7 + "|")
    for severity in options.severity:
        scenarios = [regular_survey(seed, severity, sessions=3) for seed in options.seeds]
        found = [row for scenario in scenarios for row in errors_of(scenario)]
        print_rows(severity, "all", [errors for _, errors in found])
        print_rows(severity, "without faults", [errors for faulty, errors in found if not faulty])


def print_scatter(name: str, walks: Iterable[Walk]) -> None:
    """Print how far sightings of one pass lie from their mean, over passes of many sightings."""
    range_m = SmootherSettings().sighting_range_m
    passes = [WalkObservations.of(walk.camera, walk.log, range_m).passes for walk in walks]
    spread_m = np.concatenate([one.spread_m[one.count >= MANY] for one in passes])
    low, middle, high = np.quantile(spread_m, (0.25, 0.5, 0.75))
    print(f"{name}: {middle:.4f} m ({low:.4f} to {high:.4f}) per axis, {len(spread_m)} passes")


def print_rows(severity: str, which: str, errors: list[tuple[float, ...]]) -> None:
    """Print averages over walks, with their ratio to the first of them; nothing where there is no walk."""
    if errors:
        means = np.mean(errors, axis=0).tolist()
        cells = [f"{mean:.3f} ({mean / means[0]:.2f})" for mean in means[1:]]
        print(f"| {severity} | {which} | {len(errors)} | {means[0]:.3f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
