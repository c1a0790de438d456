"""Connections as a server sees them, over loopback in this process."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest
import uvicorn
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route
from uvicorn.server import ServerState

from vislam2tag.receiving import connections
from vislam2tag.receiving.connections import MOST_OF_AN_ADDRESS, BoundedConnection, network_of

Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Connect = Callable[[str], Awaitable[Stream]]


def with_server(visit: Callable[[Connect], Awaitable[None]]) -> None:
    """Run a server of bounded connections, and what visits it: it connects from an address of its choice."""

    async def run() -> None:
        app = Starlette(routes=[Route("/", lambda _: PlainTextResponse("hello"))])
        config, state = uvicorn.Config(app, log_level="critical", ws="none"), ServerState()
        loop = asyncio.get_running_loop()
        server = await loop.create_server(lambda: BoundedConnection(config, state, {}), "127.0.0.1", 0)
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


async def asked(stream: Stream) -> bytes:
    """What a connection answers; nothing where it was closed."""
    reader, writer = stream
    with suppress(ConnectionError):
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        await writer.drain()
        return (await reader.read()).partition(b"\r\n\r\n")[2]
    return b""


async def is_closed(stream: Stream) -> bool:
    with suppress(ConnectionError):
        return await stream[0].read(1) == b""
    return True


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: x\r\nX-Never: "])
def test_a_header_must_be_whole_in_time(monkeypatch: pytest.MonkeyPatch, sent: bytes) -> None:
    monkeypatch.setattr(connections, "HEADER_S", 0.05)

    async def visit(connect: Connect) -> None:
        stream = await connect("127.0.0.1")
        stream[1].write(sent)
        assert await is_closed(stream)

    with_server(visit)


def test_a_body_that_nobody_asked_for_does_not_hold_a_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "CLOSING_S", 0.05)

    async def visit(connect: Connect) -> None:
        reader, writer = await connect("127.0.0.1")
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\nContent-Length: 9999\r\n\r\n")
        with suppress(ConnectionError):
            while await asyncio.wait_for(reader.read(1000), timeout=30):
                writer.write(b"x")

    with_server(visit)


def test_an_address_holds_so_many_connections_and_others_are_served() -> None:
    async def visit(connect: Connect) -> None:
        for _ in range(MOST_OF_AN_ADDRESS):
            await connect("127.0.0.2")
        assert await asked(await connect("127.0.0.2")) == b""
        assert await asked(await connect("127.0.0.3")) == b"hello"

    with_server(visit)


def test_one_too_many_ends_the_one_that_waits_longest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BoundedConnection, "most", 3)

    async def visit(connect: Connect) -> None:
        streams = [await connect(f"127.0.0.{number}") for number in (2, 3, 4, 5)]
        assert await is_closed(streams[0])
        assert [await asked(stream) for stream in streams[1:]] == [b"hello"] * 3

    with_server(visit)


def test_an_address_is_what_one_user_has() -> None:
    assert network_of("192.168.1.7") == network_of("::ffff:192.168.1.7") == "192.168.1.7"
    assert network_of("fe80::1%eth0") == network_of("fe80::2") == "fe80::"
    assert network_of("2001:db8::1") != network_of("2001:db8:0:1::1")
    assert network_of("testclient") == "testclient"
