"""The fork server from which worker processes come; imports nothing heavy, so that it can be started first.

The server imports once what all workers need. Started before this process imports its own share, the two overlap:
start-up is a good part of a small survey's run.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext

WORKER_MODULE = "vislam2tag.pipeline.session"
ONE_THREAD = {"POLARS_MAX_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Workers use one core each, so that they do not compete for them."""


def start_server() -> ForkServerContext:
    """Start the fork server where it does not run yet, without waiting for it; return its context.

    Server and workers hold interrupts back for good: they concern the main process, which ends its workers itself.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([WORKER_MODULE])
    with _environment(ONE_THREAD), _interrupts_held_back():
        forkserver.ensure_running()
    return context


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
