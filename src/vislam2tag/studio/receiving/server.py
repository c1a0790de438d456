"""The HTTP side of receiving: requests into calls of :class:`Uploads`, answers, the page and facts about the survey.

docs/reference/phone-handover.md describes the protocol.
"""

from __future__ import annotations

import base64
import errno
import hashlib
import io
import re
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.serving import RefusalLog, admit, blocks, drain
from vislam2tag.core.tracks import Landmarks
from vislam2tag.site.discover import read_site
from vislam2tag.site.links import site_name
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import plan_picture
from vislam2tag.studio.receiving.token import SCHEME, WRONG_PROOF, Guard, SignedRequest, answer_mac, authorization_mac
from vislam2tag.studio.receiving.uploads import (
    BUSY_S,
    UPLOAD_NAME,
    FiledSession,
    RefusalError,
    Uploads,
    UploadState,
)
from vislam2tag.studio.receiving.zips import RefusedZipError

MOST_PER_REQUEST = 8 << 20
"""Maximum bytes of a zip in one request."""
SILENT_S = 10.0
"""Requests without data are closed after this time, because the phone may have left the network."""
BODY_SHA256, ANSWER_MAC = "Upload-Body-SHA256", "Upload-Answer-MAC"
UPLOADS = "/v2/uploads"
SURVEY, PLANS = "/v2/survey", "/v2/plans"
_FLOOR = re.compile(r"-?[0-9]{1,4}")
_FORMER = "/v1/uploads/{name}"
"""Address of apps before version 2 of the upload, which send the token itself."""
_HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Connection": "close"}
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


@dataclass(frozen=True)
class Listener:
    """Called with progress: received bytes of an upload, a saved session, a refusal with its client."""

    received: Callable[[str, int, int], None] = lambda _name, _received, _length: None
    filed: Callable[[str, FiledSession], None] = lambda _name, _filed: None
    refused: Callable[[str, str], None] = lambda _address, _message: None


class Receiver:
    """Answers the requests of phones and browsers for one survey."""

    def __init__(
        self, uploads: Uploads, guard: Guard, listener: Listener, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._uploads, self._guard, self._listener = uploads, guard, listener
        self._strangers = RefusalLog(listener.refused, clock)

    def app(self) -> Starlette:
        """The application that a server runs."""
        routes = [
            Route("/", self._page, methods=["GET"]),
            Route(f"{UPLOADS}/{{name}}", self._state, methods=["GET"]),
            Route(f"{UPLOADS}/{{name}}", self._append, methods=["PATCH"]),
            Route(SURVEY, self._survey, methods=["GET"]),
            Route(f"{PLANS}/{{floor}}", self._plan, methods=["GET"]),
            Route(_FORMER, self._former, methods=["GET", "PATCH"]),
        ]
        return Starlette(routes=routes, exception_handlers={RefusalError: self._refuse, HTTPException: self._unknown})

    async def _page(self, _request: Request) -> Response:
        return HTMLResponse(PAGE, headers=_HEADERS | PAGE_HEADERS)

    async def _former(self, _request: Request) -> Response:
        raise RefusalError(
            410, "this app is older than the computer's program and would send the token; update the app"
        )

    async def _survey(self, request: Request) -> Response:
        self._prove(request)
        facts = await run_in_threadpool(survey_facts, self._uploads.survey)
        return self._proved(request, JSONResponse(facts, headers=_HEADERS))

    async def _plan(self, request: Request) -> Response:
        self._prove(request)
        floor = str(request.path_params["floor"])
        known = _FLOOR.fullmatch(floor) is not None
        plan = await run_in_threadpool(plan_jpeg, self._uploads.survey, int(floor)) if known else None
        if plan is None:
            raise RefusalError(404, "this floor has no plan that can be drawn")
        return self._proved(request, Response(plan, media_type="image/jpeg", headers=_HEADERS))

    async def _state(self, request: Request) -> Response:
        name = self._admitted(request)
        return self._answer(request, await run_in_threadpool(self._uploads.state, name))

    async def _append(self, request: Request) -> Response:
        name = self._admitted(request)
        offset, length = _whole(request, "Upload-Offset"), _whole(request, "Upload-Length")
        self._check_length(request, length)
        state = await run_in_threadpool(self._uploads.state, name)
        if state.state == "filed":
            return self._answer(request, state)
        try:
            with self._uploads.writing(name, length, offset) as file:
                received = await self._keep(request, file, name, offset, length)
            if received < length:
                return self._answer(request, UploadState("partial", received, length))
            return self._answer(request, await self._finish(name))
        except OSError as error:
            raise _storage_refusal(error) from error

    async def _keep(self, request: Request, file: io.FileIO, name: str, offset: int, length: int) -> int:
        """Write the body as it arrives; returns the number of received bytes of the upload.

        Bytes before a lost connection stay, because the SHA-256 of the zip (its name) is checked in the end.
        """
        received, most, digest = offset, min(length, offset + MOST_PER_REQUEST), hashlib.sha256()
        try:
            async for block in blocks(request, SILENT_S):
                if received + len(block) > most:
                    raise RefusalError(400 if most == length else 413, "the request has too many bytes")
                _write_all(file.write, block)
                digest.update(block)
                received += len(block)
                self._listener.received(name, received, length)
        except ClientDisconnect:
            raise RefusalError(400, "the request was interrupted; the received bytes are kept") from None
        except TimeoutError:
            raise _go_on(
                "no data arrived for too long; continue from the received bytes", _partial(received, length)
            ) from None
        if digest.hexdigest() != request.headers.get(BODY_SHA256):
            file.truncate(offset)
            raise _go_on("the bytes were changed during the transfer; send them again", _partial(offset, length))
        return received

    async def _finish(self, name: str) -> UploadState:
        try:
            with self._uploads.finishing(name):
                filed = await run_in_threadpool(self._uploads.finish, name)
        except RefusedZipError as error:
            raise RefusalError(422, str(error)) from error
        self._listener.filed(name, filed)
        return UploadState("filed", session=filed.path)

    def _admitted(self, request: Request) -> str:
        """The upload's name, after the request has proved that its sender knows the token."""
        self._prove(request)
        name = str(request.path_params["name"])
        if not UPLOAD_NAME.fullmatch(name):
            raise RefusalError(400, "the name of an upload must be its SHA-256, 64 lower-case hexadecimal digits")
        return name

    def _prove(self, request: Request) -> None:
        """Refuse a request that does not prove that its sender knows the token."""
        shown = authorization_mac(request.headers.get("Authorization", ""))
        problem = WRONG_PROOF if shown is None else self._guard.refusal(_signed(request, shown[0]), shown[1])
        if shown is None or problem is not None:
            raise RefusalError(401, problem or WRONG_PROOF, {"WWW-Authenticate": SCHEME})
        request.state.nonce = shown[0]
        if not admit(request):
            message = "the computer has too many connections; wait and try again"
            raise RefusalError(429, message, {"Retry-After": str(BUSY_S)})

    def _check_length(self, request: Request, length: int) -> None:
        if length > self._uploads.max_bytes:
            most = f"{self._uploads.max_bytes / 1e6:,.0f} MB"
            raise RefusalError(
                413, f"the session is larger than {most}; use vislam2tag receive with a larger --max-size-mb"
            )
        if length == 0:
            raise RefusalError(400, "Upload-Length must be greater than 0")
        if int(request.headers.get("Content-Length", "0")) > MOST_PER_REQUEST:
            raise RefusalError(413, f"a request may have at most {MOST_PER_REQUEST >> 20} MiB")

    async def _refuse(self, request: Request, error: Exception) -> Response:
        assert isinstance(error, RefusalError)
        known = hasattr(request.state, "nonce")
        if known:
            await drain(request, MOST_PER_REQUEST, SILENT_S)
        if error.status not in (409, 423, 429):
            report = self._listener.refused if known else self._strangers.refused
            report(request.client.host if request.client else "", error.message)
        content = {**(asdict(error.state) if error.state else {}), "message": error.message}
        return self._proved(request, JSONResponse(content, error.status, headers=_HEADERS | error.headers))

    def _answer(self, request: Request, state: UploadState) -> Response:
        words = {"none": "nothing received yet", "partial": "partly received", "filed": f"saved as {state.session}"}
        return self._proved(request, JSONResponse({**asdict(state), "message": words[state.state]}, headers=_HEADERS))

    def _proved(self, request: Request, answer: Response) -> Response:
        """Add the MAC that proves to an admitted request who answers."""
        nonce = getattr(request.state, "nonce", None)
        if nonce is not None:
            answer.headers[ANSWER_MAC] = answer_mac(self._guard.token, nonce, answer.status_code, bytes(answer.body))
        return answer

    async def _unknown(self, _request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 500
        return JSONResponse(
            {"message": "this address or method does not exist in vislam2tag receive"}, status, _HEADERS
        )


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
        return RefusalError(507, "the computer's disk is full; free space, then continue")
    return RefusalError(
        507, f"the computer cannot write the session ({_reason(error)}); solve the problem there, then continue"
    )


def _reason(error: OSError) -> str:
    """The system's message, with the name of the file or folder."""
    return f"{Path(error.filename).name}: {error.strerror}" if error.filename else str(error.strerror)


def _partial(received: int, length: int) -> UploadState:
    return UploadState("partial" if received else "none", received, length)


def _go_on(message: str, state: UploadState) -> RefusalError:
    return RefusalError(409, message, state=state)


def _signed(request: Request, nonce: str) -> SignedRequest:
    offset, length, body = (request.headers.get(name, "") for name in ("Upload-Offset", "Upload-Length", BODY_SHA256))
    return SignedRequest(request.method, str(request.scope["path"]), offset, length, body, nonce)


_TEXT = resources.files("vislam2tag.studio.receiving").joinpath("page.html").read_text(encoding="utf-8")
PAGE = _TEXT
"""HTML without data of the survey; the token stays in the address's fragment, which browsers do not send."""


def _hash_of(tag: str) -> str:
    """Hash of the one inline element of a tag, for the content security policy."""
    content = _TEXT.split(f"<{tag}>", 1)[1].split(f"</{tag}>", 1)[0]
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"


PAGE_HEADERS = {
    "Content-Security-Policy": "; ".join(
        (
            "default-src 'none'",
            f"script-src {_hash_of('script')}",
            f"style-src {_hash_of('style')}",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    ),
    "Referrer-Policy": "no-referrer",
}


PLAN_SIDE_PX = 2000
"""Longer side of a plan's picture, enough for a phone's screen."""
_QUALITY = 85


def survey_facts(root: Path) -> dict[str, Any]:
    """The survey's name (that of ``site.toml``, else the folder's) and its floors, lowest first, as JSON.

    Of a floor: its extent left, right, low, high in the BCS, metres (None: not known), whether it has a plan, and where
    its surveyed landmarks hang, x and y in the BCS, metres. Files that links lead to outside the survey are skipped.
    """
    try:
        name = site_name(root)
        site, _ = read_site(root)
    except SurveyError:
        return {"name": root.resolve().name, "floors": []}
    floors = [
        {
            "number": floor.number,
            "name": floor.name,
            "extent_m": floor.extent_m,
            "plan": _has_plan(floor),
            "landmarks": _places(site.landmarks.on_floor(floor.number)),
        }
        for floor in sorted(site.floors, key=lambda floor: floor.number)
    ]
    return {"name": name or root.resolve().name, "floors": floors}


def plan_jpeg(root: Path, number: int) -> bytes | None:
    """Draw a floor's plan as JPEG over exactly its extent; None if there is none."""
    try:
        floor = read_site(root)[0].floor(number)
        if not _has_plan(floor):
            return None
        buffer = io.BytesIO()
        plan_picture(floor, PLAN_SIDE_PX).convert("RGB").save(buffer, "jpeg", quality=_QUALITY)
    except (SurveyError, KeyError, OSError):
        return None
    return buffer.getvalue()


def _places(landmarks: Landmarks) -> dict[str, tuple[float, float]]:
    rows = zip(landmarks.ids, landmarks.position_bcs.tolist(), landmarks.surveyed.tolist(), strict=True)
    return {name: (x, y) for name, (x, y), surveyed in rows if surveyed}


def _has_plan(floor: Floor) -> bool:
    return floor.plan is not None and floor.extent_m is not None
