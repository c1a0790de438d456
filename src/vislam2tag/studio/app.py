"""The HTTP side of the studio: requests into calls of the endpoints, answers and refusals; starting and ending it."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from functools import partial
from typing import TypeVar

from pydantic import ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from vislam2tag.common.addresses import url_for
from vislam2tag.common.errors import OutputError, SessionError, SurveyError, UsageError, missing_extra
from vislam2tag.common.records import FiniteRecord
from vislam2tag.common.serving import BrokenBodyError, LargeBodyError, admit, serve, whole_body
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.site.corrections.conflicts import Conflict, ConflictError
from vislam2tag.site.corrections.edits import ChangedMeanwhileError
from vislam2tag.studio.collecting import Handover
from vislam2tag.studio.corrections_view import corrections_view
from vislam2tag.studio.endpoints import Studio
from vislam2tag.studio.events import Events
from vislam2tag.studio.fault_view import Diagnoses
from vislam2tag.studio.guard import BODIES, MOST_BODY, PAGE, Guard, OwnHeaders
from vislam2tag.studio.jobs import JobQueue, Worker
from vislam2tag.studio.preparing import MOST_FILE, DroppedFiles
from vislam2tag.studio.routing import ENDPOINTS, Binary, Endpoint
from vislam2tag.studio.work_messages import EnterRequest, Problem
from vislam2tag.studio.workspace import Workspace

_Record = TypeVar("_Record", bound=FiniteRecord)
BODY_S = 30.0
"""Time limit for a request's body ..."""
FILE_S = 600.0
"""... and for a file."""
_CODES: dict[type[Exception], tuple[int, str]] = {
    ChangedMeanwhileError: (409, "stale"),
    ConflictError: (409, "conflict"),
    SurveyError: (422, "invalid"),
    UsageError: (422, "invalid"),
    SessionError: (422, "invalid"),
    OutputError: (409, "busy"),
}
_HTTP_CODES = {403: "forbidden", 404: "not_found", 405: "method"}


class RefusedError(Exception):
    """An answer that refuses a request."""

    def __init__(self, status: int, code: str, message: str, conflicts: Sequence[Conflict] = ()) -> None:
        super().__init__(message)
        self.status, self.code, self.message, self.conflicts = status, code, message, conflicts


def studio_app(studio: Studio) -> Starlette:
    """The application that a server runs; it watches the survey's files while it runs."""

    @asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncIterator[None]:
        watching = asyncio.create_task(studio.events.watch())
        try:
            yield
        finally:
            watching.cancel()

    def let_in(handler: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
        return partial(_let_in, studio, handler)

    routes = [
        Route("/", _page, methods=["GET"]),
        Route("/assets/{name}", _asset, methods=["GET"]),
        Route("/api/enter", partial(_enter, studio), methods=["POST"]),
        Route("/api/events", let_in(partial(_events, studio)), methods=["GET"]),
        *(
            Route(endpoint.path, let_in(partial(_answer, studio, endpoint)), methods=[endpoint.method])
            for endpoint in ENDPOINTS
        ),
    ]
    return Starlette(
        routes=routes,
        lifespan=lifespan,
        middleware=[Middleware(OwnHeaders)],
        exception_handlers={RefusedError: partial(_refuse, studio), HTTPException: partial(_refuse, studio)},
    )


async def _page(request: Request) -> Response:
    del request
    return FileResponse(PAGE / "index.html", headers={"Cache-Control": "no-cache"})


async def _asset(request: Request) -> Response:
    name = str(request.path_params["name"])
    file = next((file for file in (PAGE / "assets").glob("*") if file.name == name), None)
    if file is None:
        raise RefusedError(404, "not_found", "this file does not exist")
    return FileResponse(file, headers={"Cache-Control": "no-cache"})


async def _enter(studio: Studio, request: Request) -> Response:
    """Exchange a token for a cookie; a browser that has one needs no other, and leaves the token for others."""
    _refuse_strangers(studio, request)
    token = (await _body_record(EnterRequest, request)).token
    if _is_known(studio, request):
        return Response(status_code=204)
    cookie = studio.guard.enter(token)
    if cookie is None:
        message = "this link was already used; get another one in a browser that has access, or restart the studio"
        raise RefusedError(401, "link_used", message)
    return Response(status_code=204, headers={"Set-Cookie": cookie})


async def _let_in(studio: Studio, handler: Callable[[Request], Awaitable[Response]], request: Request) -> Response:
    _refuse_strangers(studio, request)
    if not _is_known(studio, request):
        raise RefusedError(401, "entry_needed", "open the address that the terminal shows")
    if not admit(request):
        raise RefusedError(429, "busy", "too many pages are open at once; close some of them")
    return await handler(request)


def _is_known(studio: Studio, request: Request) -> bool:
    return studio.guard.knows(request.headers.get("cookie", ""))


def _refuse_strangers(studio: Studio, request: Request) -> None:
    refusal = studio.guard.refusal(request.method, dict(request.headers))
    if refusal is not None:
        raise RefusedError(403, "forbidden", refusal)


async def _events(studio: Studio, request: Request) -> Response:
    del request
    return StreamingResponse(
        studio.events.stream(), media_type="text/event-stream", headers={"Cache-Control": "no-store"}
    )


async def _answer(studio: Studio, endpoint: Endpoint, request: Request) -> Response:
    if endpoint.method == "PUT" and "if-match" not in request.headers:
        raise RefusedError(428, "invalid", "the header If-Match must contain the version that was changed")
    try:
        query = endpoint.query.model_validate(dict(request.query_params))
        body = None if endpoint.body is None else await _body_record(endpoint.body, request)
        content = await _file(request) if endpoint.takes_file else b""
        asked = {"body": body, "version": request.headers.get("if-match"), "content": content}
        found = await run_in_threadpool(endpoint.answered, studio, query, request.path_params | asked)
    except RefusedError:
        raise
    except Exception as error:
        raise _refusal(error) from error
    return _response(request, endpoint, found)


def _invalid(error: ValidationError) -> RefusedError:
    problem = error.errors(include_url=False)[0]
    if problem["type"] == "json_invalid":
        return RefusedError(400, "invalid", "the request is not valid JSON")
    place = ".".join(map(str, problem["loc"])) or "the request"
    return RefusedError(422, "invalid", f"{place}: {problem['msg']}")


def _refusal(error: Exception) -> RefusedError:
    """The refusal for an endpoint's exception."""
    if isinstance(error, ValidationError):
        return _invalid(error)
    if isinstance(error, KeyError):
        return RefusedError(404, "not_found", f"{error.args[0]} does not exist; reload the page")
    lacks = missing_extra(error) if isinstance(error, ModuleNotFoundError) else None
    if lacks is not None:
        return RefusedError(422, "invalid", f"this {lacks}")
    for kind, (status, code) in _CODES.items():
        if isinstance(error, kind):
            return RefusedError(status, code, str(error), error.conflicts if isinstance(error, ConflictError) else ())
    return RefusedError(500, "unexpected", unexpected("studio", error))


def _response(request: Request, endpoint: Endpoint, found: FiniteRecord | Binary) -> Response:
    if isinstance(found, FiniteRecord):
        return Response(found.model_dump_json(), endpoint.status, {"Cache-Control": "no-store"}, "application/json")
    headers = {"Cache-Control": "no-cache", **found.headers}
    if found.version is not None:
        headers["ETag"] = f'"{found.version}"'
        if request.headers.get("if-none-match") == headers["ETag"]:
            return Response(status_code=304, headers=headers)
    return Response(found.content, endpoint.status, headers, found.media_type)


async def _body_record(kind: type[_Record], request: Request) -> _Record:
    """Read a JSON body within the limits of time and size; empty counts as an empty object."""
    if request.headers.get("content-type", BODIES[0]).partition(";")[0] != BODIES[0]:
        raise RefusedError(403, "forbidden", f"this change must be sent as {BODIES[0]}")
    try:
        return kind.model_validate_json(await _body(request, MOST_BODY, BODY_S) or b"{}")
    except ValidationError as error:
        raise _invalid(error) from error


async def _file(request: Request) -> bytes:
    if request.headers.get("content-type", "").partition(";")[0] != BODIES[1]:
        raise RefusedError(403, "forbidden", f"a file must be sent as {BODIES[1]}")
    return await _body(request, MOST_FILE, FILE_S)


async def _body(request: Request, most: int, seconds: float) -> bytes:
    try:
        return await whole_body(request, most, seconds)
    except BrokenBodyError:
        raise RefusedError(400, "invalid", "the request was interrupted") from None
    except LargeBodyError:
        raise RefusedError(413, "too_large", f"a request may have at most {most >> 20} MiB") from None


async def _refuse(studio: Studio, request: Request, error: Exception) -> Response:
    del request
    corrections, conflicts = None, list[Conflict]()
    if isinstance(error, RefusedError):
        status, code, message = error.status, error.code, error.message
        conflicts = list(error.conflicts)
        if code in ("stale", "conflict"):
            await studio.events.look()  # the page reads the file now, and must get all later events
            corrections = await run_in_threadpool(corrections_view, studio.workspace)
    else:
        status = error.status_code if isinstance(error, HTTPException) else 500
        code, message = _HTTP_CODES.get(status, "unexpected"), "this address or method does not exist"
    problem = Problem(code=code, message=message, conflicts=conflicts, corrections=corrections)
    content = problem.model_dump(mode="json")
    return JSONResponse(content, status, {"Cache-Control": "no-store"})


@contextmanager
def opened_studio(
    workspace: Workspace, host: str, opened: socket.socket, workers: int, command: str = ""
) -> Iterator[tuple[str, Starlette]]:
    """The address with a first token, and the application; its jobs end at the end of the block.

    The page shows ``command`` after the studio has ended, to start it again.
    """
    events = Events(workspace.refresh)
    guard = Guard(host, opened.getsockname()[1])
    jobs = JobQueue(workspace, events.publish, workers)
    handover = Handover(workspace, jobs, events.publish)
    dropped, worker = DroppedFiles(), Worker()
    try:
        studio = Studio(workspace, jobs, Diagnoses(workspace), events, guard, handover, dropped, worker, command)
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
