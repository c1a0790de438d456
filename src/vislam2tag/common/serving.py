"""Our servers: limits of connections, and limits of requests' bodies.

They are the same for `receive`, the studio and `locate --serve`. A connection waits until the application admits it:
after a proof of the token, a right cookie, or a complete request. Waiting and admitted connections have separate room,
so strangers cannot take the room of senders that are known.
"""

from __future__ import annotations

import asyncio
import math
import signal
import socket
import threading
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from itertools import count
from typing import Any, Literal

import uvicorn
from starlette.applications import Starlette
from starlette.convertors import IntegerConvertor, register_url_convertor
from starlette.requests import ClientDisconnect, Request
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

MAX_CONNECTIONS = 200
MINUTE_S, REPORTED_A_MINUTE = 60.0, 10
"""This many requests without the token are reported each minute."""
GRACE_S = 2
"""Requests still running when the server is ended have so long; what they brought is kept anyway."""
_WAITING = 512
"""The system keeps so many connections waiting to be taken."""
_ACCEPTED_AT_ONCE = 32
"""asyncio takes so many connections before it looks at the first: each needs a file handle meanwhile."""


@dataclass
class RefusalLog:
    """Reports requests without a token: some of them each minute, then the number of the others."""

    report: Callable[[str, str], None]
    clock: Callable[[], float]
    _since_s: float = -math.inf
    _count: int = 0

    def refused(self, address: str, message: str) -> None:
        """Report a refusal, or only count it."""
        if self.clock() - self._since_s >= MINUTE_S:
            if self._count > REPORTED_A_MINUTE:
                self.report("", f"{self._count - REPORTED_A_MINUTE} more requests without the token within a minute")
            self._since_s, self._count = self.clock(), 0
        self._count += 1
        if self._count <= REPORTED_A_MINUTE:
            self.report(address, message)


def open_file_limit() -> int:
    """How many files and connections the system lets this program open at once."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows, which has no such limit
        return 4 * MAX_CONNECTIONS
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


@dataclass(frozen=True)
class Limits:
    """How many connections a server keeps, and for how long."""

    waiting: int
    """Connections that are not admitted. One more ends the oldest of the network that has most of them."""
    admitted: int
    idle_s: float = 10.0
    """A header must be complete within this time; within each such time, some of an answer must be taken off."""


def default_limits() -> Limits:
    """Share :data:`MAX_CONNECTIONS`, or a quarter of the files that the system lets a program open if that is less.

    The studio runs two servers, and needs files for its work.
    """
    half = max(1, min(MAX_CONNECTIONS, open_file_limit() // 4) // 2)
    return Limits(waiting=half, admitted=half)


class LimitedConfig(uvicorn.Config):
    """uvicorn's configuration with the limits of connections."""

    def __init__(self, app: Starlette, limits: Limits, lifespan: Literal["on", "off"] = "off") -> None:
        super().__init__(
            app,
            log_level="critical",
            access_log=False,
            lifespan=lifespan,
            timeout_graceful_shutdown=GRACE_S,
            http=LimitedConnection,
            ws="none",
            backlog=_ACCEPTED_AT_ONCE,
        )
        self.limits = limits


class LimitedConnection(H11Protocol):
    """One connection, which brings one request after the other; the application finds it in the request's state."""

    _numbers = count()

    def __init__(
        self,
        config: LimitedConfig,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, "connection": self}, _loop)
        self.limits = config.limits
        self.admitted = False
        self._number = next(self._numbers)
        self._deadline: asyncio.TimerHandle | None = None
        self._unsent = 0

    def admit(self) -> bool:
        """Count this connection among the admitted; False if there are too many of them."""
        if not self.admitted:
            self.admitted = sum(each.admitted for each in self._all()) < self.limits.admitted
        return self.admitted

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept a connection, and end another if too many wait."""
        super().connection_made(transport)
        self.network = network_of(self.client[0] if self.client else "")
        self._start_clock()
        waiting = [each for each in self._all() if not each.admitted]
        if len(waiting) > self.limits.waiting:
            sizes = Counter(each.network for each in waiting)
            max(waiting, key=lambda each: (sizes[each.network], -each._number))._end()

    def handle_events(self) -> None:
        """Stop the clock once a request is complete: from then on the application limits each read."""
        super().handle_events()
        if self._has_request() and not self.flow.write_paused:
            self._stop_clock()

    def on_response_complete(self) -> None:
        """Leave time to take the answer off, and for the header of the next request."""
        self._start_clock()
        super().on_response_complete()

    def pause_writing(self) -> None:
        """Leave time to take some of a long answer off."""
        super().pause_writing()
        self._start_clock()

    def resume_writing(self) -> None:
        """Go on with a long answer."""
        super().resume_writing()
        if self._has_request():
            self._stop_clock()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_clock()
        super().connection_lost(exc)

    def _all(self) -> list[LimitedConnection]:
        return [each for each in self.connections if isinstance(each, LimitedConnection)]

    def _has_request(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def _start_clock(self) -> None:
        self._stop_clock()
        self._unsent = self.transport.get_write_buffer_size()
        self._deadline = self.loop.call_later(self.limits.idle_s, self._time_over)

    def _stop_clock(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()

    def _time_over(self) -> None:
        if 0 < self.transport.get_write_buffer_size() < self._unsent:  # some of the answer was taken off
            self._start_clock()
        else:
            self._end()

    def _end(self) -> None:
        self.connections.discard(self)
        self.transport.abort()


def admit(request: Request) -> bool:
    """Admit a request's connection; False if too many are admitted. True for a request that came without a server."""
    connection = getattr(request.state, "connection", None)
    return not isinstance(connection, LimitedConnection) or connection.admit()


def network_of(host: str) -> str:
    """What counts as one sender: an address of IPv4, or the 64-bit network of an address of IPv6."""
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
def serving(
    app: Starlette, opened: socket.socket, limits: Limits | None = None, lifespan: Literal["on", "off"] = "off"
) -> Iterator[None]:
    """Serve an application on an open socket in a thread of its own, until the block ends."""
    server = _Server(LimitedConfig(app, limits or default_limits(), lifespan))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [opened]}, name="receiving")
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()


def serve(app: Starlette, opened: socket.socket, lifespan: Literal["on", "off"] = "off") -> None:
    """Serve an application on an open socket until SIGINT or SIGTERM."""
    _Server(LimitedConfig(app, default_limits(), lifespan)).run(sockets=[opened])


class ShortNumber(IntegerConvertor):
    """A whole number in a path, ``{number:short}``; a longer one than any of ours is another path."""

    regex = "-?[0-9]{1,9}"

    def to_string(self, value: int) -> str:
        """Write a number into a path."""
        return str(value)


register_url_convertor("short", ShortNumber())


class BrokenBodyError(Exception):
    """A body did not arrive completely, or not in time."""


class LargeBodyError(Exception):
    """A body has more bytes than a request may bring."""


async def whole_body(request: Request, most: int, seconds: float) -> bytes:
    """Return a body of ``most`` bytes at most, which must be complete within so many seconds.

    A larger body is read and dropped before it is refused: clients read no answer while they send.
    Raises LargeBodyError or BrokenBodyError.
    """
    content, size = bytearray(), 0
    try:
        async with asyncio.timeout(seconds):
            async for block in request.stream():
                size += len(block)
                if size <= most:
                    content += block
    except (TimeoutError, ClientDisconnect):
        raise BrokenBodyError from None
    if size > most:
        raise LargeBodyError
    return bytes(content)


async def blocks(request: Request, silent_s: float) -> AsyncIterator[bytes]:
    """Yield a body as it comes; raises TimeoutError if nothing comes for ``silent_s`` seconds."""
    stream = request.stream()
    while True:
        try:
            async with asyncio.timeout(silent_s):
                block = await anext(stream)
        except StopAsyncIteration:
            return
        yield block


async def drain(request: Request, most: int, silent_s: float) -> None:
    """Read and drop what a client still sends, ``most`` bytes at most: it reads no answer before."""
    left = most
    try:
        async for block in blocks(request, silent_s):
            left -= len(block)
            if left < 0:
                return
    except (ClientDisconnect, TimeoutError, RuntimeError):  # gone, silent, or all was read before
        return
