"""What can be asked of the studio about preparing a survey.

What plans, prints and adjusts is imported when it is first asked for: packages of extras, which the rest does without.
"""

from __future__ import annotations

from itertools import count
from urllib.parse import quote

from vislam2tag.site.plans.source import PlanSource
from vislam2tag.studio.endpoints import Asked, Binary, Endpoint, Studio
from vislam2tag.studio.prepare import dropped
from vislam2tag.studio.prepare.messages import (
    AddedFloor,
    DroppedFile,
    FileQuery,
    FloorRequest,
    LookQuery,
    PlanChange,
    PlanLookView,
    PlannedView,
    PlanWish,
    RegisterRequest,
    RegistrationView,
    SheetsView,
    SheetsWish,
    WallsRequest,
    WallsView,
    Written,
)


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


def _plan(studio: Studio, asked: Asked) -> PlannedView:
    from vislam2tag.studio.prepare.plans import make_plan

    wish, workspace = asked.of(PlanWish), studio.workspace
    workspace.now.survey.site.floor(wish.floor)
    return studio.worker.do(make_plan, next(_PLANS), workspace.root, wish, workspace.settings)


def _change(studio: Studio, asked: Asked) -> PlannedView:
    from vislam2tag.studio.prepare.plans import change_plan

    return studio.worker.do_latest(change_plan, asked.of(PlanChange))


def _write_plan(studio: Studio, asked: Asked) -> Written:
    from vislam2tag.studio.prepare.plans import write_plan

    written = studio.worker.do(write_plan, asked.of(PlanChange), studio.workspace.root)
    studio.workspace.refresh()
    return Written(count=written, where=str(studio.workspace.root))


def _sheets(studio: Studio, asked: Asked) -> SheetsView:
    from vislam2tag.studio.prepare.sheets import made_sheets

    workspace = studio.workspace
    return studio.worker.do(made_sheets, workspace.root, asked.of(SheetsWish), workspace.settings.sheets)


def _sheets_pdf(studio: Studio, _asked: Asked) -> Binary:
    from vislam2tag.studio.prepare.sheets import sheets_folder, sheets_pdf

    name = sheets_folder(studio.workspace.root).name
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}.pdf"}
    return Binary(sheets_pdf(studio.workspace.root), "application/pdf", headers)


def _register(studio: Studio, asked: Asked) -> RegistrationView:
    from vislam2tag.studio.prepare.positions import registered

    request, workspace = asked.of(RegisterRequest), studio.workspace
    found = registered(workspace.root, studio.dropped, request, workspace.settings.registration)
    if request.write:
        workspace.refresh()
    return found


def _walls(studio: Studio, asked: Asked) -> WallsView:
    from vislam2tag.studio.prepare.walls import corrected_floor

    request, workspace = asked.of(WallsRequest), studio.workspace
    found = studio.worker.do(corrected_floor, workspace.root, request, workspace.settings.walkable)
    if request.write:
        workspace.refresh()
    return found


_PLANS = count(1)
PREPARE = (
    Endpoint("POST", "/api/prepare/files", _drop, DroppedFile, FileQuery, takes_file=True),
    Endpoint("GET", "/api/prepare/files/{number:short}/look", _look, PlanLookView, LookQuery),
    Endpoint("GET", "/api/prepare/files/{number:short}/picture", _picture, None, LookQuery),
    Endpoint("POST", "/api/prepare/floors", _add_floor, AddedFloor, body=FloorRequest),
    Endpoint("POST", "/api/prepare/plans", _plan, PlannedView, body=PlanWish),
    Endpoint("POST", "/api/prepare/plans/change", _change, PlannedView, body=PlanChange),
    Endpoint("POST", "/api/prepare/plans/write", _write_plan, Written, body=PlanChange),
    Endpoint("POST", "/api/prepare/sheets", _sheets, SheetsView, body=SheetsWish),
    Endpoint("GET", "/api/prepare/sheets/pdf", _sheets_pdf, None),
    Endpoint("POST", "/api/prepare/positions", _register, RegistrationView, body=RegisterRequest),
    Endpoint("POST", "/api/prepare/walls", _walls, WallsView, body=WallsRequest),
)
