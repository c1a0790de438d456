"""What can be asked of the studio about preparing a survey."""

from __future__ import annotations

from vislam2tag.studio.endpoints import Asked, Binary, Endpoint, Studio
from vislam2tag.studio.prepare import dropped
from vislam2tag.studio.prepare.messages import (
    AddedFloor,
    DroppedFile,
    FileQuery,
    FloorRequest,
    LookQuery,
    PlanLookView,
)
from vislam2tag.survey.plans.source import PlanSource


def _drop(studio: Studio, asked: Asked) -> DroppedFile:
    return studio.dropped.keep(asked.of(FileQuery).name, asked.content)


def _source(asked: Asked) -> PlanSource:
    query = asked.of(LookQuery)
    return PlanSource(file="plan", page=query.page, level=query.level)


def _look(studio: Studio, asked: Asked) -> PlanLookView:
    path = studio.dropped.path(int(asked.path["number"]))
    return dropped.look(path, _source(asked), studio.workspace.root)


def _picture(studio: Studio, asked: Asked) -> Binary:
    path = studio.dropped.path(int(asked.path["number"]))
    return Binary(dropped.picture_png(path, _source(asked)), "image/png")


def _add_floor(studio: Studio, asked: Asked) -> AddedFloor:
    request = asked.of(FloorRequest)
    return dropped.add_dropped(studio.workspace, studio.dropped.path(request.file), request)


PREPARE = (
    Endpoint("POST", "/api/prepare/files", _drop, DroppedFile, FileQuery, takes_file=True),
    Endpoint("GET", "/api/prepare/files/{number:int}/look", _look, PlanLookView, LookQuery),
    Endpoint("GET", "/api/prepare/files/{number:int}/picture", _picture, None, LookQuery),
    Endpoint("POST", "/api/prepare/floors", _add_floor, AddedFloor, body=FloorRequest),
)
