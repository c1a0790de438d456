"""Requests within limits: sizes and times of bodies, and lengths of numbers in paths.

They are the same for `receive`, the studio and `locate --serve`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from starlette.convertors import IntegerConvertor, register_url_convertor
from starlette.requests import ClientDisconnect, Request


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
