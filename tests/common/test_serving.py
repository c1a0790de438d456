"""Connections as a server sees them, over loopback in this process."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from pathlib import Path

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from uvicorn.server import ServerState

from vislam2tag.common.addresses import code_of, listen, local_address, url_for
from vislam2tag.common.errors import UsageError
from vislam2tag.common.serving import (
    MAX_CONNECTIONS,
    LimitedConfig,
    LimitedConnection,
    Limits,
    admit,
    default_limits,
    network_of,
)

Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Connect = Callable[[str], Awaitable[Stream]]


PLENTY = 100
SHORT_S, LONG_S = 0.05, 600.0


async def hello(request: Request) -> Response:
    return PlainTextResponse("hello" if admit(request) else "busy")


async def endless(_request: Request) -> Response:
    async def content() -> AsyncIterator[bytes]:
        while True:
            yield bytes(1 << 16)
            await asyncio.sleep(0)

    return StreamingResponse(content())


def with_server(limits: Limits, visit: Callable[[Connect], Awaitable[None]], state: ServerState | None = None) -> None:
    """Run a server of limited connections, and what visits it: it connects from an address of its choice."""

    async def run() -> None:
        app = Starlette(
            routes=[
                Route("/", hello),
                Route("/stranger", lambda _: PlainTextResponse("hello")),
                Route("/endless", endless),
            ]
        )
        config, known = LimitedConfig(app, limits), state or ServerState()
        loop = asyncio.get_running_loop()
        server = await loop.create_server(lambda: LimitedConnection(config, known, {}), "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        opened: list[asyncio.StreamWriter] = []

        async def connect(own: str) -> Stream:
            reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(own, 0))
            opened.append(writer)
            return reader, writer

        try:
            await visit(connect)
        finally:
            for writer in opened:
                writer.transport.abort()
            server.close()

    asyncio.run(asyncio.wait_for(run(), timeout=60))


async def asked(stream: Stream, path: str = "/", closing: bool = True) -> bytes:
    """What a connection answers; nothing if it was closed."""
    reader, writer = stream
    with suppress(ConnectionError, asyncio.IncompleteReadError):
        writer.write(f"GET {path} HTTP/1.1\r\nHost: x\r\n{'Connection: close' if closing else 'X: y'}\r\n\r\n".encode())
        await writer.drain()
        header = await reader.readuntil(b"\r\n\r\n")
        length = next(line for line in header.lower().split(b"\r\n") if line.startswith(b"content-length: "))
        return await reader.readexactly(int(length.partition(b": ")[2]))
    return b""


async def is_closed(stream: Stream) -> bool:
    with suppress(ConnectionError):
        return await stream[0].read(1) == b""
    return True


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: x\r\nX-Never: "])
def test_a_header_must_be_complete_in_time(sent: bytes) -> None:
    async def visit(connect: Connect) -> None:
        stream = await connect("127.0.0.1")
        stream[1].write(sent)
        assert await is_closed(stream)

    with_server(Limits(PLENTY, PLENTY, SHORT_S), visit)


def shorten(state: ServerState) -> None:
    """Let the server's connections wait for a short time only, from the next time on."""
    for connection in state.connections:
        assert isinstance(connection, LimitedConnection)
        connection.limits = Limits(PLENTY, PLENTY, SHORT_S)


@pytest.mark.parametrize("path", ["/", "/stranger"])
def test_the_header_of_a_later_request_must_be_complete_in_time(path: str) -> None:
    state = ServerState()

    async def visit(connect: Connect) -> None:
        stream = await connect("127.0.0.1")
        assert await asked(stream, path, closing=False) == b"hello"
        shorten(state)
        assert await asked(stream, path, closing=False) == b"hello"
        stream[1].write(b"GET / HTTP/1.1\r\nX-Never: ")
        assert await is_closed(stream)

    with_server(Limits(PLENTY, PLENTY, LONG_S), visit, state)


def test_a_body_that_the_server_does_not_want_does_not_keep_a_connection() -> None:
    async def visit(connect: Connect) -> None:
        reader, writer = await connect("127.0.0.1")
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\nContent-Length: 9999\r\n\r\n")
        with suppress(ConnectionError):
            while await reader.read(1000):
                writer.write(b"x")

    with_server(Limits(PLENTY, PLENTY, SHORT_S), visit)


def test_an_answer_that_is_not_taken_off_ends_its_connection() -> None:
    state = ServerState()

    async def visit(connect: Connect) -> None:
        reader, writer = stream = await connect("127.0.0.1")
        assert await asked(stream, closing=False) == b"hello"
        shorten(state)
        writer.write(b"GET /endless HTTP/1.1\r\nHost: x\r\n\r\n")
        await reader.readuntil(b"\r\n\r\n")
        lost = asyncio.get_running_loop().create_future()
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        keep_asking(writer, lost)
        await lost

    def keep_asking(writer: asyncio.StreamWriter, lost: asyncio.Future[None]) -> None:
        """Write until the other side has ended the connection."""
        if writer.transport.is_closing():
            lost.set_result(None)
            return
        writer.write(b"x")
        asyncio.get_running_loop().call_later(SHORT_S, keep_asking, writer, lost)

    with_server(Limits(PLENTY, PLENTY, LONG_S), visit, state)


def test_one_too_many_ends_the_oldest_of_the_network_that_has_most() -> None:
    async def visit(connect: Connect) -> None:
        quiet = await connect("127.0.0.9")
        crowd = [await connect("127.0.0.2") for _ in range(3)]
        assert await is_closed(crowd[0])
        assert [await asked(stream) for stream in (quiet, *crowd[1:])] == [b"hello"] * 3

    with_server(Limits(waiting=3, admitted=PLENTY, idle_s=LONG_S), visit)


def test_admitted_connections_have_room_of_their_own() -> None:
    async def visit(connect: Connect) -> None:
        known = [await connect("127.0.0.2") for _ in range(2)]
        assert [await asked(stream, closing=False) for stream in known] == [b"hello"] * 2
        strangers = [await connect("127.0.0.2") for _ in range(10)]
        assert await is_closed(strangers[0])
        assert [await asked(stream) for stream in known] == [b"hello"] * 2, "none of them was ended"
        assert await asked(strangers[-1]) == b"hello"

    with_server(Limits(waiting=2, admitted=2, idle_s=LONG_S), visit)


def test_only_so_many_are_admitted_and_others_get_an_answer() -> None:
    async def visit(connect: Connect) -> None:
        known = await connect("127.0.0.2")
        assert await asked(known, closing=False) == b"hello"
        assert await asked(await connect("127.0.0.2")) == b"busy"
        assert await asked(known) == b"hello"
        assert await is_closed(known)
        assert await asked(await connect("127.0.0.2")) == b"hello"

    with_server(Limits(waiting=2, admitted=1, idle_s=LONG_S), visit)


def test_connections_leave_files_for_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    assert default_limits().waiting + default_limits().admitted <= MAX_CONNECTIONS
    monkeypatch.setattr("vislam2tag.common.serving.open_file_limit", lambda: 256)
    assert default_limits() == Limits(waiting=32, admitted=32)


def test_a_network_is_what_one_user_has() -> None:
    assert network_of("192.168.1.7") == network_of("::ffff:192.168.1.7") == "192.168.1.7"
    assert network_of("fe80::1%eth0") == network_of("fe80::2") == "fe80::"
    assert network_of("2001:db8::1") != network_of("2001:db8:0:1::1")
    assert network_of("testclient") == "testclient"


def test_the_token_stands_in_the_fragment() -> None:
    assert url_for("10.1.2.3", 8765, "ABCD") == "http://10.1.2.3:8765/#ABCD"
    assert url_for("fe80::1", 80, "ABCD") == "http://[fe80::1]:80/#ABCD"


def test_listening_everywhere_shows_an_address_that_phones_can_reach() -> None:
    assert url_for("0.0.0.0", 1, "A") == f"http://{local_address()}:1/#A"


def test_a_taken_port_is_told() -> None:
    with listen("127.0.0.1", 0) as taken, pytest.raises(UsageError, match=r"another program .*--port 0"):
        listen("127.0.0.1", taken.getsockname()[1])


def test_an_address_of_another_computer_is_told() -> None:
    with pytest.raises(UsageError, match=r"--host 192\.0\.2\.77"):
        listen("192.0.2.77", 0)


@pytest.mark.parametrize("host", ["../x", "a..b", "x" * 300, "\0"])
def test_what_is_no_host_is_told(host: str) -> None:
    with pytest.raises(UsageError, match="cannot listen there"):
        listen(host, 0)


def test_a_computer_without_network_shows_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def unreachable(self: socket.socket, address: object) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(socket.socket, "connect", unreachable)
    assert local_address() == "127.0.0.1"


def test_the_code_is_square_enough_for_a_terminal() -> None:
    lines = code_of("http://192.168.178.100:8765/#ABCDEFGHIJKLMNOP").splitlines()
    assert 15 <= len(lines) <= 25


def test_the_app_s_tests_read_the_code_that_is_shown_now() -> None:
    kept = Path(__file__).parents[2] / "android/app/src/test/resources/receive-code.txt"
    assert kept.read_text(encoding="utf-8") == code_of("http://192.168.1.20:8765/#ABCDEFGHIJKL2345")
