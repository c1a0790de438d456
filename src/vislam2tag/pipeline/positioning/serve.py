"""Serves a model over HTTP: locates scans, and provides facts about the model and plans of a data set.

Requests are limited; limits are part of the messages, so that the OpenAPI description contains them.
"""

from __future__ import annotations

from collections import deque
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError, field_validator
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
from vislam2tag.common.records import FiniteRecord
from vislam2tag.common.serving import BrokenBodyError, LargeBodyError, admit, whole_body
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.intake.level_scales import SIGNAL_STRENGTH
from vislam2tag.intake.readings import is_masked
from vislam2tag.pipeline.positioning.locate import located_table, missing_notes, missing_technologies, namer
from vislam2tag.positioning.model_files import SavedModel, model_bytes
from vislam2tag.positioning.radio_scans import scans_from_readings

MOST_SCANS = 500
MOST_READINGS = 1000
"""Of a scan."""
_LONGEST_NAME = 200

Level = Annotated[float, Field(ge=SIGNAL_STRENGTH.least, le=SIGNAL_STRENGTH.greatest)]
Name = Annotated[str, Field(min_length=1, max_length=_LONGEST_NAME)]


class _Message(FiniteRecord, use_attribute_docstrings=True):
    """A record whose fields OpenAPI describes by their docstrings."""


class Scan(_Message):
    """A scan by a phone at one place."""

    scan_id: Name
    """Returned with the position."""
    readings: Annotated[dict[Name, Level], Field(max_length=MOST_READINGS)]
    """Signal strength (dBm) of each access point by address."""
    session: Annotated[str, Field(max_length=_LONGEST_NAME)] = ""
    """Name of the walk. Scans of one walk in the same request calibrate their radii together. Empty: none."""

    @field_validator("readings")
    @classmethod
    def _has_addresses(cls, readings: dict[str, float]) -> dict[str, float]:
        if masked := sorted(name for name in readings if is_masked(name)):
            raise ValueError(
                f"{masked[0]} is not an address; Android reports it to apps without the location permission"
            )
        return readings


class LocateRequest(_Message):
    """Scans to locate."""

    scans: Annotated[list[Scan], Field(min_length=1, max_length=MOST_SCANS)]


class Position(_Message):
    """Position of a scan, as `vislam2tag locate` writes it; fields except id and status are null if it is unknown."""

    scan_id: str
    status: Literal["ok", "unlike", "unknown"]
    """``unlike``: the scan is unlike all training data, so do not rely on the radii."""
    building: str | None
    floor: int | None
    floor_name: str | None
    """Null if the floor has only a number."""
    room: str | None
    """Null if no room with a name is there."""
    x: float | None
    """Metres in the frame of the floor (BCS), as y."""
    y: float | None
    z: float | None
    """Metres above the building's zero; null if the data set has no heights."""
    radius_68_m: float | None
    """Radius around the position that contains the true position with 68 % probability, metres."""
    radius_95_m: float | None
    floor_probability: float | None
    """Probability of this floor according to the model."""


class LocateAnswer(_Message):
    """Positions in the order of the scans."""

    positions: list[Position]
    notes: list[str] = []
    """Messages about scans without Wi-Fi or without BLE, if the model was trained on both together."""


class ServedFloor(_Message):
    """A floor that the model knows; the plan's extent in metres if a plan is served."""

    building: str
    floor: int
    name: str = ""
    """Empty if the floor has only a number."""
    plan: str | None
    """Address of the picture."""
    width_m: float | None = None
    height_m: float | None = None
    lower_left_m: tuple[float, float] = (0.0, 0.0)


class ServedModel(_Message):
    """The model that is served."""

    model: str
    dataset: str
    technology: str
    """Technology of its training scans: ``wifi``, ``ble``, or ``wifi+ble`` for both in one scan."""
    frame: str
    scans: int
    """Number of training scans."""
    access_points: int
    hashed_with: str | None
    """Name of the key that addresses must be hashed with; null: plain addresses."""
    floors: list[ServedFloor]


class Refusal(_Message):
    """Why a request was not answered."""

    message: str


MOST_LATEST = 100


class ServedAnswers:
    """A model that is served; the latest positions are kept for the page."""

    def __init__(self, saved: SavedModel, plans: Path | None = None) -> None:
        """Serve a model, with plans of a data set; raises DatasetError if there is none."""
        self._saved = saved
        self._name = namer(saved, None)
        self._latest: deque[Position] = deque(maxlen=MOST_LATEST)
        dataset = None if plans is None else open_dataset(plans)
        infos = {} if dataset is None else {(info.building, info.number): info for info in dataset.info.floors}
        self.plans: list[Path] = []
        floors = []
        for storey in saved.model.storeys_:
            info = infos.get((storey.building, storey.floor))
            file = None if dataset is None or info is None or info.plan is None else dataset.files.get(info.plan)
            shown = ServedFloor(
                building=storey.building, floor=storey.floor, name=saved.origin.floor_name(storey), plan=None
            )
            if info is not None and file is not None:
                plan = {"plan": f"/plans/{len(self.plans)}", "lower_left_m": info.lower_left_m}
                size = {"width_m": info.width_m, "height_m": info.height_m}
                shown = shown.model_copy(update=plan | size)
                self.plans.append(Path(file))
            floors.append(shown)
        self.model = ServedModel(
            model=saved.name,
            dataset=saved.origin.dataset,
            technology=saved.origin.technology,
            frame=saved.origin.frame,
            scans=saved.origin.scans,
            access_points=len(saved.model.access_points_),
            hashed_with=saved.origin.bssid_key,
            floors=floors,
        )

    def locate(self, request: LocateRequest) -> LocateAnswer:
        """Locate scans, and keep the positions as the latest."""
        scans = request.scans
        counts = [len(scan.readings) for scan in scans]
        heard = scans_from_readings(
            np.repeat(np.arange(len(scans)), counts),
            np.array([self._name(bssid) for scan in scans for bssid in scan.readings], dtype=np.str_),
            np.array([level for scan in scans for level in scan.readings.values()], dtype=np.float64),
            len(scans),
            session=np.array([scan.session for scan in scans], dtype=np.str_),
        )
        ids = np.array([scan.scan_id for scan in scans], dtype=np.str_)
        table = located_table(ids, self._saved.model.predict(heard), self._saved.origin)
        positions = [Position(**row) for row in table.rows(named=True)]
        self._latest.extend(positions)
        notes = missing_notes(*missing_technologies(heard, self._saved))
        return LocateAnswer(positions=positions, notes=notes)

    def file(self) -> bytes:
        """Return the model's file."""
        return model_bytes(self._saved)

    def latest(self) -> LocateAnswer:
        """Return the latest positions, with the newest last."""
        return LocateAnswer(positions=list(self._latest))


MOST_BODY = 1 << 20
"""Maximum bytes of a request."""
BODY_S = 10.0
"""Time limit for a request's body."""
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
"""Other host names may be an attack (DNS rebinding)."""
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
    """An answer that refuses a request."""

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
        raise RefusedError(404, "this plan does not exist; GET /model lists the plans")
    return FileResponse(answers.plans[number], headers=_HEADERS)


async def _locate(answers: ServedAnswers, request: Request) -> Response:
    # A page of another site cannot send this type without a preflight request, which is never answered.
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise RefusedError(415, "send scans as application/json")
    try:
        asked = LocateRequest.model_validate_json(await _body(request))
    except ValidationError as error:
        problem = error.errors()[0]
        place = ".".join(map(str, problem["loc"])) or "body"
        raise RefusedError(422, f"{place}: {problem['msg']}; GET /api describes the format") from error
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
        raise RefusedError(400, "the request was interrupted") from None
    except LargeBodyError:
        raise RefusedError(413, f"a request may have at most {MOST_BODY >> 20} MiB; send fewer scans at once") from None


def _json(record: BaseModel) -> Response:
    return Response(record.model_dump_json(), media_type="application/json", headers=_HEADERS)


async def _refuse(request: Request, error: Exception) -> Response:
    del request
    if isinstance(error, RefusedError):
        status, message = error.status, error.message
    else:
        status = error.status_code if isinstance(error, HTTPException) else 500
        message = "this address or method does not exist; GET /api lists them"
    return Response(Refusal(message=message).model_dump_json(), status, _HEADERS, "application/json")


def openapi() -> dict[str, Any]:
    """The description of all addresses for programs (OpenAPI 3.1)."""
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
            "/model": get("model", "Facts about the model", answer("ServedModel")),
            "/model.v2t": get("file", "The model's file for use in apps", file),
        },
        "components": {"schemas": found["$defs"]},
    }
