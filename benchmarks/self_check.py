"""Accuracy of the check without ground truth, and what one more landmark brings.

Usage: python benchmarks/self_check.py [--seeds 53 54] [--severity none mild default severe] [--jobs 2] [--csv FILE]

Each landmark of each walk is left out and predicted. The mean error of labels estimated from this is compared with the
true one. A left-out landmark is also one that could be added: the gain map's prediction for its place is compared with
the real gain.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from data_sets import Walk, generated, real_walks
from scipy.stats import spearmanr

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.fault_detection import discrepancy, predicted
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.settings import SmootherSettings
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk
from vislam2tag.quality.landmark_gain import CELL_M, gains, positions_each_metre
from vislam2tag.quality.self_check import Estimate, LeftOut, error_factor, estimate_accuracy, leave_out

RANGE_M = SmootherSettings().sighting_range_m
LIMITS_M = (0.5, float("inf"))


@dataclass(frozen=True)
class Row:
    """One walk at one limit of sigma; metres."""

    group: str
    walk: str
    max_sigma_m: float
    true_m: float
    stated_m: float
    estimated_m: float
    low_m: float
    high_m: float
    solved_again_m: float
    """As estimated from left-out landmarks with the noise levels and weights that were found with them."""
    checked: int


@dataclass(frozen=True)
class Gain:
    """One landmark put back into one walk: by how much the mean error falls, metres."""

    group: str
    landmark: str
    """Seed, floor and id."""
    promised_m: float
    brought_m: float


def main() -> None:
    """Check all walks and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[53, 54])
    parser.add_argument("--severity", nargs="+", default=["none", "mild", "default", "severe"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args()
    sources = [(severity, seed) for severity in options.severity for seed in options.seeds]
    with ProcessPoolExecutor(options.jobs) as pool:
        parts = list(pool.map(_checked, sources))
    rows = [row for part in parts for row in part[0]]
    for limit in LIMITS_M:
        print(f"\n## Labels with a sigma of at most {limit} m\n")
        _print_accuracy([row for row in rows if row.max_sigma_m == limit], options.severity)
    _print_gains([gain for part in parts for gain in part[1]], options.severity)
    print("\n## Real walks, labels at the true points\n")
    print("| walk | true | stated | estimated | interval | landmarks |")
    print("| --- | --- | --- | --- | --- | --- |")
    real = [row for walk in real_walks() for row in _rows("real", walk) if row.max_sigma_m == LIMITS_M[-1]]
    for row in real:
        print(
            f"| {row.walk} | {row.true_m:.3f} m | {row.stated_m:.3f} m | {row.estimated_m:.3f} m | "
            f"{row.low_m:.3f} to {row.high_m:.3f} m | {row.checked} |"
        )
    if options.csv:
        _write(options.csv, [*rows, *real])


def _checked(source: tuple[str, int]) -> tuple[list[Row], list[Gain]]:
    severity, seed = source
    rows: list[Row] = []
    found: list[Gain] = []
    for walk in generated([seed], severity):
        rows += _rows(severity, walk)
        found += _gains(severity, f"{seed} {walk.name.split('.')[0]}", walk)
    return rows, found


def _smoothed(walk: Walk) -> SolvedWalk | None:
    observations = WalkObservations.of(walk.camera, walk.log, RANGE_M)
    return solve_walk(observations, LandmarkPriors.of(walk.log.ids, walk.landmarks))


def _rows(group: str, walk: Walk) -> Iterator[Row]:
    smoothed = _smoothed(walk)
    if smoothed is None:
        return
    left_out = leave_out(smoothed)
    again = [_solved_again(smoothed, error) for error in left_out]
    position, covariance, _ = mapped_path(smoothed)
    errors = _errors(walk, smoothed, position)
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    for limit in LIMITS_M:
        kept = sigma_m <= limit
        estimate, other = estimate_accuracy(covariance[kept], left_out), estimate_accuracy(covariance[kept], again)
        true_m = float(np.nanmean(errors[kept])) if walk.truth_at_frames and kept.any() else float(np.nanmean(errors))
        if estimate is not None and other is not None:
            yield _row(group, walk, limit, true_m, estimate, other)


def _row(group: str, walk: Walk, limit: float, true_m: float, estimate: Estimate, again: Estimate) -> Row:
    kept = {name: value for name, value in asdict(estimate).items() if name in Row.__dataclass_fields__}
    return Row(group, walk.name, limit, true_m, solved_again_m=again.estimated_m, **kept)


def _solved_again(smoothed: SolvedWalk, error: LeftOut) -> LeftOut:
    landmark = smoothed.model.observations.ids.index(error.landmark)
    offset, covariance = discrepancy(smoothed, predicted(smoothed, landmark), landmark)
    return replace(error, offset_m=offset, covariance_m2=covariance)


def _errors(walk: Walk, smoothed: SolvedWalk, position: FloatArray) -> FloatArray:
    """Errors at the odometry's frames, or at the true points where there are only some; metres."""
    camera, frame = walk.camera, smoothed.model.observations.odometry.frame
    place = np.full((len(camera.time_ns), 3), np.nan)
    place[frame, :2] = position
    status = camera.status.copy()
    status[np.setdiff1d(np.flatnonzero(camera.usable), frame)] = Status.NO_MAPPING
    unknown = np.full((len(place), 4), np.nan)
    trajectory = Trajectory(camera.time_ns, place, unknown, np.full((len(place), 2, 2), np.nan), status)
    errors = walk.errors(trajectory)
    return errors[frame] if walk.truth_at_frames else errors


def _gains(group: str, place: str, walk: Walk) -> Iterator[Gain]:
    """Leave out every landmark in turn and put it back."""
    smoothed = _smoothed(walk)
    if smoothed is None:
        return
    observations, priors = smoothed.model.observations, smoothed.priors
    factor = error_factor(leave_out(smoothed))
    with_all = float(np.nanmean(_errors(walk, smoothed, mapped_path(smoothed)[0])))
    for landmark in np.intersect1d(np.flatnonzero(priors.surveyed), observations.passes.landmark).tolist():
        trial = solve_walk(observations, priors.without(landmark))
        if trial is None:
            continue
        positions = positions_each_metre(trial)
        found = gains(trial, positions, np.zeros(len(positions.at), dtype=np.int64))
        x, y = np.floor(as_points(priors.position[landmark]) / CELL_M).astype(np.int64).tolist()
        if (gain_m := found.get((0, x, y))) is not None:
            without = float(np.nanmean(_errors(walk, trial, mapped_path(trial)[0])))
            promised = factor * gain_m / len(trial.model.path)
            yield Gain(group, f"{place} {observations.ids[landmark]}", promised, without - with_all)


def _print_accuracy(rows: Sequence[Row], groups: Iterable[str]) -> None:
    print("| severity | walks | value | rank correlation | ratio to the true one | off by a factor of | within 1.5 |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for group in (*groups, "all"):
        part = [row for row in rows if group in (row.group, "all")]
        for name in ("stated", "solved_again", "estimated"):
            print(_line(group, part, name))
    inside = np.mean([row.low_m <= row.true_m <= row.high_m for row in rows])
    print(f"\n| interval | contains the true error of |\n| --- | --- |\n| 90 % | {inside:.0%} |")


def _line(group: str, rows: Sequence[Row], name: str) -> str:
    value, true = np.array([getattr(row, f"{name}_m") for row in rows]), np.array([row.true_m for row in rows])
    logarithm = np.log(value / true)
    factor = np.exp(np.abs(logarithm).mean())
    return (
        f"| {group} | {len(rows)} | {name.replace('_', ' ')} | {spearmanr(value, true).statistic:.2f} | "
        f"{np.exp(logarithm.mean()):.2f} | {factor:.2f} | {np.mean(np.abs(logarithm) < np.log(1.5)):.0%} |"
    )


def _print_gains(found: Sequence[Gain], groups: Iterable[str]) -> None:
    print("\n## One more landmark: fall of a walk's mean error, promised and brought\n")
    print("| severity | landmarks | walks | promised | brought | rank correlation of sums over a floor's walks |")
    print("| --- | --- | --- | --- | --- | --- |")
    for group in (*groups, "all"):
        part = [gain for gain in found if group in (gain.group, "all")]
        sums: dict[tuple[str, str], FloatArray] = defaultdict(lambda: np.zeros(2))
        for gain in part:
            sums[gain.group, gain.landmark] += gain.promised_m, gain.brought_m
        promised, brought = np.sum(list(sums.values()), axis=0) / len(part)
        rank = spearmanr(*np.array(list(sums.values())).T).statistic
        print(f"| {group} | {len(sums)} | {len(part)} | {promised:.3f} m | {brought:.3f} m | {rank:.2f} |")


def _write(path: Path, rows: Sequence[Row]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(Row.__dataclass_fields__))
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


if __name__ == "__main__":
    main()
