"""A fleet of very many sessions on Dask workers that are killed at random; and tasks of no content alone.

The fleet is made of one short generated walk, copied; it lies in FLEET, a folder or a bucket on the server that
``python -m tests.store_server PORT HOST`` starts (set AWS_ENDPOINT_URL and made-up credentials). Whatever ended the
command, the same command goes on; each run adds a line to campaign.jsonl at each hundredth and when it ends. What to
look at: ``worked`` against sessions (repeats), ``requests`` a session, ``client_mb`` (flat).

    python benchmarks/fleet_campaign.py FLEET --sessions 10000 --kill-every 200
    python benchmarks/fleet_campaign.py --tasks 1000000
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.request import urlopen

import psutil

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT)]

from tests.dask_processes import (  # noqa: E402
    DaskProcesses,
    Nothing,
    dask_processes,
    do_nothing,
    give_nothing_up,
    no_code,
)
from tests.surveys import make_survey  # noqa: E402

from vislam2tag.common.files.folder_store import any_store_at  # noqa: E402
from vislam2tag.pipeline.fleet.add import add_surveys  # noqa: E402
from vislam2tag.pipeline.fleet.catalogue import fleet_status  # noqa: E402
from vislam2tag.pipeline.fleet.layout import FLEET_FILE, SURVEYS  # noqa: E402
from vislam2tag.pipeline.fleet.process import FleetOutcome, SessionOutcome, fleet_on_dask, process_fleet  # noqa: E402
from vislam2tag.pipeline.run.cluster import connected  # noqa: E402
from vislam2tag.pipeline.run.dask_executor import DaskExecutor  # noqa: E402
from vislam2tag.settings import Settings  # noqa: E402

SETTINGS = Settings(strategy="local-corrected")
EACH = 100
"""Sessions of a survey."""
SECONDS = 20.0
RESULTS = Path("campaign.jsonl")
LOOKS = 100
"""How often memory and time are looked at."""


def main() -> None:
    """Run one of both, and keep what was measured."""
    options = _options()
    with dask_processes(workers=options.workers) as cluster, connected(cluster.address, None, print) as client:
        client.wait_for_workers(options.workers)
        watched = Watched(cluster, options.kill_every, options.tasks or options.sessions)
        if options.tasks:
            jobs = (Nothing(f"nothing-{number}") for number in range(options.tasks))
            executor: DaskExecutor[Nothing, str] = DaskExecutor(client, no_code, give_nothing_up, print)
            executor(do_nothing, jobs, report=watched.take)
            _keep({"tasks": options.tasks} | watched.found())
            return
        _make_fleet(options.fleet, options.sessions)
        _requests()
        totals = process_fleet(
            options.fleet, lambda _: SETTINGS, executor=fleet_on_dask(client, print), progress=watched.take_of_fleet
        )
        _keep({"sessions": totals.sessions, "states": totals.states} | watched.found() | _requests())


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fleet", type=Path, nargs="?", help="folder, or s3://BUCKET/FOLDER")
    parser.add_argument("--sessions", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kill-every", type=int, default=0, help="kill a worker each so many outcomes; 0: none")
    parser.add_argument("--tasks", type=int, default=0, help="so many tasks of no content, instead of a fleet")
    options = parser.parse_args()
    if options.fleet is None and not options.tasks:
        parser.error("give FLEET or --tasks")
    return options


@dataclass
class Watched:
    """Counts outcomes, kills workers, and keeps memory and processor time at each hundredth."""

    cluster: DaskProcesses
    kill_every: int
    total: int
    ended: int = 0
    worked: int = 0
    killed: int = 0
    started: float = field(default_factory=time.perf_counter)

    def take(self, _: str) -> None:
        """Take an outcome."""
        self.ended += 1
        if self.kill_every and self.ended % self.kill_every == 0:
            self._kill()
        if self.ended * LOOKS // self.total > (self.ended - 1) * LOOKS // self.total:
            _keep({"of": self.total} | self.found())

    def take_of_fleet(self, outcome: FleetOutcome, _: int) -> None:
        """Take an outcome of a fleet."""
        if isinstance(outcome, SessionOutcome):
            self.worked += outcome.outcome.repeated
            self.take(outcome.survey)

    def found(self) -> dict[str, object]:
        """What was measured."""
        seconds = time.perf_counter() - self.started
        return {
            "workers": len(self.cluster.workers),
            "seconds": round(seconds, 1),
            "ended": self.ended,
            "worked": self.worked,
            "killed": self.killed,
            "client_s": round(_processor_s(os.getpid()), 1),
            "scheduler_s": round(_processor_s(self.cluster.scheduler.pid), 1),
            "client_mb": round(_resident_mb(os.getpid()), 1),
            "scheduler_mb": round(_resident_mb(self.cluster.scheduler.pid), 1),
        }

    def _kill(self) -> None:
        nanny = random.Random(self.ended).choice(self.cluster.workers)
        with suppress(psutil.Error, IndexError):  # it may just be starting again
            psutil.Process(nanny.pid).children()[-1].send_signal(signal.SIGKILL)
            self.killed += 1


def _make_fleet(fleet: Path, sessions: int) -> None:
    """Make surveys of :data:`EACH` sessions each, unless they are there."""
    if any_store_at(fleet).get(FLEET_FILE) is not None and fleet_status(fleet).sessions >= sessions:
        return
    with tempfile.TemporaryDirectory() as folder:
        survey = make_survey(Path(folder) / "walk", devices=("LG",), seconds=SECONDS)
        walk = next(survey.glob("floor_0/LG/*"))
        for number in range(-(-sessions // EACH)):
            store = any_store_at(fleet / SURVEYS / f"survey-{number:05d}")
            there = {file.name for file in store.list()}
            for name, content in _files(survey, walk, range(min(EACH, sessions - number * EACH))):
                if name not in there:
                    store.put(name, content)
    add_surveys(fleet)


def _files(survey: Path, walk: Path, copies: range) -> Iterator[tuple[str, Path]]:
    for path in survey.rglob("*"):
        if path.is_file() and walk not in path.parents:
            yield path.relative_to(survey).as_posix(), path
    for copy in copies:
        for path in walk.iterdir():
            yield f"floor_0/LG/2021-12-20T{copy:06d}/{path.name}", path


def _requests() -> dict[str, object]:
    """Requests since this was asked last, of a server that counts them; nothing of a folder."""
    endpoint = os.environ.get("AWS_ENDPOINT_URL")
    if endpoint is None:
        return {}
    with urlopen(f"{endpoint}/__seen") as answer:
        seen: list[str] = json.loads(answer.read())
    marks = [each for each in seen if each.startswith("PUT") and "/sessions/floor_" in each and each.endswith(".json")]
    return {"requests": len(seen), "marks_written": len(marks)}


def _resident_mb(pid: int) -> float:
    return float(psutil.Process(pid).memory_info().rss) / 1e6


def _processor_s(pid: int) -> float:
    times = psutil.Process(pid).cpu_times()
    return float(times.user + times.system)


def _keep(found: dict[str, object]) -> None:
    print(json.dumps(found), flush=True)
    with RESULTS.open("a") as file:
        file.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
