"""What models cost by the number of fingerprints they learn: time to learn, time to answer, memory; a table and a plot.

    python benchmarks/positioning_scale.py --plot docs/images/positioning_scale.svg
    python benchmarks/positioning_scale.py --sizes 1000 20000 --models weighted-knn local-kriging --kept costs.jsonl

Fingerprints are drawn on five storeys of 100 x 60 m with 30 access points each, whose levels fall with distance; 40
walks. Each model and size has a process of its own; memory is its greatest while learning and answering, less what it
had with the data alone (Linux). Times are wall times and, in brackets, the processor's, of one thread. What ``--kept``
contains already is not measured again, so that a campaign can be stopped and go on.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import model_named

SIZES = (1_000, 5_000, 20_000, 50_000, 200_000)
MODELS = ("weighted-knn", "local-kriging")
ASKED, ALONE = 500, 50
STOREYS, ACCESS_POINTS, WALKS = 5, 30, 40
SIZE_M = np.array([100.0, 60.0])
FAINTEST_DBM = -92.0
_MEBI = 1024


class Cost(NamedTuple):
    """Of one model that learned so many fingerprints."""

    model: str
    size: int
    learn_s: float
    learn_cpu_s: float
    batch_ms: float
    batch_cpu_ms: float
    alone_ms: float
    alone_cpu_ms: float
    memory_mib: float

    def line(self) -> str:
        """A row of the table."""
        return (
            f"| `{self.model}` | {self.size:,} | {self.learn_s:.1f} s ({self.learn_cpu_s:.1f}) | "
            f"{self.batch_ms:.2f} ms ({self.batch_cpu_ms:.2f}) | {self.alone_ms:.2f} ms ({self.alone_cpu_ms:.2f}) | "
            f"{self.memory_mib:.0f} MiB |"
        )


def main() -> None:
    """Print a line for each model and size, and draw the plot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--models", nargs="+", default=MODELS)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--kept", type=Path, help="JSON lines of what was measured; further ones are added")
    arguments = parser.parse_args()
    print("| model | fingerprints | learn | a scan in a batch | a scan alone | memory |\n| --- |" + " ---: |" * 5)
    kept = arguments.kept.read_text().splitlines() if arguments.kept and arguments.kept.is_file() else []
    costs = [Cost(**json.loads(line)) for line in kept]
    for cost in costs:
        print(cost.line())
    done = {(cost.model, cost.size) for cost in costs}
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        tasks = [(model, size) for size in arguments.sizes for model in arguments.models]
        for cost in pool.imap(measured, [task for task in tasks if task not in done], chunksize=1):
            print(cost.line(), flush=True)
            costs.append(cost)
            if arguments.kept:
                with arguments.kept.open("a") as stream:
                    stream.write(json.dumps(cost._asdict()) + "\n")
    if arguments.plot is not None:
        plot(costs, arguments.plot)


def measured(task: tuple[str, int]) -> Cost:
    """Learn, then answer in a batch and one by one."""
    name, size = task
    scans, places = drawn(size + ASKED)
    learn, asked = scans[slice(0, size)], scans[slice(size, None)]
    Path("/proc/self/clear_refs").write_text("5")  # the greatest counts from now
    before = memory_mib("VmRSS")
    marks = [(time.perf_counter(), time.process_time())]
    model = model_named(name).fit(learn, places[slice(0, size)])
    marks.append((time.perf_counter(), time.process_time()))
    model.predict(asked)
    marks.append((time.perf_counter(), time.process_time()))
    for row in range(ALONE):
        model.predict(asked[slice(row, row + 1)])
    marks.append((time.perf_counter(), time.process_time()))
    grown = memory_mib("VmHWM") - before
    (learn_s, learn_cpu_s), (batch_s, batch_cpu_s), (alone_s, alone_cpu_s) = np.diff(marks, axis=0).tolist()
    batch_ms, batch_cpu_ms = (1000 * seconds / ASKED for seconds in (batch_s, batch_cpu_s))
    alone_ms, alone_cpu_ms = (1000 * seconds / ALONE for seconds in (alone_s, alone_cpu_s))
    return Cost(name, size, learn_s, learn_cpu_s, batch_ms, batch_cpu_ms, alone_ms, alone_cpu_ms, grown)


def drawn(count: int) -> tuple[RadioScans, ScanPlaces]:
    """Draw fingerprints: exponent 3, 15 dB a storey, shadows and fading of 4 dB."""
    rng = np.random.default_rng(0)
    stands, stands_on = rng.uniform(0, 1, (STOREYS * ACCESS_POINTS, 2)) * SIZE_M, np.arange(STOREYS * ACCESS_POINTS)
    storey, xy = np.arange(count) % STOREYS, rng.uniform(0, 1, (count, 2)) * SIZE_M
    z, sigma_m = np.full(count, np.nan), np.full(count, 0.2)
    away_m = np.hypot(np.linalg.norm(xy[:, None] - stands, axis=2), 2.0)
    between = np.abs(storey[:, None] - stands_on // ACCESS_POINTS)
    level = -35 - 30 * np.log10(away_m) - 15.0 * between + rng.normal(0, 4, away_m.shape)
    row, column = np.nonzero(level > FAINTEST_DBM)
    session = np.char.add("walk", (np.arange(count) * WALKS // count).astype(np.str_))
    scans = scans_from_readings(
        row, np.char.add("ap", column.astype(np.str_)), level[row, column], count, session=session
    )
    storeys = tuple(Storey("", number) for number in range(STOREYS))
    return scans, ScanPlaces(storeys, storey, xy, z, sigma_m)


def memory_mib(name: str) -> float:
    """Resident memory now (VmRSS), or the greatest so far (VmHWM); Linux alone."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / _MEBI for line in lines if line.startswith(name))


def plot(costs: Sequence[Cost], path: Path) -> None:
    """Draw the processor's times to learn and to answer over sizes, both axes logarithmic."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    for name in dict.fromkeys(cost.model for cost in costs):
        own = [cost for cost in costs if cost.model == name]
        sizes = [cost.size for cost in own]
        left.loglog(sizes, [cost.learn_cpu_s for cost in own], marker="o", label=name)
        right.loglog(sizes, [cost.batch_cpu_ms for cost in own], marker="o", label=f"{name}, in a batch")
        right.loglog(sizes, [cost.alone_cpu_ms for cost in own], marker="x", linestyle="--", label=f"{name}, alone")
    left.set(xlabel="fingerprints learned", ylabel="time to learn / s")
    right.set(xlabel="fingerprints learned", ylabel="time to answer a scan / ms")
    for axes in (left, right):
        axes.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    figure.savefig(path)


if __name__ == "__main__":
    main()
