"""Labels of the strategy ``floor-plan``: walks of the simulator placed without landmarks, on right and on wrong plans.

A stretch is 12 m of true way. It is accepted if any of its frames has a label; its error is the mean over these. A
label on a plan that is not the walk's is wrong, wherever it is. Mean and p95 are averages over the walks that have
labels. Time is the median of the processor time, with plans that are already read; the ratio is that to the time of
``process`` with the smoother and all landmarks on the same walk. Memory is the most that a process took for one walk
and all its cases. A walk that needs more than 4096 MB has no labels.

The campaign can be stopped at any time and goes on where it was: WORK/results.jsonl contains each walk and case. Only
lines that the present code measured count.

    python benchmarks/floor_plan.py                                    30 buildings, up to six walks in each
    python benchmarks/floor_plan.py --cases hall symmetric --work FOLDER
    python benchmarks/floor_plan.py --seeds 900 --count 1 --walks 1    each case with one walk
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import resource
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from data_sets import TRUTH_FILE, Walk  # noqa: E402
from floor_plan_cases import CASES, EAST_RAD, OURS, SURVEYS, Case  # noqa: E402
from landmark_survey import spread  # noqa: E402
from tests.docs.figures import digest  # noqa: E402

from vislam2tag.common.files.folder import Folder  # noqa: E402
from vislam2tag.core.arrays import FloatArray, IntArray  # noqa: E402
from vislam2tag.core.context import FixLog, PlacingHints, PlanOfFloor  # noqa: E402
from vislam2tag.core.status import Status  # noqa: E402
from vislam2tag.core.tracks import Trajectory  # noqa: E402
from vislam2tag.estimation.settings import MappingSettings  # noqa: E402
from vislam2tag.estimation.strategy import TrajectoryBuilder, strategy_named  # noqa: E402
from vislam2tag.quality.evaluation.reliability import region_probability  # noqa: E402
from vislam2tag.quality.evaluation.truth import Truth, read_truth  # noqa: E402
from vislam2tag.sessions.prepared import SessionTask, prepared_session  # noqa: E402
from vislam2tag.sessions.registry import open_survey  # noqa: E402
from vislam2tag.simulation.building import draw_plan  # noqa: E402
from vislam2tag.simulation.model import SimulatedFloor  # noqa: E402
from vislam2tag.simulation.survey import simulate  # noqa: E402
from vislam2tag.site.corrections.file import Corrections  # noqa: E402
from vislam2tag.site.model import Floor  # noqa: E402
from vislam2tag.site.walkable.plan_costs import plan_costs, plans_of  # noqa: E402

CODE = ("benchmarks/floor_plan.py", "benchmarks/floor_plan_cases.py")
PACKAGES = ("core", "estimation", "sessions", "simulation", "site")
STRETCH_M, KNOT_S = 12.0, 0.3
"""Length of a stretch, and interval of the positions between which way is measured."""
WRONG_M = (1.5, 3.0)
FIT = ("misfit", "mirror", "exchanged", "floors", "scale")
MEMORY_MB = 4096
"""A process may take so much."""


@dataclass(frozen=True)
class Found:
    """What a walk gives in a case: frames, errors of those with a label, stretches, and how it was placed."""

    case: str
    walk: str
    code: str
    seconds: float
    """Processor time, and below that of ``process`` with the smoother and all landmarks."""
    smoother_s: float
    memory_mb: float
    """Infinite if it was not enough."""
    frames: int
    labelled: int
    mean_m: float
    p95_m: float
    max_m: float
    inside: tuple[int, int]
    """Frames whose errors are inside the 68 % and the 95 % region."""
    stretches: int
    accepted: int
    wrong: tuple[int, int]
    """Accepted stretches that are wrong by more than :data:`WRONG_M`."""
    placing: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """The cases to measure with one walk, by its ``number`` in the building of a ``seed``."""

    survey: str
    seed: int
    number: int
    cases: tuple[str, ...]
    code: str = ""

    @property
    def walk(self) -> str:
        """Name of the walk."""
        return f"{self.survey} {self.seed}-{self.number}"


def main() -> None:
    """Measure what is missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("floor-plan-work"), help="folder of results.jsonl")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), metavar="NAME", help="default: all")
    parser.add_argument("--seeds", type=int, default=700, help="the first")
    parser.add_argument("--count", type=int, default=30, help="how many buildings")
    parser.add_argument("--walks", type=int, default=8, help="most walks in a building of the simulator")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    parts = (*CODE, *(f"src/vislam2tag/{name}" for name in PACKAGES))
    code = hashlib.sha256("".join(digest(ROOT / part) for part in parts).encode()).hexdigest()[:12]
    options.work.mkdir(parents=True, exist_ok=True)
    file = options.work / "results.jsonl"
    wanted = jobs(options.cases, range(options.seeds, options.seeds + options.count), options.walks, code)
    done = {(one.case, one.walk) for one in read(file, code)}
    left = [replace(job, cases=tuple(case for case in job.cases if (case, job.walk) not in done)) for job in wanted]
    left = [job for job in left if job.cases]
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(options.jobs, spawn, limit_memory, max_tasks_per_child=1)
    with pool, file.open("a", encoding="utf-8") as lines:
        for number, found in enumerate(pool.map(measured, left), 1):
            lines.writelines(json.dumps(asdict(one)) + "\n" for one in found)
            lines.flush()
            print(f"{number} of {len(left)} walks", file=sys.stderr, flush=True)
    names = {(case, job.walk) for job in wanted for case in job.cases}
    print_table(options.cases, [one for one in read(file, code) if (one.case, one.walk) in names])


def limit_memory() -> None:
    """Make allocations beyond :data:`MEMORY_MB` fail in this process."""
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_MB << 20, resource.getrlimit(resource.RLIMIT_DATA)[1]))


def jobs(cases: Iterable[str], seeds: Sequence[int], walks: int, code: str = "") -> list[Job]:
    """All walks of these cases, one building after the other."""
    of = {name: tuple(case for case in cases if CASES[case].survey == name) for name in SURVEYS}
    return [
        Job(name, seed, number, of[name], code)
        for rank, seed in enumerate(seeds)
        for name, survey in SURVEYS.items()
        if of[name] and rank < survey.buildings
        for number in range(survey.walks if survey.made is not None else min(walks, survey.walks))
    ]


def read(file: Path, code: str) -> list[Found]:
    """What this code has measured; a last line that was cut off does not count."""
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True) if file.is_file() else []
    found = [Found(**json.loads(line)) for line in lines if line.endswith("}\n")]
    return [one for one in found if one.code == code]


def measured(job: Job) -> list[Found]:
    """Simulate the walk, read it back, and measure its cases."""
    from vislam2tag.pipeline.labels.process import process  # memory is that of mapping alone

    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        root, scenario = Path(folder) / "survey", SURVEYS[job.survey].scenario(job.seed)
        simulate(replace(scenario, sessions=scenario.sessions[job.number : job.number + 1]), root)
        survey = open_survey(root)
        (ref,) = survey.sessions
        prepared = prepared_session(SessionTask(ref, survey.site, Corrections()))
        session, landmarks = prepared.session, prepared.landmarks
        walk = Walk(job.walk, session.camera, session.landmarks, landmarks, read_truth(ref.folder / TRUTH_FILE))
        found = []
        for name in job.cases:
            floors = [
                drawn_floor(CASES[name], floor, scenario.building.floor(floor.number), job.seed, Path(folder) / name)
                for floor in survey.site.floors
            ]
            given = with_landmarks(with_plans(walk, CASES[name], floors), CASES[name].landmarks)
            trajectory, seconds = timed(CASES[name].strategy, given)
            most_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            memory_mb = np.inf if trajectory is None else most_mb
            about = partial(Found, name, job.walk, job.code, seconds, np.nan, memory_mb)
            nothing = TrajectoryBuilder.blank(given.camera, Status.NO_MAPPING).finish(given.camera, (), ())
            found.append(about(**compared(CASES[name], given, trajectory or nothing)))
        start = time.process_time()
        process(root, Path(folder) / "labels", jobs=1)
        smoother_s = time.process_time() - start
        return [replace(one, smoother_s=smoother_s) for one in found]


def drawn_floor(case: Case, floor: Floor, simulated: SimulatedFloor, seed: int, folder: Path) -> Floor:
    """A floor with the plan that a case gives it."""
    if case.drawn is not None:
        simulated = case.drawn(simulated, seed)
        name = f"floor_{floor.number}.jpg"
        draw_plan(simulated, Folder.at(folder).make(), name)
        floor = replace(floor, plan=folder / name)
    wide, high = case.size
    return replace(floor, width_m=simulated.width_m * wide, height_m=simulated.height_m * high)


def with_plans(walk: Walk, case: Case, floors: Sequence[Floor]) -> Walk:
    """The walk on the plans that a case gives it, which are read, and its truth on them."""
    assert walk.truth is not None
    number = walk.camera.own_floor
    own = (number + case.filed) % len(floors)
    plans = plans_of(tuple(floors))
    if case.own_plan_only:
        plans = (PlanOfFloor(own, partial(plan_costs, floors[(own + case.plan_of) % len(floors)])),)
    for plan in plans:
        assert plan.costs is not None
        assert plan.costs.interleaved.size
    truth = replace(walk.truth, position_bcs=walk.truth.position_bcs * case.size)
    middle = walk.camera.time_ns[[len(walk.camera.time_ns) // 2]]
    tap = FixLog(middle, at_frames(truth, middle)[0], ("tap",)) if case.tap else None
    north = PlacingHints(north_rad=EAST_RAD) if case.north else None
    camera = replace(walk.camera, plans=plans, own_floor=own, fixes=tap, hints=north)
    return replace(walk, camera=camera, truth=truth)


def with_landmarks(walk: Walk, count: int) -> Walk:
    """The walk with so many surveyed landmarks, far from one another, and no others in its log."""
    kept = walk.landmarks.select(spread(walk.landmarks, count).tolist() if count else [])
    logged = [number for number, name in enumerate(walk.log.ids) if name in kept.index]
    return replace(walk, landmarks=kept, log=walk.log.select(logged))


def timed(strategy: str, walk: Walk) -> tuple[Trajectory | None, float]:
    """Map a walk, None if there is not enough memory, and the processor time of it, seconds."""
    mapping = strategy_named(strategy, MappingSettings())
    camera = walk.camera if strategy == OURS else replace(walk.camera, plans=())  # else it uses them, too
    start = time.process_time()
    try:
        trajectory = mapping.map(camera, walk.log, walk.landmarks)
    except MemoryError:
        return None, time.process_time() - start
    return trajectory, time.process_time() - start


def compared(case: Case, walk: Walk, trajectory: Trajectory) -> dict[str, Any]:
    """Compare labels with the truth: the last fields of :class:`Found`."""
    truth = walk.truth
    assert truth is not None
    known = (trajectory.time_ns >= truth.time_ns[0]) & (trajectory.time_ns <= truth.time_ns[-1]) & walk.camera.usable
    true, stretch = at_frames(truth, trajectory.time_ns[known])
    off = trajectory.position_bcs[known, :2] - true
    labelled = trajectory.status[known] == Status.OK
    error = np.linalg.norm(off[labelled], axis=1)
    inside = region_probability(off[labelled], trajectory.covariance_bcs[known][labelled])
    number = np.bincount(stretch[labelled], minlength=stretch.max() + 1)
    mean = np.bincount(stretch[labelled], error, len(number))[number > 0] / number[number > 0]
    mean = mean if case.right else np.full(len(mean), np.inf)
    placing = trajectory.placing
    return {
        "frames": int(known.sum()),
        "labelled": int(labelled.sum()),
        "mean_m": float(error.mean()) if len(error) else float("nan"),
        "p95_m": float(np.quantile(error, 0.95)) if len(error) else float("nan"),
        "max_m": float(error.max()) if len(error) else float("nan"),
        "inside": (int((inside < 0.68).sum()), int((inside < 0.95).sum())),
        "stretches": len(number),
        "accepted": len(mean),
        "wrong": (int((mean > WRONG_M[0]).sum()), int((mean > WRONG_M[1]).sum())),
        "placing": {}
        if placing is None
        else {name: getattr(placing, name) for name in FIT} | {"reason": placing.reason.label},
    }


def at_frames(truth: Truth, time_ns: IntArray) -> tuple[FloatArray, IntArray]:
    """True positions (n, 2) at times (n,), and the stretch (n,) that each is in."""
    at_s, known_s = (time_ns - truth.time_ns[0]) * 1e-9, (truth.time_ns - truth.time_ns[0]) * 1e-9
    knots = np.arange(0.0, known_s[-1] + KNOT_S, KNOT_S)
    true, walked = (
        np.column_stack([np.interp(at, known_s, axis) for axis in truth.position_bcs.T]) for at in (at_s, knots)
    )
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(walked, axis=0), axis=1))))
    count = max(1, round(float(way[-1]) / STRETCH_M))
    part = np.interp(at_s, knots, way) / max(float(way[-1]), 1e-9)
    return true, (part * count).astype(np.int64).clip(0, count - 1)


def print_table(cases: Iterable[str], found: Sequence[Found]) -> None:
    """Print one row for each case that has walks, as Markdown."""
    wrong = " | ".join(f"over {limit:g} m" for limit in WRONG_M)
    print(
        "| case | walks | stretches | labelled | mean, m | p95, m | accepted "
        f"| {wrong} | in 68 % | in 95 % | time, s | ratio | memory, MB |\n" + "| --- " * 14 + "|"
    )
    for case in cases:
        if walks := [one for one in found if one.case == case]:
            print(f"| {case} | {row(walks, right=CASES[case].right)} |")


def row(walks: Sequence[Found], *, right: bool) -> str:
    """Figures of the walks of a case; errors mean nothing on a plan that is not ``right``."""
    labelled = sum(one.labelled for one in walks)
    ratios = [one.seconds / one.smoother_s for one in walks]
    errors, memory_mb = ["-"] * 4, max(one.memory_mb for one in walks)
    if labelled and right:
        means = np.nanmean([(one.mean_m, one.p95_m) for one in walks], axis=0).tolist()
        inside = (np.sum([one.inside for one in walks], axis=0) / labelled).tolist()
        errors = [*(f"{value:.2f}" for value in means), *(f"{share:.1%}" for share in inside)]
    cells = [
        str(len(walks)),
        str(sum(one.stretches for one in walks)),
        f"{labelled / sum(one.frames for one in walks):.1%}",
        *errors[:2],
        str(sum(one.accepted for one in walks)),
        *(str(count) for count in np.sum([one.wrong for one in walks], axis=0).tolist()),
        *errors[2:],
        f"{np.median([one.seconds for one in walks]):.2f}",
        f"{np.median(ratios):.1f}",
        f"{memory_mb:.0f}" if np.isfinite(memory_mb) else f"> {MEMORY_MB}",
    ]
    return " | ".join(cells)


if __name__ == "__main__":
    main()
