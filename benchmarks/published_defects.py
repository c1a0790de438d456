"""What named defects of the published program cause, put back one at a time into mapping that is otherwise ours.

- rotation: a reflected covariance gets the rotation ``U S V`` instead of ``U S V'`` (its V is transposed already)
- one-frame visit: a landmark's visits end before its first run of a single frame
- last frame: a visit's minimum is looked for without the run's last frame
- crash: a logged landmark is never visited, or a landmark is known from the first frame on

Frames are compared with ours; errors are means over the frames (real walks: true points) of the walks affected that
are labelled both ways.

    python benchmarks/published_defects.py
    python benchmarks/published_defects.py --seeds 21 22
"""

from __future__ import annotations

import argparse
import math
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from crafted_walks import crafted_walks
from data_sets import Walk, agreement, generated, real_walks

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Trajectory, Visit
from vislam2tag.core.visits import find_visits, frames_without_landmark, usable_rank
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.mapping.strategies.global_ import GlobalMapping
from vislam2tag.mapping.strategies.local import LocalMapping
from vislam2tag.mapping.trajectory_builder import surveyed_rows

RADIUS_M = MappingSettings().visit_radius_m
MOVED_M = 0.001
LOCAL = {
    "local": LocalMapping(RADIUS_M, math.inf, discards=False),
    "local-corrected": LocalMapping(RADIUS_M, MappingSettings().max_step_m, discards=True),
}


class WronglyRotated(Similarity2):
    """Umeyama's similarity with the published program's rotation."""

    @classmethod
    def fit(cls, source: FloatArray, target: FloatArray) -> Similarity2:
        """Rotate by ``U S V`` where the covariance is reflected."""
        right = Similarity2.fit(source, target)
        from_mean, to_mean = source.mean(axis=0), target.mean(axis=0)
        covariance = (target - to_mean).T @ (source - from_mean) / len(source)
        if np.linalg.det(covariance) >= 0:
            return right
        u, _, v_transposed = np.linalg.svd(covariance)
        rotation = u @ np.diag([1.0, -1.0]) @ v_transposed.T
        a = right.scale * complex(rotation[0, 0], rotation[1, 0])
        return Similarity2(a, complex(*to_mean) - a * complex(*from_mean))


def runs_near(camera: CameraTrack, log: LandmarkLog) -> Iterator[tuple[str, list[list[int]]]]:
    """Rows of each landmark's runs of neighbouring frames within the visit radius."""
    rank = usable_rank(camera)
    distance = np.linalg.norm(camera.position_acs[log.frame] - log.position_acs, axis=1)
    near = (distance < RADIUS_M) & ~log.lost
    for index, name in enumerate(log.ids):
        rows = log.rows_of(index).start + np.flatnonzero(near[log.rows_of(index)])
        runs = np.split(rows, np.flatnonzero(np.diff(rank[log.frame[rows]]) != 1) + 1)
        yield name, [run.tolist() for run in runs if len(run)]


def defective_visits(
    camera: CameraTrack, log: LandmarkLog, *, ends_at_single: bool = False, skips_last: bool = False
) -> tuple[Visit, ...]:
    """Find visits with one of the published program's faults."""
    distance = np.linalg.norm(camera.position_acs[log.frame] - log.position_acs, axis=1)
    visits = []
    for name, runs in runs_near(camera, log):
        for run in runs:
            if ends_at_single and len(run) == 1:
                break
            searched = run[:-1] if skips_last and len(run) > 1 else run
            row = min(searched, key=lambda row: float(distance[row]))
            visits.append(Visit(int(log.frame[row]), name, float(distance[row])))
    return tuple(sorted(visits, key=lambda visit: visit.frame))


def defective_trajectories(walk: Walk) -> Iterator[tuple[str, str, Trajectory]]:
    """Map a walk by each strategy with each defect that concerns it: strategy, defect, trajectory."""
    rotated = GlobalMapping(WronglyRotated, RADIUS_M)
    yield "global", "rotation", rotated.map(walk.camera, walk.log, walk.landmarks)
    surveyed = surveyed_rows(walk.log, walk.landmarks)
    visits = {
        "one-frame visit": defective_visits(walk.camera, surveyed, ends_at_single=True),
        "last frame": defective_visits(walk.camera, surveyed, skips_last=True),
    }
    for defect, found in visits.items():
        for name, strategy in LOCAL.items():
            yield name, defect, strategy.map_between(found, walk.camera, walk.log, walk.landmarks)


def crash_cause(walk: Walk) -> str | None:
    """Say why the published program stops with an error on this walk; None where it does not."""
    surveyed = surveyed_rows(walk.log, walk.landmarks)
    if {visit.landmark for visit in find_visits(walk.camera, surveyed, RADIUS_M)} != set(surveyed.ids):
        return "a landmark is logged but never visited"
    first = np.flatnonzero(walk.camera.usable)[:1]
    if not frames_without_landmark(walk.camera, walk.log)[first].all():
        return "a landmark is known from the first frame on"
    return None


@dataclass
class Effect:
    """Sums over the walks of a data set."""

    walks: int = 0
    affected: int = 0
    lost: int = 0
    gained: int = 0
    moved: int = 0
    farthest_m: float = 0.0
    errors: list[tuple[float, float]] | None = None

    def add(self, walk: Walk, ours: Trajectory, theirs: Trajectory) -> None:
        """Count the frames that differ, and the errors where any does."""
        mapped, mapped_by_them = has_position(ours.status), has_position(theirs.status)
        apart = np.linalg.norm(ours.position_bcs[:, :2] - theirs.position_bcs[:, :2], axis=1)
        moved = apart > MOVED_M
        lost, gained = mapped & ~mapped_by_them, mapped_by_them & ~mapped
        self.walks += 1
        if not (moved | lost | gained).any():
            return
        self.affected += 1
        self.lost += int(lost.sum())
        self.gained += int(gained.sum())
        self.moved += int(moved.sum())
        self.farthest_m = max(self.farthest_m, float(np.nanmax(apart, initial=0.0)))
        errors = np.column_stack((walk.errors(ours), walk.errors(theirs)))
        both = errors[np.isfinite(errors).all(axis=1)]
        if len(both):
            self.errors = [*(self.errors or []), (float(both[:, 0].mean()), float(both[:, 1].mean()))]

    def cells(self) -> str:
        """Figures of one row."""
        figures = (
            f"{self.affected} of {self.walks} | {self.lost} | {self.gained} | {self.moved} | {self.farthest_m:.2f}"
        )
        if self.errors is None:
            return f"{figures} | – | –"
        ours, theirs = np.mean(self.errors, axis=0)
        return f"{figures} | {ours:.2f} | {theirs:.2f}"


def main() -> None:
    """Compare with and without each defect on each data set and print the tables as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 9)))
    seeds = parser.parse_args().seeds
    data_sets = {
        "agreement": agreement(),
        "crafted": crafted_walks(),
        "generated": generated(seeds),
        "real": real_walks(),
    }
    effects: dict[tuple[str, str, str], Effect] = defaultdict(Effect)
    crashes: dict[str, Counter[str | None]] = defaultdict(Counter)
    for data, walks in data_sets.items():
        for walk in walks:
            crashes[data][crash_cause(walk)] += 1
            for strategy, defect, theirs in defective_trajectories(walk):
                ours = strategy_named(strategy, MappingSettings()).map(walk.camera, walk.log, walk.landmarks)
                effects[defect, data, strategy].add(walk, ours, theirs)
    print_table(effects)
    for data, causes in crashes.items():
        stopped = ", ".join(f"{count} ({cause})" for cause, count in causes.items() if cause) or "none"
        print(f"{data}: of {causes.total()} walks the published program would stop with an error on: {stopped}")


def print_table(effects: dict[tuple[str, str, str], Effect]) -> None:
    """Print a row for each defect, data set and strategy as Markdown."""
    heads = (
        "defect",
        "data",
        "strategy",
        "walks affected",
        "frames lost",
        "gained",
        "moved",
        "farthest",
        "error",
        "theirs",
    )
    print(f"| {' | '.join(heads)} |")
    print("| --- " * len(heads) + "|")
    for (defect, data, strategy), effect in sorted(effects.items()):
        print(f"| {defect} | {data} | {strategy} | {effect.cells()} |")
    print()


if __name__ == "__main__":
    main()
