"""Planned landmarks against as many at random places and on a grid, by the true errors of simulated surveys.

Generated floors of several sizes and, where ../shared is at hand, the floor of a mall. Each set of landmarks hangs on
the same walls, is walked past and mapped by the smoother. Also: the errors that ``vislam2tag plan`` expects against the
true ones, by the walking distance to the nearest landmark.

    python benchmarks/landmark_plans.py                        the table of docs/results/planning.md
    python benchmarks/landmark_plans.py --sessions 4 --small   a quick look
"""

from __future__ import annotations

import argparse
import json
import tarfile
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import CameraTrack, Landmarks
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.planning.floor import FloorConstraints, FloorDesign, longest_free_m, plan_floor
from vislam2tag.planning.settings import PlanSettings
from vislam2tag.planning.sheet_places import SheetPlaces
from vislam2tag.planning.sigma_map import CLASS_M
from vislam2tag.simulation.building.site_building import SiteFloor, SiteLandmarks, site_building
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import simulate, walk_and_track
from vislam2tag.simulation.walking.sampling import position_at
from vislam2tag.survey.discover import read_site
from vislam2tag.survey.model import ControlPoints, Floor
from vislam2tag.survey.plans.load import floor_plan
from vislam2tag.survey.plans.source import Extent, PlanSource
from vislam2tag.walkable.graph import corridor_graph
from vislam2tag.walkable.space import WalkableSpace, walkable_space
from vislam2tag.walkable.walked.walking_distances import WalkingDistances

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"
NEAR_M = 0.5
FACTOR = 1.5
BUILDINGS = {
    "45 x 26 m": (11, BuildingSettings(width_m=45, height_m=26, cross_corridors=0, dead_ends=2)),
    "60 x 32 m": (12, BuildingSettings()),
    "60 x 40 m": (13, BuildingSettings(height_m=40, dead_ends=3)),
    "80 x 45 m": (14, BuildingSettings(width_m=80, height_m=45, cross_corridors=2, dead_ends=2)),
    "100 x 60 m": (15, BuildingSettings(width_m=100, height_m=60, cross_corridors=3)),
}
DRAWS = 1
"""Random sets on each floor."""
SIGMA_M = 0.02
MOST_M = 60.0
"""Walks without a landmark are followed so far."""


@dataclass(frozen=True)
class Errors:
    """Errors of all frames (n,) of one survey, metres, NaN without a label; how far each is from a landmark (n,).

    ``session`` (n,) is the walk of each.
    """

    error_m: FloatArray
    away_m: FloatArray
    session: IntArray

    @property
    def measures(self) -> FloatArray:
        """(w, 3) mean error, 95th percentile (NaN where nothing is labelled) and share of frames within 0.5 m."""
        walks = [self.error_m[self.session == number] for number in range(int(self.session.max()) + 1)]
        labelled = [error[np.isfinite(error)] for error in walks]
        return np.array(
            [
                (some.mean(), np.quantile(some, 0.95), np.mean(error <= NEAR_M)) if len(some) else (np.nan, np.nan, 0.0)
                for error, some in zip(walks, labelled, strict=True)
            ]
        )


@dataclass(frozen=True)
class Task:
    """One survey to simulate: a floor with its landmarks."""

    building: str
    kind: str
    floor: SiteFloor
    seed: int
    sessions: int
    severity: str
    longest_m: float
    """Longest walk without a landmark, as the plan sees it."""


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=12)
    parser.add_argument("--severity", default="default")
    parser.add_argument("--small", action="store_true", help="the first two buildings only")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    tasks: list[Task] = []
    designs: dict[str, FloorDesign] = {}
    for name, seed, floor in floors(small=options.small):
        design = plan_floor(floor.space, floor.graph, PlanSettings(further=0), nothing_given())
        designs[name] = design
        count = len(design.place)
        sets = {"planned": [design.place], "grid": [on_a_grid(floor.space, design.places, count)]}
        sets["random"] = [at_random(design.places, count, draw) for draw in range(DRAWS)]
        for kind, choices in sets.items():
            for choice in choices:
                with_marks = replace(floor, landmarks=hung(design.places, choice))
                longest_m = longest(design, choice)
                tasks.append(Task(name, kind, with_marks, seed, options.sessions, options.severity, longest_m))
    with ProcessPoolExecutor(options.jobs) as pool:
        surveyed = list(pool.map(survey, tasks))
    print_comparison(designs, tasks, surveyed)
    print_classes(designs, [(task, errors) for task, errors in zip(tasks, surveyed, strict=True)])


def floors(*, small: bool) -> Iterator[tuple[str, int, SiteFloor]]:
    """Name, seed and walkable floor of each building."""
    for name, (seed, settings) in list(BUILDINGS.items())[: 2 if small else None]:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "survey"
            scenario = regular_survey(seed, floors=(0,), devices=("LG",), sessions=1, duration_s=5.0, building=settings)
            simulate(scenario, root)
            site, _ = read_site(root)
            yield name, seed, walkable(site.floors[0])
    archive = SHARED / "ilc20" / "site2-F4.tar.xz"
    if archive.is_file() and not small:
        yield "mall", 16, mall(archive)


def mall(archive: Path) -> SiteFloor:
    """The floor of a mall, from its GeoJSON."""
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(archive) as content:
            for name in ("floor_info.json", "geojson_map.json"):
                content.extract(f"site2/F4/{name}", folder, filter="data")
        place = Path(folder) / "site2" / "F4"
        size = json.loads((place / "floor_info.json").read_text())["map_info"]
        source = PlanSource(file="geojson_map.json", extent=Extent(width_m=size["width"], height_m=size["height"]))
        nothing = ControlPoints((), np.empty((0, 2)))
        plan = place / "geojson_map.json"
        return walkable(Floor(4, "F4", size["width"], size["height"], 0.0, plan, nothing, source=source))


def walkable(floor: Floor) -> SiteFloor:
    """A floor for the simulator, without landmarks yet."""
    plan = floor_plan(floor)
    space = walkable_space(plan)
    nobody = SiteLandmarks((), np.empty((0, 2)), *(np.empty(0) for _ in range(4)))
    return SiteFloor(floor.number, floor.name, plan.extent_m, 0.0, space, corridor_graph(space), nobody)


def longest(design: FloorDesign, choice: IntArray) -> float:
    """Longest walk without one of the landmarks at these places, metres, at most :data:`MOST_M`."""
    chosen = np.isin(np.arange(len(design.stations.corridor)), design.places.station[choice])
    return longest_free_m(design.corridors, design.stations, chosen, MOST_M / 2)


def nothing_given() -> FloorConstraints:
    """No fixed landmarks, no forbidden walls."""
    return FloorConstraints(np.empty((0, 2)), (), np.empty((0, 4)))


def hung(places: SheetPlaces, choice: IntArray) -> SiteLandmarks:
    """Landmarks at some of the places."""
    chosen = places.take(choice)
    return SiteLandmarks(
        ids=tuple(str(number) for number in range(1, len(choice) + 1)),
        position=chosen.position.round(3),
        z_m=np.full(len(choice), 1.4),
        sigma_m=np.full(len(choice), 0.02),
        heading_rad=np.arctan2(chosen.normal[:, 0], -chosen.normal[:, 1]),
        width_m=np.full(len(choice), np.nan),
    )


def at_random(places: SheetPlaces, count: int, draw: int) -> IntArray:
    """So many of the places, one a station."""
    order = np.random.default_rng(draw).permutation(len(places.station))
    _, first = np.unique(places.station[order], return_index=True)
    return order[np.sort(first)[:count]]


def on_a_grid(space: WalkableSpace, places: SheetPlaces, count: int) -> IntArray:
    """So many places nearest to the crossings of a square grid, as coarse as can be."""
    left, right, low, high = space.area.grid.extent_m
    for pitch in np.arange(40.0, 1.0, -0.1):
        x, y = (np.arange(start + pitch / 2, stop, pitch) for start, stop in ((left, right), (low, high)))
        crossings = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        away = np.linalg.norm(crossings[:, None] - places.position, axis=2)
        near = away.min(axis=1) <= pitch / 2
        nearest = away[near].argmin(axis=1)
        order = np.argsort(away[near].min(axis=1), kind="stable")
        chosen = list(dict.fromkeys(nearest[order].tolist()))
        if len(chosen) >= count:
            return np.array(chosen[:count], dtype=np.int64)
    raise ValueError("the floor is too small")


def survey(task: Task) -> Errors:
    """Simulate the survey of a floor and map it; the walks of one building differ by its landmarks only."""
    building = site_building([task.floor], task.seed)
    plain = regular_survey(
        task.seed, task.severity, floors=(task.floor.number,), devices=("LG", "OnePlus"), sessions=task.sessions // 2
    )
    scenario = replace(plain, building=building)
    parts = [mapped(scenario, number, task.floor) for number in range(len(scenario.sessions))]
    true, error_m = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    away_m = WalkingDistances(task.floor.space).to_nearest(true, task.floor.landmarks.position)
    return Errors(error_m, away_m, np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts]))


def mapped(scenario: Scenario, number: int, floor: SiteFloor) -> tuple[FloatArray, FloatArray]:
    """Where one session truly was (n, 2) at its frames, and its labels' errors (n,), NaN without one."""
    walk, log = walk_and_track(scenario, scenario.sessions[number])
    status = np.zeros(len(log.time_ns), dtype=np.int8)
    camera = CameraTrack(log.time_ns, log.position_acs, log.orientation_acs, status)
    trajectory = strategy_named("smoother", MappingSettings()).map(camera, log.landmarks, known(floor))
    true = position_at(walk, log.time_ns)[:, :2]
    miss = np.linalg.norm(trajectory.position_bcs[:, :2] - true, axis=1)
    return true, np.where(has_position(trajectory.status), miss, np.nan)


def known(floor: SiteFloor) -> Landmarks:
    """The surveyed landmarks, as their file would have them."""
    marks = floor.landmarks
    count = len(marks.ids)
    return Landmarks(
        ids=marks.ids,
        floor=np.full(count, floor.number),
        position_bcs=marks.position,
        covariance_bcs=np.tile(np.eye(2) * SIGMA_M**2, (count, 1, 1)),
        z_m=np.full(count, np.nan),
        heading_rad=np.full(count, np.nan),
        heading_sigma_rad=np.full(count, np.nan),
    )


def print_comparison(designs: dict[str, FloorDesign], tasks: list[Task], surveyed: list[Errors]) -> None:
    """Print the measures of each kind of set, building by building and over all; then how they differ walk by walk."""
    print("| floor | ways | landmarks | at least | | longest way without | mean | p95 | frames within 0.5 m |")
    print("| --- " * 9 + "|")
    every = list(zip(tasks, surveyed, strict=True))
    for name, design in designs.items():
        head = f"{name} | {design.corridors.length_m.sum():.0f} m | {len(design.place)} | {design.cover.bound}"
        print_rows(head, [one for one in every if one[0].building == name])
    print_rows("all | | | ", every)
    planned = measures_of(every, "planned")
    for kind in ("grid", "random"):
        less = planned - measures_of(every, kind)
        told = ", ".join(
            f"{name} {value:+.3f} +- {error:.3f}"
            for name, value, error in zip(
                ("mean", "p95", "share within 0.5 m"),
                np.nanmean(less, axis=0),
                np.nanstd(less, axis=0) / np.sqrt(len(less)),
                strict=True,
            )
        )
        print(f"\nplanned less {kind}, {len(less)} walks each: {told}")


def measures_of(every: list[tuple[Task, Errors]], kind: str) -> FloatArray:
    """Measures (w, 3) of all walks past one kind of set."""
    return np.vstack([errors.measures for task, errors in every if task.kind == kind])


def print_rows(head: str, every: list[tuple[Task, Errors]]) -> None:
    """One row for each kind of set; means over its walks, of errors over those that have labels."""
    for kind in ("planned", "grid", "random"):
        mean, p95, near = np.nanmean(measures_of(every, kind), axis=0)
        far = max(task.longest_m for task, _ in every if task.kind == kind)
        longest_m = f"{far:.0f} m" if far < MOST_M else f"> {MOST_M:.0f} m"
        print(f"| {head} | {kind} | {longest_m} | {mean:.3f} m | {p95:.3f} m | {near:.1%} |", flush=True)


def print_classes(designs: dict[str, FloorDesign], surveyed: list[tuple[Task, Errors]]) -> None:
    """Print what was expected beside what came true, by the walking distance to the nearest landmark."""
    print("\n| floor | nearest landmark | expected | true | ratio | frames |")
    print("| --- " * 6 + "|")
    pooled: dict[float, list[FloatArray]] = defaultdict(list)
    promised: dict[float, list[tuple[float, float]]] = defaultdict(list)
    for task, errors in surveyed:
        if task.kind != "planned":
            continue
        for one in designs[task.building].classes:
            inside = (errors.away_m >= one.low_m) & (errors.away_m < one.low_m + CLASS_M) & np.isfinite(errors.error_m)
            if inside.sum() < 300:
                continue
            true = float(errors.error_m[inside].mean())
            pooled[one.low_m].append(errors.error_m[inside])
            promised[one.low_m].append((one.error_m, float(inside.sum())))
            print_class(task.building, one.low_m, one.error_m, true, int(inside.sum()))
    for low_m, parts in sorted(pooled.items()):
        values, weights = np.array(promised[low_m]).T
        true = float(np.concatenate(parts).mean())
        print_class("all", low_m, float(np.average(values, weights=weights)), true, int(weights.sum()))


def print_class(name: str, low_m: float, expected_m: float, true_m: float, frames: int) -> None:
    """One row; a ratio beyond the factor that is promised is marked."""
    ratio = expected_m / true_m
    mark = "" if 1 / FACTOR <= ratio <= FACTOR else " !"
    span = f"{low_m:.0f} to {low_m + CLASS_M:.0f} m"
    print(f"| {name} | {span} | {expected_m:.3f} m | {true_m:.3f} m | {ratio:.2f}{mark} | {frames} |")


if __name__ == "__main__":
    main()
