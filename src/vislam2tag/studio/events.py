"""Server-sent events for all pages."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress

from pydantic import BaseModel

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.messages import Versions

ALIVE_S = 15.0
"""Interval of comments on idle connections, so that they are not closed on the way."""
WATCH_S = 1.0
"""Interval for checking files, which other programs may have changed."""
_WAITING = 1000
"""Maximum number of queued events for a page; beyond that it is disconnected, and reconnects."""


class Events:
    """Sends events to all listening pages, from any thread while the server runs."""

    def __init__(self, versions: Callable[[], Versions]) -> None:
        """Use ``versions`` to check for changes."""
        self._versions, self._last = versions, versions()
        self._listeners: set[asyncio.Queue[str]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    def publish(self, name: str, record: FiniteRecord) -> None:
        """Send an event to all pages."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._tell, _event(name, record))

    def _tell(self, event: str) -> None:
        for queue in list(self._listeners):
            try:
                queue.put_nowait(event)
            except asyncio.QueueFull:
                self._listeners.discard(queue)

    async def watch(self) -> None:
        """Check the files repeatedly, and send an event if they changed."""
        self._loop = asyncio.get_running_loop()
        while True:
            with suppress(OSError):  # a file that is being replaced
                await self.look()
            await asyncio.sleep(WATCH_S)

    async def look(self) -> None:
        """Check the files now."""
        versions = await asyncio.to_thread(self._versions)
        if versions != self._last:
            self._last = versions
            self._tell(_event("versions", versions))

    async def stream(self) -> AsyncIterator[str]:
        """Events for one page while it listens."""
        queue: asyncio.Queue[str] = asyncio.Queue(_WAITING)
        self._listeners.add(queue)
        try:
            yield _event("hello", await asyncio.to_thread(self._versions))
            while queue in self._listeners:
                try:
                    async with asyncio.timeout(ALIVE_S):
                        event = await queue.get()
                    yield event
                except TimeoutError:
                    yield ": alive\n\n"
        finally:
            self._listeners.discard(queue)


def _event(name: str, record: BaseModel) -> str:
    return f"event: {name}\ndata: {record.model_dump_json()}\n\n"
