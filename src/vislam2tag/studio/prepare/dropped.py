"""Files dropped on the page: kept while the studio runs, plans among them looked at and made floors."""

from __future__ import annotations

import io
import re
import secrets
import threading
from contextlib import ExitStack
from itertools import count
from pathlib import Path

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.pipeline.site.init import NewFloor, add_floor, settled_source
from vislam2tag.site.names import portable_name
from vislam2tag.site.plans.load import look_at_plan, plan_called, plan_extent, unplaced_picture
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.site_file import has_site_file, read_site_file
from vislam2tag.studio.prepare.messages import AddedFloor, DroppedFile, FloorRequest, PlanLookView
from vislam2tag.studio.workspace import Workspace

MOST_FILE = 200_000_000
"""Bytes of a file: no plan may have more."""
KEPT = 20
"""Files kept; the oldest goes."""
_FIRST_BELOW = 900_000_000
"""Where files' numbers begin at most: a number in a path has up to nine digits."""
_SIDE_PX = 2400
_UNSAFE = re.compile(r"[^\w. ()+-]")


class DroppedFiles:
    """Files by number, each in a folder of its own under the name that it had; used by several threads."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._held = ExitStack()
        self._scratch = self._held.enter_context(scratch_folder())
        self._lock = threading.Lock()
        self._files: dict[int, Path] = {}
        self._numbers = count(secrets.randbelow(_FIRST_BELOW))  # a page's draft must not find a file of a later run

    def close(self) -> None:
        """Forget all files."""
        self._held.close()

    def keep(self, name: str, content: bytes) -> DroppedFile:
        """Keep a file; raises UsageError for an empty one, or a name that cannot be a file's."""
        plain = portable_name(_UNSAFE.sub("_", name.replace("\\", "/").rpartition("/")[2])[-100:])
        if not plain:
            raise UsageError(f"{name!r} is no name of a file; rename it")
        if not content:
            raise UsageError(f"{plain}: is empty; choose another file")
        with self._lock:
            number = next(self._numbers)
            self._scratch.write(f"{number}/{plain}", content)
            self._files[number] = self._scratch / f"{number}/{plain}"
            for old in list(self._files)[:-KEPT]:
                self._files.pop(old)
                self._scratch.remove_tree(str(old))
        return DroppedFile(id=number, name=plain)

    def path(self, number: int) -> Path:
        """Where a file lies; raises KeyError where there is none."""
        if number not in self._files:
            raise KeyError("file of that number")
        return self._files[number]


def look(path: Path, source: PlanSource, root: Path) -> PlanLookView:
    """What a plan shows before it has a scale; raises SurveyError where it cannot be read."""
    with plan_called(path.name):
        found = look_at_plan(path, source)
    return PlanLookView(
        name=path.name,
        box=found.box,
        building=found.building,
        is_picture=found.is_picture,
        downwards=found.downwards,
        paper_m=found.paper_m,
        has_scale=_has_scale(path, source, root),
        levels=list(found.levels),
    )


def _has_scale(path: Path, source: PlanSource, root: Path) -> bool:
    part = read_site_file(root).georeference if has_site_file(root) else None
    try:
        plan_extent(path, source, None if part is None else part.georeference())
    except OSError:
        return False
    return True


def picture_png(path: Path, source: PlanSource) -> bytes:
    """The plan between its box as PNG; raises SurveyError where it cannot be drawn."""
    buffer = io.BytesIO()
    with plan_called(path.name):
        unplaced_picture(path, source, _SIDE_PX).save(buffer, "png")
    return buffer.getvalue()


def add_dropped(workspace: Workspace, path: Path, request: FloorRequest) -> AddedFloor:
    """Make a dropped plan a floor as ``vislam2tag site init`` does; raises what that raises."""
    if request.part.plan is None:
        raise UsageError("say how the plan is to be read")
    asked = request.part.plan.model_copy(update={"file": path.name})
    source, notes = settled_source(path, asked, whole=request.whole)
    add_floor(workspace.root, NewFloor(path, request.part.model_copy(update={"plan": source})))
    workspace.refresh()
    return AddedFloor(floor=request.part.number, notes=notes)
