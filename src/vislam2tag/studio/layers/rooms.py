"""The layer of room names: those of a floor's table of rooms, and others on its plan."""

from __future__ import annotations

from vislam2tag.common.errors import SurveyError
from vislam2tag.site.floors import names_on_plan, read_room_names
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import PlanText
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace, plan_stamp

_FOUND: dict[tuple[str, str], list[PlanText]] = {}
"""Cache of names on plans by floor and plan."""


def rooms(workspace: Workspace, floor: int) -> list[Feature]:
    """Names of one floor at their places; only those of its table if its plan cannot be read."""
    chosen = workspace.now.survey.site.floor(floor)
    listed, _ = read_room_names(workspace.root, chosen.rooms)
    known = {one.text for one in listed}
    names = [*listed, *(one for one in _on_plan(chosen) if one.text not in known)]
    return [
        Feature(
            id=f"rooms:{floor}:{number}",
            shape="point",
            floor=floor,
            coordinates=[(round(one.place_m[0], 3), round(one.place_m[1], 3))],
            label=one.text,
        )
        for number, one in enumerate(names)
    ]


def _on_plan(floor: Floor) -> list[PlanText]:
    if floor.plan is None:
        return []
    key = str(floor), plan_stamp(floor)
    if key not in _FOUND:
        try:
            _FOUND[key] = names_on_plan(floor_plan(floor))
        except SurveyError:
            _FOUND[key] = []
    return _FOUND[key]


register(Layer("rooms", Title(en="Room names", de="Raumnamen"), rooms, shown=True))
