"""The HTTP side of a served model: bounded requests, answers, refusals, the page and the OpenAPI description."""

from __future__ import annotations

from functools import partial
from importlib import resources
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.json_schema import models_json_schema
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from vislam2tag import __version__
from vislam2tag.common.serving import BrokenBodyError, LargeBodyError, admit, whole_body
from vislam2tag.pipeline.positioning.served_answers import (
    MOST_LATEST,
    LocateAnswer,
    LocateRequest,
    Refusal,
    ServedAnswers,
    ServedModel,
)

MOST_BODY = 1 << 20
"""Bytes that a request may bring."""
BODY_S = 10.0
"""A request's body must be whole so soon."""
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
"""Other names that lead here may be somebody's trick (DNS rebinding)."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Connection": "close",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
}
_FILE = "application/octet-stream"
_PAGE = {
    "/": ("index.html", "text/html"),
    "/page.js": ("page.js", "text/javascript"),
    "/page.css": ("page.css", "text/css"),
    "/api": ("api.html", "text/html"),
    "/api.js": ("api.js", "text/javascript"),
}


class RefusedError(Exception):
    """An answer other than what was asked for."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status, self.message = status, message


def locate_app(answers: ServedAnswers) -> Starlette:
    """The application that a server runs."""
    routes = [
        *(Route(path, partial(_page, file, kind), methods=["GET"]) for path, (file, kind) in _PAGE.items()),
        Route("/openapi.json", _openapi, methods=["GET"]),
        Route("/model", partial(_model, answers), methods=["GET"]),
        Route("/model.v2t", partial(_file, answers), methods=["GET"]),
        Route("/plans/{number:short}", partial(_plan, answers), methods=["GET"]),
        Route("/locate", partial(_locate, answers), methods=["POST"]),
        Route("/latest", partial(_latest, answers), methods=["GET"]),
    ]
    return Starlette(
        routes=routes,
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=list(LOOPBACK_NAMES))],
        exception_handlers={RefusedError: _refuse, HTTPException: _refuse},
    )


async def _page(file: str, kind: str, request: Request) -> Response:
    del request
    text = resources.files(__package__ or "").joinpath("page", file).read_text(encoding="utf-8")
    return Response(text, media_type=kind, headers=_HEADERS)


async def _openapi(request: Request) -> Response:
    del request
    return JSONResponse(openapi(), headers=_HEADERS)


async def _model(answers: ServedAnswers, request: Request) -> Response:
    del request
    return _json(answers.model)


async def _file(answers: ServedAnswers, request: Request) -> Response:
    del request
    return Response(await run_in_threadpool(answers.file), media_type=_FILE, headers=_HEADERS)


async def _plan(answers: ServedAnswers, request: Request) -> Response:
    number = int(request.path_params["number"])
    if not 0 <= number < len(answers.plans):
        raise RefusedError(404, "there is no such plan; GET /model lists them")
    return FileResponse(answers.plans[number], headers=_HEADERS)


async def _locate(answers: ServedAnswers, request: Request) -> Response:
    # A page of another site cannot send this type without asking first, which is never answered.
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise RefusedError(415, "send scans as application/json")
    try:
        asked = LocateRequest.model_validate_json(await _body(request))
    except ValidationError as error:
        problem = error.errors()[0]
        place = ".".join(map(str, problem["loc"])) or "body"
        raise RefusedError(422, f"{place}: {problem['msg']}; GET /api tells the form") from error
    if not admit(request):
        raise RefusedError(429, "too many requests at once; send more scans in each")
    return _json(await run_in_threadpool(answers.locate, asked))


async def _latest(answers: ServedAnswers, request: Request) -> Response:
    del request
    return _json(answers.latest())


async def _body(request: Request) -> bytes:
    try:
        return await whole_body(request, MOST_BODY, BODY_S)
    except BrokenBodyError:
        raise RefusedError(400, "the request broke off") from None
    except LargeBodyError:
        raise RefusedError(413, f"a request may bring {MOST_BODY >> 20} MiB; send fewer scans at once") from None


def _json(record: BaseModel) -> Response:
    return Response(record.model_dump_json(), media_type="application/json", headers=_HEADERS)


async def _refuse(request: Request, error: Exception) -> Response:
    del request
    if isinstance(error, RefusedError):
        status, message = error.status, error.message
    else:
        status = error.status_code if isinstance(error, HTTPException) else 500
        message = "there is no such address or method; GET /api lists them"
    return Response(Refusal(message=message).model_dump_json(), status, _HEADERS, "application/json")


def openapi() -> dict[str, Any]:
    """The description of all addresses that programs ask (OpenAPI 3.1)."""
    kinds = (LocateRequest, LocateAnswer, ServedModel, Refusal)
    _, found = models_json_schema([(kind, "validation") for kind in kinds], ref_template="#/components/schemas/{model}")

    def content(name: str) -> dict[str, Any]:
        return {"content": {"application/json": {"schema": {"$ref": f"#/components/schemas/{name}"}}}}

    def answer(name: str) -> dict[str, Any]:
        return {"200": {"description": "the answer"} | content(name)}

    def get(name: str, summary: str, answered: dict[str, Any]) -> dict[str, Any]:
        return {"get": {"operationId": name, "summary": summary, "responses": answered}}

    file = {"200": {"description": "the file", "content": {_FILE: {}}}}
    refused = {code: {"description": "refused"} | content("Refusal") for code in ("400", "413", "415", "422", "429")}
    locate = {
        "operationId": "locate",
        "summary": "Locate scans",
        "requestBody": {"required": True} | content("LocateRequest"),
        "responses": answer("LocateAnswer") | refused,
    }
    return {
        "openapi": "3.1.0",
        "info": {"title": "vislam2tag locate", "version": __version__},
        "paths": {
            "/locate": {"post": locate},
            "/latest": get("latest", f"The last {MOST_LATEST} positions", answer("LocateAnswer")),
            "/model": get("model", "What answers", answer("ServedModel")),
            "/model.v2t": get("file", "The model's file, which an app embeds", file),
        },
        "components": {"schemas": found["$defs"]},
    }
