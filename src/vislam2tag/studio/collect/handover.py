"""Phones hand sessions over to the studio as to ``vislam2tag receive``; each is mapped as soon as it is there."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress

import segno

from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.collect.messages import CollectingView, ReceivedSession
from vislam2tag.studio.jobs import JobQueue
from vislam2tag.studio.receiving.address import EVERYWHERE, listen, url_for
from vislam2tag.studio.receiving.connections import serving
from vislam2tag.studio.receiving.filing import FiledSession
from vislam2tag.studio.receiving.server import Listener, Receiver
from vislam2tag.studio.receiving.token import Guard, grouped, new_token
from vislam2tag.studio.receiving.uploads import Uploads
from vislam2tag.studio.work_messages import JobRequest
from vislam2tag.studio.workspace import Workspace

MOST_BYTES = 1_000_000_000
"""Greatest zip taken; it may unpack to eight times as much, as with ``vislam2tag receive``."""
TOLD = 50
"""Refusals that are still told."""


class Handover:
    """Takes sessions from phones between :meth:`open` and :meth:`close`; used by several threads."""

    def __init__(self, workspace: Workspace, jobs: JobQueue, publish: Callable[[str, FiniteRecord], None]) -> None:
        """Listen to nobody yet."""
        self._workspace, self._jobs, self._publish = workspace, jobs, publish
        self._lock = threading.Lock()
        self._running = ExitStack()
        self._url: str | None = None
        self._token = ""
        self._received: list[ReceivedSession] = []
        self._refused: list[str] = []

    def open(self) -> CollectingView:
        """Let phones on the network hand over; raises OutputError where another program receives for this survey."""
        with self._lock:
            if self._url is None:
                token = new_token()
                with ExitStack() as stack:
                    opened = stack.enter_context(listen(EVERYWHERE[0], 0))
                    uploads = stack.enter_context(Uploads(self._workspace.root, MOST_BYTES, 8 * MOST_BYTES))
                    listener = Listener(filed=self._filed, refused=self._refuse)
                    app = Receiver(uploads, Guard(token), listener).app()
                    stack.enter_context(serving(app, opened))
                    self._url, self._token = url_for(EVERYWHERE[0], opened.getsockname()[1], token), token
                    self._running = stack.pop_all()
        return self.view()

    def close(self) -> CollectingView:
        """Let nobody hand over any more; what was received stays."""
        with self._lock:
            self._url, self._token = None, ""
            self._running.close()
        return self.view()

    def view(self) -> CollectingView:
        """What the page shows."""
        url = self._url
        rows = segno.make(url, error="m", micro=False).matrix if url is not None else ()
        return CollectingView(
            url=url,
            token=grouped(self._token),
            code=["".join(map(str, row)) for row in rows],
            received=list(self._received),
            refused=list(self._refused),
        )

    def _filed(self, _name: str, filed: FiledSession) -> None:
        self._received.append(ReceivedSession(path=filed.path, already=filed.already))
        self._workspace.refresh()
        with suppress(UsageError):  # so many jobs wait that one of them maps this session, too
            self._jobs.submit(JobRequest(kind="process"))
        self._publish("collecting", self.view())

    def _refuse(self, address: str, message: str) -> None:
        self._refused = [*self._refused, f"{address}: {message}"][-TOLD:]
        self._publish("collecting", self.view())
