"""Receives sessions from phones while the studio runs, and measures the coverage of each floor by labelled walks."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np
import segno

from vislam2tag.common.addresses import EVERYWHERE, listen, url_for
from vislam2tag.common.errors import SurveyError, UsageError, missing_extra
from vislam2tag.common.records import FiniteRecord
from vislam2tag.common.serving import serving
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.status import Status
from vislam2tag.pipeline.labels.walked_floors import floor_areas
from vislam2tag.site.floors import read_room_names
from vislam2tag.site.walkable.walked import Areas, WalkedFloor, WalkedSpace, filling_walk, walked_floor, walked_space
from vislam2tag.studio.messages import Point, seen_as
from vislam2tag.studio.outputs import LABELS, Track
from vislam2tag.studio.receiving.server import Listener, Receiver
from vislam2tag.studio.receiving.token import Guard, grouped, new_token
from vislam2tag.studio.receiving.uploads import FiledSession, Uploads
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.work_messages import JobRequest
from vislam2tag.studio.workspace import Workspace, plan_stamp

if TYPE_CHECKING:  # which needs this module for pages of files
    from vislam2tag.studio.jobs import JobQueue


class ReceivedSession(FiniteRecord):
    """A received session; ``path`` is its folder in the survey."""

    path: str
    already: bool
    """It was already there."""


class CollectingView(FiniteRecord):
    """State of receiving; without an address, it is off."""

    url: str | None
    token: str
    """Token for typing."""
    code: list[str]
    """Modules of the address's QR code, row by row: 1 is dark."""
    received: list[ReceivedSession]
    refused: list[str]


class Covered(FiniteRecord):
    """Coverage of a floor by the labels; ``note`` says why it is unknown."""

    floor: int
    note: str
    walkable_m2: float | None
    walked: float | None
    scanned: float | None
    """Shares of the walkable space within 2 m, on foot, of a walk and of a Wi-Fi scan."""
    never_entered: list[str]
    minutes_left: float | None
    """Duration of a walk that covers the rest; None: no further walk is needed."""
    next_m: Point | None
    """Its first stop."""


class CoveredFloors(FiniteRecord):
    """Of each floor with a plan."""

    floors: list[Covered]


KEPT = 20
"""Floors whose rooms and walks stay in memory."""
_Value = TypeVar("_Value")
FloorCovered: TypeAlias = tuple[WalkedFloor, WalkedSpace | None]

_areas: OrderedDict[str, Areas] = OrderedDict()
_covered: OrderedDict[str, FloorCovered] = OrderedDict()
_lock = threading.Lock()


@endpoint("GET", "/api/covered")
def covered_floors(workspace: Workspace) -> CoveredFloors:
    """Coverage of each floor with a plan."""
    floors = [floor.number for floor in workspace.now.survey.site.floors if floor.plan is not None]
    return CoveredFloors(floors=[_view(covered(workspace, floor)[0]) for floor in floors])


def covered(workspace: Workspace, floor: int) -> FloorCovered:
    """The record of a floor, and its space to draw (None if the record's note says why there is none).

    Both are cached while survey and labels do not change, so that list and map show the same measurement.
    """
    with _lock:
        while True:
            key = f"{workspace.root} {workspace.out} {floor} {workspace.refresh().sessions}"
            if key not in _covered:
                found = _measured(workspace, floor)
                if not key.endswith(workspace.refresh().sessions):
                    continue  # labels changed meanwhile, and it may contain some of them
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
    """Rooms and corridors of a floor, cached while its plan does not change; raises SurveyError if there are none."""
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
    return seen_as(
        Covered,
        record,
        floor=record.number,
        never_entered=[area.name for area in record.never_entered],
        minutes_left=None if walk is None else walk.minutes,
        next_m=None if walk is None or not walk.stops_m else walk.stops_m[0],
    )


MOST_BYTES = 1_000_000_000
"""Maximum size of a zip; it may unpack to eight times as much, as with ``vislam2tag receive``."""
TOLD = 50
"""Number of refusals that are shown."""


class Handover:
    """Receives sessions from phones between :meth:`open` and :meth:`close`; used by several threads."""

    def __init__(self, workspace: Workspace, jobs: JobQueue, publish: Callable[[str, FiniteRecord], None]) -> None:
        """Prepare without listening."""
        self._workspace, self._jobs, self._publish = workspace, jobs, publish
        self._lock = threading.Lock()
        self._running = ExitStack()
        self._url: str | None = None
        self._token = ""
        self._received: list[ReceivedSession] = []
        self._refused: list[str] = []

    def open(self) -> CollectingView:
        """Let phones on the network send sessions; raises OutputError if another program receives for this survey."""
        with self._lock:
            if self._url is None:
                token = new_token()
                with ExitStack() as stack:
                    opened = stack.enter_context(listen(EVERYWHERE[0], 0))
                    uploads = stack.enter_context(Uploads(self._workspace.root, MOST_BYTES, 8 * MOST_BYTES))
                    listener = Listener(filed=self._filed, refused=self._refuse)
                    app = Receiver(uploads, Guard(token), listener).app()
                    stack.enter_context(serving(app, opened))
                    self._url, self._token = url_for(EVERYWHERE[0], opened.getsockname()[1], token), token
                    self._running = stack.pop_all()
        return self.view()

    def close(self) -> CollectingView:
        """Stop receiving; received sessions stay."""
        with self._lock:
            self._url, self._token = None, ""
            self._running.close()
        return self.view()

    def view(self) -> CollectingView:
        """The state for the page."""
        url = self._url
        rows = segno.make(url, error="m", micro=False).matrix if url is not None else ()
        return CollectingView(
            url=url,
            token=grouped(self._token),
            code=["".join(map(str, row)) for row in rows],
            received=list(self._received),
            refused=list(self._refused),
        )

    def _filed(self, _name: str, filed: FiledSession) -> None:
        self._received.append(seen_as(ReceivedSession, filed))
        self._workspace.refresh()
        with suppress(UsageError):  # too many jobs are waiting, and one of them processes this session, too
            self._jobs.submit(JobRequest(kind="process"))
        self._publish("collecting", self.view())

    def _refuse(self, address: str, message: str) -> None:
        self._refused = [*self._refused, f"{address}: {message}"][-TOLD:]
        self._publish("collecting", self.view())
