"""Writes a survey's studio as a folder of static files, whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.whole_folder import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.studio.guard import CONTENT_POLICY, PAGE
from vislam2tag.studio.radio.maps import Radio, made_radio, radio_job
from vislam2tag.studio.sharing.answers import plan_file, shown_outputs, survey_answers, walk_answer
from vislam2tag.studio.sharing.private import Hiding, export_privacy
from vislam2tag.studio.sharing.tables import write_output, write_radio
from vislam2tag.studio.survey_view import plan_png
from vislam2tag.studio.workspace import Workspace

EXPORT_FILE = "export.json"
"""Marks a folder as ours."""
PROGRAM = "vislam2tag studio"
DATA = "data"
PLAN_PIXELS = 2048
_OUTSIDE_WALKS = 2
"""Steps of a survey's progress besides those of its walks: what is told of all of them, and radio maps."""


class ExportRecord(Record):
    """What was written."""

    program: str = PROGRAM
    surveys: int
    """One, or those in a fleet's list."""
    sessions: int
    """Walks that can be looked at; of a fleet those of surveys with labels."""
    left_out: int = 0
    """Sessions and files that are left out, because links lead to them outside their survey."""
    files: int
    size_bytes: int


def export_survey(
    workspace: Workspace,
    out: Path,
    key: bytes | None = None,
    progress: Progress[str] = silent,
    *,
    follow_links: bool = False,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> ExportRecord:
    """Write a survey's studio; addresses are hashed with ``key``, without one with a new key that nobody keeps.

    What links lead to outside the survey is left out, of which ``tell`` hears, unless ``follow_links`` is given. Raises
    SurveyError where nothing remains, OutputError where the folder holds anything else, or cannot be written.
    """
    with new_export(out) as folder:
        write_page(folder, DATA)
        left_out = write_survey(workspace, folder.folder(DATA), key, progress, follow_links=follow_links)
        tell(left_out)
        return recorded(folder, 1, len(workspace.now.ids), left_out)


def new_export(out: Path) -> AbstractContextManager[Folder]:
    """Yield an empty folder that becomes ``out``, or raise OutputError (:func:`whole_folder`)."""
    return whole_folder(out, lambda folder: (folder / EXPORT_FILE).is_file(), "--export")


def write_page(folder: Folder, data: str) -> None:
    """Copy the page, with where its data lies and what it may load written into it."""
    text = read_bytes(PAGE / "index.html").decode()
    notes = (
        f'<meta http-equiv="Content-Security-Policy" content="{CONTENT_POLICY}" />\n'
        f'    <meta name="vislam2tag-data" content="{data}" />'
    )
    text = re.sub(r'(<meta charset="[^"]*" />)', rf"\1\n    {notes}", text, count=1)
    folder.write("index.html", text)
    for file in (PAGE / "assets").iterdir():
        folder.copy(file, f"assets/{file.name}")


def write_survey(
    workspace: Workspace,
    folder: Folder,
    key: bytes | None,
    progress: Progress[str] = silent,
    *,
    follow_links: bool = False,
) -> tuple[Finding, ...]:
    """Write what the page shows of a survey; return what is left out, because links lead to it outside the survey."""
    if not follow_links:
        workspace.leave_out_links()
    outputs = shown_outputs(workspace)
    steps = len(workspace.now.ids) * (1 + len(outputs)) + _OUTSIDE_WALKS
    hiding = Hiding(workspace)

    radio = _radio(workspace, key, follow_links)
    if radio is not None:
        write_radio(radio, folder.folder("radio"))
    progress("radio maps", steps)
    for address, record in survey_answers(workspace, radio):
        folder.write(f"{address}.json", hiding.json(record))
    for floor in workspace.now.survey.site.floors:
        if floor.plan is not None and floor.extent_m is not None:
            folder.write(plan_file(floor.number), plan_png(floor, PLAN_PIXELS))
    progress("survey", steps)
    for id in workspace.now.ids:
        address, record = walk_answer(workspace, id)
        folder.write(f"{address}.json", hiding.json(record))
        progress(id, steps)
    for output in outputs:
        write_output(workspace, output, folder.folder(f"tracks/{output}"), lambda id: progress(id, steps))
    return workspace.left_out


def recorded(folder: Folder, surveys: int, sessions: int, left_out: Sequence[Finding]) -> ExportRecord:
    """Mark the folder as whole, and tell what is in it."""
    sizes = [file.stat().st_size for file in folder.path.rglob("*") if file.is_file()]
    record = ExportRecord(
        surveys=surveys,
        sessions=sessions,
        left_out=sum(finding.count for finding in left_out),
        files=len(sizes),
        size_bytes=sum(sizes),
    )
    folder.write(EXPORT_FILE, record.model_dump_json(indent=1) + "\n")
    return record


def _radio(workspace: Workspace, key: bytes | None, follow_links: bool) -> Radio | None:
    """Radio maps of the labels as they are; None where nothing is labelled or heard often enough."""
    try:
        return made_radio(radio_job(workspace, export_privacy(key), follow_links=follow_links))
    except DatasetError:
        return None
