"""Runs sessions on the workers of a Dask cluster, given by its scheduler's address or a small TOML file.

Results are kept in the output folder and not in the cluster. So it does not matter if a worker, the scheduler or this
process is lost: a task that runs again finds its session done.
"""

from __future__ import annotations

import importlib
import secrets
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, Literal

from pydantic import Field, ValidationError

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import OutputError, UsageError, first_line, import_extra
from vislam2tag.common.files.given_files import read_toml_values
from vislam2tag.common.garbage import keep_freed_memory
from vislam2tag.common.records import FiniteRecord
from vislam2tag.pipeline.run.failures import LogInOrder
from vislam2tag.pipeline.run.workers import Job, Report, Supply, Worked, worked

_CONFIG = {
    "distributed.scheduler.allowed-failures": 2,  # the third worker that a session kills was the last
    "distributed.scheduler.worker-saturation": 1.0,  # no worker queues sessions that it has not begun
    "distributed.nanny.pre-spawn-environ.POLARS_MAX_THREADS": 1,
}
_THREADS = 2
"""Threads of a worker with one core: one maps a session while the other fetches the next or writes the previous one."""
_CONNECT_S = 30
_PACKAGES = {"ssh": "asyncssh", "slurm": "dask-jobqueue"}
_REMOVED = {"kubernetes": "the cluster kind kubernetes was removed; use one Kubernetes Job for each survey"}
"""Replacements of cluster kinds of earlier versions."""


class ClusterSettings(FiniteRecord):
    """A cluster that is created for one command and ends with it."""

    kind: Literal["local", "ssh", "slurm"]
    """Processes on this machine, on others by SSH, or from Slurm."""
    workers: int = Field(default=1, ge=1)
    """Worker processes, each of which maps one session at a time."""
    options: dict[str, Any] = {}
    """Further arguments of Dask's class, by name: ``hosts`` of SSHCluster, ``queue`` and ``memory`` of SLURMCluster."""


def read_cluster(file: Path) -> ClusterSettings:
    """Read the description of a cluster; raises UsageError that names file and entry."""
    try:
        values = read_toml_values(file)
        if str(values.get("kind")) in _REMOVED:
            raise UsageError(f"{file}: {_REMOVED[str(values['kind'])]}, see {page_of('how-to/many-surveys')}")
        return ClusterSettings.model_validate(values)
    except (OSError, ValueError) as error:
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise UsageError(f"{file}: {where}: {first['msg']}; see {page_of('how-to/many-surveys')}") from error
        raise UsageError(f"{file}: the cluster file cannot be read: {first_line(error)}") from error


@contextmanager
def connected(scheduler: str | None, cluster: Path | None, tell: Callable[[str], None]) -> Iterator[Any]:
    """Yield a ``distributed.Client`` of a scheduler, or of a cluster that exists during the block.

    ``tell`` is called with the address of the dashboard. Raises UsageError if neither or both are given, OutputError
    if the scheduler does not answer or the cluster cannot be created.
    """
    if (scheduler is None) == (cluster is None):
        raise UsageError("--executor dask needs either --scheduler ADDRESS or --cluster FILE")
    distributed, config = import_extra("distributed"), import_extra("dask.config")
    with config.set(_CONFIG):
        if cluster is not None:
            with _made(cluster) as made, distributed.Client(made, set_as_default=False) as client:
                tell(f"dashboard: {client.dashboard_link}")
                yield client
            return
        try:
            client = distributed.Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise OutputError(
                f"{scheduler}: no Dask scheduler answers ({first_line(error)}); start one there, or correct --scheduler"
            ) from error
        with client:
            tell(f"dashboard: {client.dashboard_link}")
            yield client


@contextmanager
def _made(file: Path) -> Iterator[Any]:
    settings = read_cluster(file)
    try:
        cluster = cluster_of(settings)
    except ModuleNotFoundError as error:
        package = _PACKAGES.get(settings.kind, error.name)
        raise UsageError(
            f"{file}: a cluster of the kind {settings.kind} needs the package {package}; install it with pip"
        ) from error
    except Exception as error:  # of an SSH connection or a batch system: each has its own
        raise OutputError(f"{file}: the cluster cannot be created: {first_line(error)}") from error
    with cluster:
        yield cluster


def cluster_of(settings: ClusterSettings) -> Any:
    """Create a cluster. Raises ModuleNotFoundError if its package is missing, and that package's errors."""
    workers, options = settings.workers, settings.options
    if settings.kind == "local":
        local = {"n_workers": workers, "threads_per_worker": _THREADS, "dashboard_address": ":0"} | options
        return import_extra("distributed").LocalCluster(**local)
    if settings.kind == "ssh":
        importlib.import_module("asyncssh")
        hosts = options.get("hosts", ["localhost"])  # the scheduler's first
        made = {"worker_options": {"nthreads": _THREADS, "n_workers": workers}} | options | {"hosts": hosts}
        return import_extra("distributed").SSHCluster(**made)
    jobs = importlib.import_module("dask_jobqueue")
    cluster = jobs.SLURMCluster(**{"cores": _THREADS, "processes": 1, "job_cpu": 1} | options)
    cluster.scale(jobs=workers)
    return cluster


AHEAD = 4
"""Sessions handed to the scheduler per thread of its workers; the rest wait here, so that the scheduler stays small."""
_LOOK_S = 2.0
"""Interval for checking the scheduler, seconds."""
_ONE_LOOKS = Lock()
"""The key of the source is computed in one thread at a time: Python 3.11 cannot parse in two."""


class OtherCodeError(Exception):
    """A worker has another source than the client, so its results would differ."""


@dataclass(frozen=True)
class DaskExecutor:
    """Runs a function on all sessions on the workers of ``client``'s scheduler, and reports each as it ends."""

    client: Any
    """``distributed.Client``."""
    tell: Callable[[str], None]
    """Called with a line about each refused worker, and if there is no worker."""

    def __call__(self, work: Callable[[Any], Any], todo: Iterable[Job[Any]], *, report: Report[Any, Job[Any]]) -> None:
        """Process all of ``todo``. Raises errors of workers, and OutputError if the scheduler is lost.

        After any error or interrupt, no task waits in the scheduler; running tasks may finish.
        """
        run = _Run(self, work, Supply(todo), self.client.scheduler.address)
        log = LogInOrder()
        try:
            for number, (outcome, records) in run.outcomes():
                log.add(number, records)
                run.supply.follow(report(outcome))
        finally:
            log.close()
            with suppress(Exception):  # the scheduler may be gone
                self.client.cancel(list(run.running))


@dataclass
class _Run:
    """One call's jobs: those that wait here, and those that the scheduler has, by their futures."""

    executor: DaskExecutor
    work: Callable[[Any], Any]
    supply: Supply[Job[Any]]
    scheduler: str
    """Its address."""
    wanted: int = 1
    """Sessions that the scheduler should have."""
    running: dict[Any, tuple[int, Job[Any]]] = field(default_factory=dict)
    done: SimpleQueue[Any] = field(default_factory=SimpleQueue)
    """Futures as they end."""
    refused: dict[str, str] = field(default_factory=dict)
    """Names of workers by address."""
    suspects: deque[tuple[int, Job[Any]]] = field(default_factory=deque)
    """Jobs of dead workers that had several jobs; they are tried again one by one at the end."""
    alone: bool = False
    """Whether the scheduler's only job is one of these."""

    def outcomes(self) -> Iterator[tuple[int, Worked[Any]]]:
        self._submit()
        while self.running:
            yield from self._results(self._next())
            self._submit()

    def _next(self) -> list[Any]:
        """Wait for sessions to end; raises OutputError if the scheduler is lost, in which case none ends."""
        while True:
            try:
                ended = [self.done.get(timeout=_LOOK_S)]
            except Empty:
                lost = self.executor.client.status != "running"
                if lost or any(future.status == "cancelled" for future in self.running):
                    raise self._lost() from None
            else:
                with suppress(Empty):
                    while True:
                        ended.append(self.done.get_nowait())
                return ended

    def _submit(self) -> None:
        """Keep the scheduler supplied with several sessions per message, because messages are expensive."""
        if len(self.running) > self.wanted // 2:
            return
        first = self.supply.take()
        self.alone = first is None and not self.running and bool(self.suspects)
        if self.alone:
            first = self.suspects.popleft()
        if first is None:
            return
        self.supply.give_back(*first)
        accepted = self._accepted()
        self.wanted = AHEAD * max(1, sum(accepted.values()))
        taken = self.supply.take_some(self.wanted - len(self.running))
        futures = self.executor.client.map(
            partial(_on_worker, self.work),
            [job for _, job in taken],
            key=[f"{job.slug}-{secrets.token_hex(4)}" for _, job in taken],
            workers=list(accepted) if self.refused else None,
        )
        self.running.update(zip(futures, taken, strict=True))
        for future in futures:
            future.add_done_callback(self.done.put)

    def _accepted(self) -> dict[str, int]:
        """Threads of each worker that has this source, by address; raises OutputError if all have another."""
        workers = self.executor.client.scheduler_info(n_workers=-1)["workers"]
        accepted = {address: each["nthreads"] for address, each in workers.items() if address not in self.refused}
        if workers and not accepted:
            raise OutputError(
                f"no worker has the same vislam2tag as this machine: {', '.join(self.refused.values())}; "
                "install the same versions of vislam2tag and its libraries there"
            )
        if not workers and not self.running:
            self.executor.tell(f"the scheduler at {self.scheduler} has no workers yet; waiting for one")
        return accepted

    def _results(self, ended: list[Any]) -> Iterator[tuple[int, Worked[Any]]]:
        """Outcomes of sessions that are not submitted again."""
        jobs = {future: self.running.pop(future) for future in ended}
        finished = [future for future in ended if future.status == "finished"]
        failed = [future for future in ended if future not in finished]
        try:
            results = self.executor.client.gather(finished)
        except import_extra("distributed").KilledWorker:  # the worker with a result died of another job
            for future in finished:
                self.supply.give_back(*jobs[future])
        except (OSError, CancelledError) as error:  # not of the sessions: those that raise are not finished
            raise self._lost() from error
        else:
            yield from ((jobs[future][0], result) for future, result in zip(finished, results, strict=True))
        for future in failed:
            if (given_up := self._failed(future, *jobs[future])) is not None:
                yield given_up

    def _failed(self, future: Any, number: int, job: Job[Any]) -> tuple[int, Worked[Any]] | None:
        """Outcome of a failed job; None if it is submitted again."""
        if future.status != "error":
            raise self._lost()
        error = future.exception()
        if isinstance(error, OtherCodeError):
            self._refuse(*error.args)
            self.supply.give_back(number, job)
            return None
        if not isinstance(error, import_extra("distributed").KilledWorker):
            raise error
        if not self.alone:
            self.suspects.append((number, job))
            return None
        times, last = error.allowed_failures + 1, error.last_worker.name
        cause = f"{times} workers died while processing it (out of memory, or a library crashed), the last one {last}"
        return number, (job.given_up(cause), [])

    def _refuse(self, address: str, name: str) -> None:
        if address not in self.refused:
            self.refused[address] = name
            self.executor.tell(
                f"worker {name} at {address} is not used, because its vislam2tag or libraries have other versions"
            )

    def _lost(self) -> OutputError:
        return OutputError(f"the scheduler at {self.scheduler} is lost; run the same command again when it is back")


def _on_worker(work: Callable[[Any], Any], job: Job[Any]) -> Worked[Any]:
    """Process a session; one thread of a worker computes while another waits for a store."""
    keep_freed_memory()
    with _ONE_LOOKS:
        code = job.code_here()
    if code != job.code:
        worker = import_extra("distributed").get_worker()
        raise OtherCodeError(worker.address, str(worker.name))
    return worked(work, job, limited=True)
