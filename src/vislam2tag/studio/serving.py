"""Starting the studio: survey, jobs and server together, and their end."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from starlette.applications import Starlette

from vislam2tag.studio.app import studio_app
from vislam2tag.studio.collect.handover import Handover
from vislam2tag.studio.diagnosis_view import Diagnoses
from vislam2tag.studio.endpoints import Studio
from vislam2tag.studio.events import Events
from vislam2tag.studio.guard import Guard
from vislam2tag.studio.jobs import JobQueue
from vislam2tag.studio.prepare.dropped import DroppedFiles
from vislam2tag.studio.prepare.work import Worker
from vislam2tag.studio.receiving.address import url_for
from vislam2tag.studio.receiving.connections import serve
from vislam2tag.studio.workspace import Workspace


@contextmanager
def opened_studio(
    workspace: Workspace, host: str, opened: socket.socket, workers: int
) -> Iterator[tuple[str, Starlette]]:
    """The address with a first token, and the application; its jobs end with the block."""
    events = Events(workspace.refresh)
    guard = Guard(host, opened.getsockname()[1])
    jobs = JobQueue(workspace, events.publish, workers)
    handover = Handover(workspace, jobs, events.publish)
    dropped, worker = DroppedFiles(), Worker()
    try:
        studio = Studio(workspace, jobs, Diagnoses(workspace), events, guard, handover, dropped, worker)
        yield url_for(host, guard.port, guard.invite()), studio_app(studio)
    finally:
        handover.close()
        worker.close()
        dropped.close()
        jobs.close()
        workspace.close()


def serve_studio(app: Starlette, opened: socket.socket) -> None:
    """Serve until SIGINT or SIGTERM; connections stay open for many requests, and for events."""
    serve(app, opened, lifespan="on")
