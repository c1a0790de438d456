"""Where sessions run: a Dask scheduler by its address, or a cluster that a small TOML file describes."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from vislam2tag.common.errors import OutputError, UsageError, first_line
from vislam2tag.common.extras import import_extra
from vislam2tag.common.files.plain_files import read_toml_values
from vislam2tag.common.records import FiniteRecord

_CONFIG = {
    "distributed.scheduler.allowed-failures": 2,  # the third worker that a session kills was the last
    "distributed.scheduler.worker-saturation": 1.0,  # none dies with sessions that it has not begun
    "distributed.nanny.pre-spawn-environ.POLARS_MAX_THREADS": 1,
}
_THREADS = 2
"""Of a worker, of one core: while one maps a session, the other fetches the next one or puts the one before."""
_CONNECT_S = 30
_PACKAGES = {"ssh": "asyncssh", "slurm": "dask-jobqueue"}
_REMOVED = {
    "kubernetes": "the cluster kind kubernetes was removed; use one Kubernetes Job for each survey "
    "(docs/how-to/many-surveys.md)"
}
"""What to use instead, by the name of a kind that earlier versions had."""


class ClusterSettings(FiniteRecord):
    """A cluster that is made for one command and ends with it."""

    kind: Literal["local", "ssh", "slurm"]
    """Processes of this machine, of others by SSH, or those that Slurm gives."""
    workers: int = Field(default=1, ge=1)
    """Worker processes, each of which maps one session at a time."""
    options: dict[str, Any] = {}
    """Further arguments of Dask's class, by name: ``hosts`` of SSHCluster, ``queue`` and ``memory`` of SLURMCluster."""


def read_cluster(file: Path) -> ClusterSettings:
    """Read the description of a cluster; raises UsageError that names file and entry."""
    try:
        values = read_toml_values(file)
        if str(values.get("kind")) in _REMOVED:
            raise UsageError(f"{file}: {_REMOVED[str(values['kind'])]}")
        return ClusterSettings.model_validate(values)
    except (OSError, ValueError) as error:
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise UsageError(f"{file}: {where}: {first['msg']}; see docs/how-to/fleets.md") from error
        raise UsageError(f"{file}: cannot be read: {first_line(error)}") from error


@contextmanager
def connected(scheduler: str | None, cluster: Path | None, tell: Callable[[str], None]) -> Iterator[Any]:
    """Yield a ``distributed.Client`` of a scheduler, or of a cluster that lasts as long as the block.

    ``tell`` is called with the address of the dashboard. Raises UsageError where neither or both are given, OutputError
    where the scheduler does not answer or the cluster cannot be made.
    """
    if (scheduler is None) == (cluster is None):
        raise UsageError("--executor dask: give --scheduler ADDRESS or --cluster FILE")
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
        raise UsageError(f"{file}: a cluster of the kind {settings.kind} needs {package}: pip install it") from error
    except Exception as error:  # of an SSH connection or a batch system: each has its own
        raise OutputError(f"{file}: the cluster cannot be made: {first_line(error)}") from error
    with cluster:
        yield cluster


def cluster_of(settings: ClusterSettings) -> Any:
    """Make a cluster. Raises ModuleNotFoundError where the package for its kind lacks, and what that package raises."""
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
