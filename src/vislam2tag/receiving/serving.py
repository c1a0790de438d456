"""Running the server until somebody ends it."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette

GRACE_S = 2
"""Requests still running when the server is ended have so long; what they brought is kept anyway."""


class _Server(uvicorn.Server):
    """A server that Ctrl-C ends, and that is the end of it: uvicorn's own would send itself the signal again."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        before = {number: signal.signal(number, self.handle_exit) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def serve(app: Starlette, opened: socket.socket) -> None:
    """Serve an application on an open socket until SIGINT or SIGTERM."""
    config = uvicorn.Config(
        app, log_level="critical", access_log=False, lifespan="off", timeout_graceful_shutdown=GRACE_S, http="h11"
    )
    _Server(config).run(sockets=[opened])
