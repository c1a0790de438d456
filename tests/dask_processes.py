"""A Dask scheduler and its workers as processes, for tests that end them at points of progress; and work for them."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from tests.stores import HOST, ROOT, free_port, wait_for
from vislam2tag.pipeline.labels.session import Outcome, SessionJob
from vislam2tag.pipeline.run.workers import Job, run_job

CONFIG = {
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "2",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s",
    "POLARS_MAX_THREADS": "1",
}
OTHER_CODE = "VISLAM2TAG_TEST_OTHER_CODE"


@dataclass
class DaskProcesses:
    """A scheduler and its workers, each of which is started anew when it is killed."""

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def add_worker(self, **environment: str) -> None:
        command = [
            sys.executable,
            "-m",
            "distributed.cli.dask_worker",
            self.address,
            "--nthreads",
            "2",
            "--no-dashboard",
        ]
        self.workers.append(_started(command, environment))

    def kill_worker(self) -> None:
        """Kill the process of the first worker that is at work; its nanny starts another."""
        psutil.Process(self.workers[0].pid).children()[-1].send_signal(signal.SIGKILL)

    def kill_scheduler(self) -> None:
        self.scheduler.kill()
        self.scheduler.wait()

    def start_scheduler(self) -> None:
        self.scheduler = _scheduler(self.address)


@contextmanager
def dask_processes(workers: int = 1) -> Iterator[DaskProcesses]:
    """Start a scheduler and workers that end with the block."""
    address = f"tcp://{HOST}:{free_port()}"
    made = DaskProcesses(address, _scheduler(address))
    try:
        for _ in range(workers):
            made.add_worker()
        yield made
    finally:
        processes = [made.scheduler, *made.workers]
        families = [child for each in processes for child in _children(each.pid)]
        for each in processes:
            each.kill()
            each.wait()
        for child in families:
            if child.is_running():
                child.kill()


def _children(pid: int) -> Sequence[psutil.Process]:
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return ()


def _scheduler(address: str) -> subprocess.Popen[bytes]:
    host, _, port = address.removeprefix("tcp://").partition(":")
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", host, "--port", port]
    process = _started([*command, "--no-dashboard"], {})
    wait_for(host, int(port), process)
    return process


def _started(command: Sequence[str], environment: dict[str, str]) -> subprocess.Popen[bytes]:
    paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    settings = {**os.environ, **CONFIG, "PYTHONPATH": paths, **environment}
    return subprocess.Popen(command, env=settings, cwd=Path("/tmp"), stderr=subprocess.DEVNULL)


def run_or_die(job: SessionJob) -> Outcome:
    """Process a session, but for one that kills whoever tries."""
    if job.task.ref.key.device == "Deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    return run_job(job)


class OfThisWorker(SessionJob):
    """A session whose source is another on workers that the environment says so of."""

    @classmethod
    def of(cls, job: SessionJob) -> OfThisWorker:
        """Such a session of any."""
        return cls(job.task, job.settings, job.out, job.code)

    def code_here(self) -> str:
        """The key of the source."""
        return "another" if os.environ.get(OTHER_CODE) else super().code_here()


@dataclass(frozen=True)
class Nothing(Job[str]):
    """A task of no content."""

    name: str
    code: str = ""

    @property
    def slug(self) -> str:
        """Its name."""
        return self.name

    def code_here(self) -> str:
        """All sources are the same to it."""
        return self.code

    def opened(self) -> AbstractContextManager[Callable[[], str]]:
        """Return its name."""
        return nullcontext(lambda: self.name)

    def given_up(self, error: str) -> str:
        """End it if its workers died."""
        return f"{self.name}: {error}"


def do_nothing(job: Nothing) -> str:
    """Work at a task of no content."""
    return job.slug


def pages_asked_for(job: Nothing) -> str:
    """How many pages the system gives a worker that uses 20 MB again and again, the first time left out."""
    del job

    def work() -> list[bytes]:
        return [bytes(range(256)) * 8_000 for _ in range(10)]

    work()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        work()
    return str(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
