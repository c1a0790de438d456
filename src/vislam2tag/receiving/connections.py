"""Connections of the receiving server: none waits for ever, none shuts others out, whoever makes them."""

from __future__ import annotations

import asyncio
import math
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from typing import Literal

import uvicorn
from starlette.applications import Starlette
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER_S = 10.0
"""A request's header must be whole so soon after its connection was made."""
CLOSING_S = 10.0
"""An answer must be taken off so soon."""
MOST_CONNECTIONS = 200
"""At once; half of what the system lets a program open, where that is less. One more ends that which waits longest."""
MOST_OF_AN_ADDRESS = 20
"""At once; one more is closed. A browser opens six."""
MINUTE_S, REPORTED_A_MINUTE = 60.0, 10
"""Of requests without the token so many are told a minute."""
GRACE_S = 2
"""Requests still running when the server is ended have so long; what they brought is kept anyway."""
_WAITING = 512
"""The system keeps so many connections waiting to be taken."""
_ACCEPTED_AT_ONCE = 32
"""asyncio takes so many connections before it looks at the first: each needs a file handle meanwhile."""


@dataclass
class RefusalLog:
    """Reports requests without a token, but not of each: of some in a minute, then how many more there were."""

    report: Callable[[str, str], None]
    clock: Callable[[], float]
    _since_s: float = -math.inf
    _count: int = 0

    def refused(self, address: str, message: str) -> None:
        """Tell of a refusal, or count it only."""
        if self.clock() - self._since_s >= MINUTE_S:
            if self._count > REPORTED_A_MINUTE:
                self.report("", f"{self._count - REPORTED_A_MINUTE} more requests without the token in a minute")
            self._since_s, self._count = self.clock(), 0
        self._count += 1
        if self._count <= REPORTED_A_MINUTE:
            self.report(address, message)


def open_file_limit() -> int:
    """How many files and connections the system lets this program open at once."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows, which has no such limit
        return 2 * MOST_CONNECTIONS
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


class BoundedConnection(H11Protocol):
    """One connection, which brings one request."""

    most = min(MOST_CONNECTIONS, open_file_limit() // 2)
    _deadline: asyncio.TimerHandle

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection in, or close it where there are too many."""
        super().connection_made(transport)
        self.address = network_of(self.client[0] if self.client else "")
        self._deadline = self.loop.call_later(HEADER_S, self._end)
        others = [each for each in self.connections if isinstance(each, BoundedConnection) and each is not self]
        if sum(each.address == self.address for each in others) >= MOST_OF_AN_ADDRESS:
            self._end()
        elif len(others) >= self.most:
            waiting = [each for each in (*others, self) if each.cycle is None]
            min(waiting, key=lambda each: each._deadline.when())._end()

    def handle_events(self) -> None:
        """Stop the clock once there is a request: from then on the application has its own for each read."""
        super().handle_events()
        if self.cycle is not None and not self.cycle.response_complete:
            self._deadline.cancel()

    def on_response_complete(self) -> None:
        """Leave time to take the answer off."""
        super().on_response_complete()
        self._deadline.cancel()
        self._deadline = self.loop.call_later(CLOSING_S, self._end)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def _end(self) -> None:
        self.connections.discard(self)
        self.transport.abort()


def network_of(host: str) -> str:
    """What counts as one address: an address of IPv4, or the network of 64 bits that is one user's in IPv6."""
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if isinstance(address, IPv6Address):
        mapped = address.ipv4_mapped
        return str(mapped) if mapped else str(IPv6Address(int(address) >> 64 << 64))
    return str(address)


class _Server(uvicorn.Server):
    """A server that Ctrl-C ends, and that is the end of it: uvicorn's own would send itself the signal again."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        if threading.current_thread() is not threading.main_thread():  # only that one hears signals
            yield
            return
        before = {number: signal.signal(number, self.handle_exit) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Let the system keep more connections waiting than are taken at once."""
        await super().startup(sockets)
        for opened in sockets or ():
            opened.listen(_WAITING)


@contextmanager
def serving(app: Starlette, opened: socket.socket) -> Iterator[None]:
    """Serve an application on an open socket in a thread of its own, until the block ends."""
    server = _server(app, BoundedConnection, "off")
    thread = threading.Thread(target=server.run, kwargs={"sockets": [opened]}, name="receiving")
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()


def serve(
    app: Starlette,
    opened: socket.socket,
    connection: type[H11Protocol] = BoundedConnection,
    lifespan: Literal["on", "off"] = "off",
) -> None:
    """Serve an application on an open socket until SIGINT or SIGTERM."""
    _server(app, connection, lifespan).run(sockets=[opened])


def _server(app: Starlette, connection: type[H11Protocol], lifespan: Literal["on", "off"]) -> _Server:
    config = uvicorn.Config(
        app,
        log_level="critical",
        access_log=False,
        lifespan=lifespan,
        timeout_graceful_shutdown=GRACE_S,
        http=connection,
        ws="none",
        backlog=_ACCEPTED_AT_ONCE,
    )
    return _Server(config)
