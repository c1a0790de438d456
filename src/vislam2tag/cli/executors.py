"""Options that say where sessions run, and what they stand for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.pipeline.run.workers import Executor


class ExecutorName(Enum):
    """Where sessions run."""

    LOCAL = "local"
    DASK = "dask"


SchedulerAddress: TypeAlias = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, tcp://HOST:8786, for --executor dask.")
]
ClusterFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Cluster to make for --executor dask, as TOML (docs/how-to/fleets.md)."),
]


WhereSessionsRun: TypeAlias = Annotated[
    ExecutorName, typer.Option(help="Where sessions run: in --jobs processes here, or on a Dask cluster.")
]


@contextmanager
def executor_of(
    name: ExecutorName,
    scheduler: str | None,
    cluster: Path | None,
    jobs: int,
) -> Iterator[Executor]:
    """Yield what runs sessions as the options say; raises UsageError for options that do not go together."""
    if name is ExecutorName.LOCAL:
        from functools import partial

        from vislam2tag.pipeline.run.workers import process_all

        if scheduler is not None or cluster is not None:
            raise UsageError("--scheduler and --cluster go with --executor dask: add that")
        yield partial(process_all, workers=jobs)
        return
    from vislam2tag.pipeline.run.dask import DaskExecutor, connected

    tell = lambda line: say(line, err=True)
    with connected(scheduler, cluster, tell) as client:
        yield DaskExecutor(client, tell)
