"""What of each floor the labelled walks have covered, and where to go next: as ``vislam2tag check`` tells it."""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import TypeAlias, TypeVar

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.extras import missing_extra
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.status import Status
from vislam2tag.pipeline.labels.walked_floors import floor_areas
from vislam2tag.studio.collect.messages import Covered, CoveredFloors
from vislam2tag.studio.outputs import LABELS
from vislam2tag.studio.tracks import Track
from vislam2tag.studio.workspace import Workspace, plan_stamp
from vislam2tag.survey.room_names import read_room_names
from vislam2tag.walkable.walked.areas import Areas
from vislam2tag.walkable.walked.walked_record import WalkedFloor, walked_floor
from vislam2tag.walkable.walked.walked_space import WalkedSpace, filling_walk, walked_space

KEPT = 20
"""Floors whose rooms and walks stay in memory."""
_Value = TypeVar("_Value")
FloorCovered: TypeAlias = tuple[WalkedFloor, WalkedSpace | None]

_areas: OrderedDict[str, Areas] = OrderedDict()
_covered: OrderedDict[str, FloorCovered] = OrderedDict()
_lock = threading.Lock()


def covered_floors(workspace: Workspace) -> CoveredFloors:
    """Tell it of each floor with a plan."""
    floors = [floor.number for floor in workspace.now.survey.site.floors if floor.plan is not None]
    return CoveredFloors(floors=[_view(covered(workspace, floor)[0]) for floor in floors])


def covered(workspace: Workspace, floor: int) -> FloorCovered:
    """The record of a floor, and its space to be drawn, None where the record's note says why there is none.

    Both are kept while survey and labels are as they were: list and map are told of one measurement.
    """
    with _lock:
        while True:
            key = f"{workspace.root} {workspace.out} {floor} {workspace.refresh().sessions}"
            if key not in _covered:
                found = _measured(workspace, floor)
                if not key.endswith(workspace.refresh().sessions):
                    continue  # labels came meanwhile: it may hold some of them
                _keep(_covered, key, found)
            return _covered[key]


def _keep(kept: OrderedDict[str, _Value], key: str, value: _Value) -> None:
    kept[key] = value
    while len(kept) > KEPT:
        kept.popitem(last=False)


def _measured(workspace: Workspace, floor: int) -> FloorCovered:
    try:
        areas = _areas_of(workspace, floor)
    except SurveyError as error:
        return WalkedFloor(number=floor, note=str(error)), None
    except ModuleNotFoundError as error:
        lacks = missing_extra(error)
        if lacks is None:
            raise
        return WalkedFloor(number=floor, note=f"this {lacks}"), None
    walked, scanned = [np.empty((0, 2))], [np.empty((0, 2))]
    for id in workspace.now.ids:
        result, track = workspace.result(id), workspace.track(id)
        if result is not None and track is not None:
            walked.append(_places(track, floor))
            scans = workspace.output_of(id, LABELS).scans(result)
            scanned.append(scans.filter(floor=floor).select("x", "y").to_numpy())
    space = walked_space(areas, np.vstack(walked), np.vstack(scanned))
    return walked_floor(floor, space, filling_walk(space)), space


def _areas_of(workspace: Workspace, floor: int) -> Areas:
    """Rooms and corridors of a floor, kept while its plan is as it was; raises SurveyError where there are none."""
    chosen = workspace.now.survey.site.floor(floor)
    key = f"{workspace.root} {chosen} {plan_stamp(chosen)}"
    if key not in _areas:
        names, _ = read_room_names(workspace.root, chosen.rooms)
        _keep(_areas, key, floor_areas(chosen, names, workspace.settings.walkable))
    return _areas[key]


def _places(track: Track, floor: int) -> FloatArray:
    """Places (w, 2) about a metre apart where a walk is labelled on a floor, BCS metres."""
    own = (track.columns["status"] == Status.OK) & (track.columns["floor"] == floor)
    path = np.column_stack((track.columns["x"][own], track.columns["y"][own])).astype(np.float64)
    metre = np.floor(arc_lengths(path)[: len(path)])
    return path[np.unique(metre, return_index=True)[1]]


def _view(record: WalkedFloor) -> Covered:
    walk = record.walk
    return Covered(
        floor=record.number,
        note=record.note,
        walkable_m2=record.walkable_m2,
        walked=record.walked,
        scanned=record.scanned,
        never_entered=[area.name for area in record.never_entered],
        minutes_left=None if walk is None else walk.minutes,
        next_m=None if walk is None or not walk.stops_m else walk.stops_m[0],
    )
