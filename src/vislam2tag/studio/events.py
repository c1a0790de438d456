"""What the server tells all pages without being asked: server-sent events."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress

from pydantic import BaseModel

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.messages import Versions

ALIVE_S = 15.0
"""So often a connection without events gets a comment, so that nothing on the way takes it for dead."""
WATCH_S = 1.0
"""So often files are looked at, which the terminal or another studio may have changed."""
_WAITING = 1000
"""Events kept for a page that takes none; then it is left, and comes again."""


class Events:
    """Tells every page that listens; from any thread, once the server runs."""

    def __init__(self, versions: Callable[[], Versions]) -> None:
        """Let ``versions`` look whether anything changed."""
        self._versions, self._last = versions, versions()
        self._listeners: set[asyncio.Queue[str]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    def publish(self, name: str, record: FiniteRecord) -> None:
        """Tell all pages."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._tell, _event(name, record))

    def _tell(self, event: str) -> None:
        for queue in list(self._listeners):
            try:
                queue.put_nowait(event)
            except asyncio.QueueFull:
                self._listeners.discard(queue)

    async def watch(self) -> None:
        """Look at the files again and again, and tell where they changed."""
        self._loop = asyncio.get_running_loop()
        while True:
            with suppress(OSError):  # a file that is just being replaced
                await self.look()
            await asyncio.sleep(WATCH_S)

    async def look(self) -> None:
        """Look at the files now."""
        versions = await asyncio.to_thread(self._versions)
        if versions != self._last:
            self._last = versions
            self._tell(_event("versions", versions))

    async def stream(self) -> AsyncIterator[str]:
        """Events for one page, for as long as it listens."""
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
