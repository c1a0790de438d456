"""Cost of a store and a cluster: the same survey from disk, from an S3 server, and with one and two Dask workers.

The S3 server (moto), scheduler and workers are processes of this machine, which must be otherwise idle. The processor
time of server and scheduler is reported separately, because on a cluster they have their own machines. Each way of
processing runs ``--repeats`` times in turn after a warm-up run; medians are printed.

    python benchmarks/fleet_speed.py                       the survey of speed.py: 80 sessions of 3 minutes
    python benchmarks/fleet_speed.py --sessions 1 --repeats 1
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import psutil
from speed import DEVICES, simulated

sys.path.insert(0, str(Path(__file__).parents[1]))
os.environ["POLARS_MAX_THREADS"] = "1"  # a worker has one core, wherever it stands; the server has the other one

from tests.dask_processes import DaskProcesses, dask_processes
from tests.stores import Bucket, bucket

from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.dask import DaskExecutor, connected
from vislam2tag.settings import Settings

SETTINGS = Settings(strategy="local-corrected")


class Took(NamedTuple):
    """One run."""

    seconds: float
    service_s: float
    """Processor time of server or scheduler meanwhile."""


def main() -> None:
    """Measure, and print ratios."""
    options = _options()
    with tempfile.TemporaryDirectory() as folder, bucket() as s3:
        survey = simulated(Path(folder) / "survey", sessions=options.sessions)
        stored = s3.upload(survey, "survey")
        sessions = sum(1 for _ in survey.glob("floor_*/*/*/poses.csv"))
        with dask_processes(workers=1) as one, dask_processes(workers=2) as two:
            ways: dict[str, Callable[[], Took]] = {
                "local": lambda: _timed(None, lambda: _local(survey, Path(folder) / "labels")),
                "store": lambda: _timed(s3.process.pid, lambda: _stored(s3, stored)),
                "dask, 1 worker": lambda: _on_dask(one, 1, survey, Path(folder) / "labels"),
                "dask, 2 workers": lambda: _on_dask(two, 2, survey, Path(folder) / "labels"),
            }
            took: dict[str, list[Took]] = defaultdict(list)
            for repeat in range(options.repeats + 1):
                for name, way in ways.items():
                    found = way()
                    if repeat:
                        took[name].append(found)
    _print({name: _median(runs) for name, runs in took.items()}, sessions)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=4, help=f"of each of {DEVICES} devices, a floor")
    parser.add_argument("--repeats", type=int, default=3)
    return parser.parse_args()


def _local(survey: Path, out: Path) -> None:
    shutil.rmtree(out, ignore_errors=True)
    process(survey, out, SETTINGS)


def _stored(s3: Bucket, survey: Path) -> None:
    store = s3.store("labels")
    store.delete([file.name for file in store.list()])
    process(survey, Path(store.address), SETTINGS)


def _on_dask(cluster: DaskProcesses, workers: int, survey: Path, out: Path) -> Took:
    shutil.rmtree(out, ignore_errors=True)
    with connected(cluster.address, None, lambda _: None) as client:
        client.wait_for_workers(workers)
        executor = DaskExecutor(client, lambda _: None)
        return _timed(cluster.scheduler.pid, lambda: process(survey, out, SETTINGS, executor=executor))


def _timed(service: int | None, work: Callable[[], object]) -> Took:
    before = _processor_s(service)
    start = time.perf_counter()
    work()
    return Took(time.perf_counter() - start, _processor_s(service) - before)


def _processor_s(pid: int | None) -> float:
    if pid is None:
        return 0.0
    times = psutil.Process(pid).cpu_times()
    return float(times.user + times.system)


def _median(runs: list[Took]) -> Took:
    return Took(*(statistics.median(column) for column in zip(*runs, strict=True)))


def _print(took: dict[str, Took], sessions: int) -> None:
    for name, each in took.items():
        print(f"{name}: {each.seconds:.2f} s for {sessions} sessions, server or scheduler {each.service_s:.2f} s")
    local, store, one, two = (took[name] for name in ("local", "store", "dask, 1 worker", "dask, 2 workers"))
    apart = (store.seconds - store.service_s) / local.seconds
    print(f"store / local = {store.seconds / local.seconds:.2f} (without the server's processor time {apart:.2f})")
    print(f"Dask's overhead = {1000 * (one.seconds - local.seconds) / sessions:.0f} ms a session")
    print(f"speed-up of two workers = {one.seconds / two.seconds:.2f}")


if __name__ == "__main__":
    main()
