"""The HTTP side of receiving: requests into calls of :class:`Uploads`, and answers (docs/phone-format.md)."""

from __future__ import annotations

import asyncio
import errno
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from vislam2tag.receiving.filing import Filed
from vislam2tag.receiving.page import PAGE, PAGE_HEADERS
from vislam2tag.receiving.session_zip import RefusedZipError
from vislam2tag.receiving.token import Guard
from vislam2tag.receiving.uploads import UPLOAD_NAME, BusyError, Uploads, UploadState, WrongLengthError

MOST_PER_REQUEST = 8 << 20
"""Bytes of a zip that one request may bring."""
SILENT_S = 10.0
"""A request that brings nothing for so long is broken off: the phone may have left the network without a word."""
BUSY_S = 3
"""So long a client waits that finds its upload being written by a connection that may be dead."""
_HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"}
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


@dataclass(frozen=True)
class Listener:
    """Who is told what happens: bytes kept of an upload, a session filed, something refused (by whom)."""

    received: Callable[[str, int, int], None] = lambda _name, _received, _length: None
    filed: Callable[[str, Filed], None] = lambda _name, _filed: None
    refused: Callable[[str, str], None] = lambda _address, _message: None


class RefusalError(Exception):
    """An answer other than 200: its message, with the upload's state where that helps."""

    def __init__(
        self, status: int, message: str, headers: dict[str, str] | None = None, state: UploadState | None = None
    ) -> None:
        super().__init__(message)
        self.status, self.message, self.headers, self.state = status, message, headers or {}, state


class Receiver:
    """Answers the requests of phones and browsers for one survey."""

    def __init__(self, uploads: Uploads, guard: Guard, listener: Listener) -> None:
        self._uploads, self._guard, self._listener = uploads, guard, listener

    def app(self) -> Starlette:
        """The application that a server runs."""
        routes = [
            Route("/", self._page, methods=["GET"]),
            Route("/v1/uploads/{name}", self._state, methods=["GET"]),
            Route("/v1/uploads/{name}", self._append, methods=["PATCH"]),
        ]
        return Starlette(routes=routes, exception_handlers={RefusalError: self._refuse, HTTPException: self._unknown})

    async def _page(self, _request: Request) -> Response:
        return HTMLResponse(PAGE, headers=_HEADERS | PAGE_HEADERS)

    async def _state(self, request: Request) -> Response:
        return _answer(self._uploads.state(self._admitted(request)))

    async def _append(self, request: Request) -> Response:
        name = self._admitted(request)
        offset, length = _whole(request, "Upload-Offset"), _whole(request, "Upload-Length")
        self._check_length(request, length)
        state = self._uploads.state(name)
        if state.state == "filed":
            return _answer(state)
        try:
            with self._uploads.writing(name, length) as file:
                received = file.seek(0, 2)
                if offset != received:
                    state = UploadState("partial" if received else "none", received, length)
                    raise RefusalError(409, f"{received} bytes are here; go on from there", state=state)
                received = await self._keep(request, file.write, name, received, length)
            if received < length:
                return _answer(UploadState("partial", received, length))
            return await self._finish(name)
        except BusyError:
            message = "this upload is being written by another connection; ask again"
            raise RefusalError(423, message, {"Retry-After": str(BUSY_S)}) from None
        except WrongLengthError:
            raise RefusalError(400, "Upload-Length is another than when the upload began") from None
        except OSError as error:
            raise _storage_refusal(error) from error

    async def _keep(
        self, request: Request, write: Callable[[bytes], int | None], name: str, received: int, length: int
    ) -> int:
        """Write the body as it comes; returns how many bytes of the upload there are then."""
        most = min(length, received + MOST_PER_REQUEST)
        try:
            async for block in _blocks(request):
                if received + len(block) > most:
                    raise RefusalError(400 if most == length else 413, "the request brings more bytes than it may")
                _write_all(write, block)
                received += len(block)
                self._listener.received(name, received, length)
        except ClientDisconnect:
            raise RefusalError(400, "the request broke off; what came is kept") from None
        except TimeoutError:
            state = UploadState("partial" if received else "none", received, length)
            raise RefusalError(409, "nothing came for too long; go on from what is kept", state=state) from None
        return received

    async def _finish(self, name: str) -> Response:
        try:
            with self._uploads.finishing(name):
                filed = await run_in_threadpool(self._uploads.finish, name)
        except RefusedZipError as error:
            raise RefusalError(422, str(error)) from error
        self._listener.filed(name, filed)
        return _answer(self._uploads.state(name))

    def _admitted(self, request: Request) -> str:
        """The upload's name, once the token was right."""
        address = request.client.host if request.client else ""
        wait_s = self._guard.waiting_s(address)
        if wait_s:
            raise RefusalError(429, f"too many wrong tokens; wait {wait_s} s", {"Retry-After": str(wait_s)})
        scheme, _, shown = request.headers.get("Authorization", "").partition(" ")
        if scheme.lower() != "bearer" or not self._guard.admits(address, shown):
            message = "the token is missing or wrong; scan the code again"
            raise RefusalError(401, message, {"WWW-Authenticate": "Bearer"})
        name = str(request.path_params["name"])
        if not UPLOAD_NAME.fullmatch(name):
            raise RefusalError(400, "an upload is named by its SHA-256, 64 lower-case hexadecimal digits")
        return name

    def _check_length(self, request: Request, length: int) -> None:
        if length > self._uploads.max_bytes:
            most = f"{self._uploads.max_bytes / 1e6:,.0f} MB"
            raise RefusalError(413, f"the session is larger than {most}; start receive with a greater --max-size")
        if length == 0:
            raise RefusalError(400, "Upload-Length must be greater than 0")
        if int(request.headers.get("Content-Length", "0")) > MOST_PER_REQUEST:
            raise RefusalError(413, f"a request may bring {MOST_PER_REQUEST >> 20} MiB")

    async def _refuse(self, request: Request, error: Exception) -> Response:
        assert isinstance(error, RefusalError)
        if error.status not in (409, 423):
            self._listener.refused(request.client.host if request.client else "", error.message)
        content = {**(asdict(error.state) if error.state else {}), "message": error.message}
        return JSONResponse(content, error.status, headers=_HEADERS | error.headers)

    async def _unknown(self, _request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 500
        return JSONResponse({"message": "no such address or method; this is vislam2tag receive"}, status, _HEADERS)


async def _blocks(request: Request) -> AsyncIterator[bytes]:
    """The body as it comes; raises TimeoutError after a silence of ``SILENT_S``."""
    stream = request.stream()
    while True:
        try:
            async with asyncio.timeout(SILENT_S):
                block = await anext(stream)
        except StopAsyncIteration:
            return
        yield block


def _whole(request: Request, header: str) -> int:
    text = request.headers.get(header, "")
    if not (text.isascii() and text.isdigit() and len(text) <= 15):
        raise RefusalError(400, f"{header} must be a whole number of bytes")
    return int(text)


def _write_all(write: Callable[[bytes], int | None], block: bytes) -> None:
    """An unbuffered file may take less than it is given."""
    while block:
        block = block[write(block) or 0 :]


def _storage_refusal(error: OSError) -> RefusalError:
    if error.errno in _NO_SPACE:
        return RefusalError(507, "the computer's disk is full; make room, then go on")
    return RefusalError(507, f"the computer cannot write the session ({error.strerror}); look there, then go on")


def _answer(state: UploadState) -> Response:
    words = {"none": "nothing arrived yet", "partial": "more is to come", "filed": f"filed as {state.session}"}
    return JSONResponse({**asdict(state), "message": words[state.state]}, headers=_HEADERS)


GRACE_S = 2
"""Requests still running when the server is ended have so long; what they brought is kept anyway."""


class _Server(uvicorn.Server):
    """A server that Ctrl-C ends, and that is the end of it: uvicorn's own would send itself the signal again."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        before = {number: signal.signal(number, self.handle_exit) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def serve(app: Starlette, opened: socket.socket) -> None:
    """Serve an application on an open socket until SIGINT or SIGTERM."""
    config = uvicorn.Config(
        app, log_level="critical", access_log=False, lifespan="off", timeout_graceful_shutdown=GRACE_S, http="h11"
    )
    _Server(config).run(sockets=[opened])
