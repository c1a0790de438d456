"""The studio of a survey as static, read-only files (docs/how-to/share.md), and other folders to share.

``answers`` provides the JSON. Tables are Parquet files, which the page reads by byte ranges: statistics of row groups
show their sessions, floors and places, so a walk or a part of a floor needs only a few ranges.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, SessionError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import FiniteRecord, Record
from vislam2tag.datasets.folder import is_dataset
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.labeling.results import RESULTS
from vislam2tag.pipeline.datasets.build import BuildOptions, SessionStep, build_dataset
from vislam2tag.pipeline.datasets.finish import PAGE_FILE
from vislam2tag.studio.answers import (
    export_privacy,
    hidden_texts,
    json_without,
    plan_file,
    shown_outputs,
    survey_answers,
    walk_answer,
)
from vislam2tag.studio.guard import CONTENT_POLICY, PAGE
from vislam2tag.studio.outputs import FULL, joined
from vislam2tag.studio.radio import NUMBER, STRONGEST, Radio, made_radio, radio_job
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.session_view import overview, scans_table, series_columns, session_series
from vislam2tag.studio.survey_view import plan_png
from vislam2tag.studio.workspace import Workspace, beside

EXPORT_FILE = "export.json"
"""Marks a folder as ours."""
PROGRAM = "vislam2tag studio"
DATA = "data"
PLAN_PIXELS = 2048
_OUTSIDE_WALKS = 2
"""Steps of a survey's progress besides those of its walks: overviews and radio maps."""


class ExportRecord(Record):
    """What was written."""

    program: str = PROGRAM
    surveys: int
    """One, or those in a fleet's list."""
    sessions: int
    """Walks that can be viewed; for a fleet those of surveys with labels."""
    left_out: int = 0
    """Sessions and files that are skipped because links lead to them outside their survey."""
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
    """Write a survey's studio; addresses are hashed with ``key``, or with a new key that is not stored.

    ``tell`` is called with files that are skipped because links lead to them outside the survey, unless
    ``follow_links`` is given. Raises SurveyError if nothing remains, OutputError if the folder contains anything else
    or cannot be written.
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
    """Copy the page, and insert the address of its data and its content policy."""
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
    """Write the page's data of a survey; return files that are skipped because links to them lead outside it."""
    if not follow_links:
        workspace.leave_out_links()
    outputs = shown_outputs(workspace)
    steps = len(workspace.now.ids) * (1 + len(outputs)) + _OUTSIDE_WALKS
    hidden = hidden_texts(workspace)

    radio = _radio(workspace, key, follow_links)
    if radio is not None:
        write_radio(radio, folder.folder("radio"))
    progress("radio maps", steps)
    for address, record in survey_answers(workspace, radio):
        folder.write(f"{address}.json", json_without(record, hidden))
    for floor in workspace.now.survey.site.floors:
        if floor.plan is not None and floor.extent_m is not None:
            folder.write(plan_file(floor.number), plan_png(floor, PLAN_PIXELS))
    progress("survey", steps)
    for id in workspace.now.ids:
        address, record = walk_answer(workspace, id)
        folder.write(f"{address}.json", json_without(record, hidden))
        progress(id, steps)
    for output in outputs:
        write_output(workspace, output, folder.folder(f"tracks/{output}"), lambda id: progress(id, steps))
    return workspace.left_out


def recorded(folder: Folder, surveys: int, sessions: int, left_out: Sequence[Finding]) -> ExportRecord:
    """Mark the folder as complete, and return its contents."""
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
    """Radio maps of the current labels; None if nothing is labelled or received often enough."""
    try:
        return made_radio(radio_job(workspace, export_privacy(key), follow_links=follow_links))
    except DatasetError:
        return None


GROUP_ROWS = 8192
"""Rows per group: about four minutes of frames, so that the list of groups at the file's end is short."""
CHART_POINTS = 2000
STRIDE = "stride"
"""Key of the stride in an overview's metadata."""
LAYERS_OF_POINT = ("mean_dbm", "heard", "deviation_db", "sigma_db")
_FRAMES = {"session": np.uint16, **FULL}
_SERIES = {"session": np.uint16, "series": np.uint8, "t": np.float32, "v": np.float32}


def write_output(workspace: Workspace, output: str, folder: Folder, done: Callable[[str], None]) -> None:
    """Write the walks of an output: overview, all frames, scans and charts; ``done`` is called for each walk."""
    columns, stride = overview(workspace, output)
    write_rows(pl.DataFrame(dict(columns)), folder, "overview.parquet", {STRIDE: str(stride)})
    write_rows(scans_table(workspace, output), folder, "scans.parquet")
    with scratch_folder(folder) as scratch:
        for index, id in enumerate(workspace.now.ids):
            write_rows(_frames(workspace, index, output), scratch, f"frames/{index:06d}.parquet")
            write_rows(_series(workspace, index, output), scratch, f"series/{index:06d}.parquet")
            done(id)
        for name, schema in (("frames", _FRAMES), ("series", _SERIES)):
            parts = sorted((scratch / name).glob("*"))
            whole = scan_parquet(parts) if parts else pl.DataFrame({k: np.empty(0, v) for k, v in schema.items()})
            write_rows(whole, folder, f"{name}.parquet")


def write_radio(radio: Radio, folder: Folder) -> None:
    """Write the maps of each floor and technology: of all access points together, and those of each as a group."""
    for maps in radio.floors:
        floor, technology = maps.place.floor, maps.place.technology
        layers = {name: radio.layer(floor, technology, name, "")[1].ravel() for name in (STRONGEST, NUMBER)}
        write_rows(pl.DataFrame(layers), folder, f"{floor}-{technology}-all.parquet")
        cells = pl.DataFrame({name: getattr(maps, name).astype(np.float32).ravel() for name in LAYERS_OF_POINT})
        write_rows(cells, folder, f"{floor}-{technology}.parquet", group_rows=maps.grid.rows * maps.grid.columns)


def _frames(workspace: Workspace, index: int, output: str) -> pl.DataFrame:
    track = workspace.track(workspace.now.ids[index], output)
    return pl.DataFrame(dict(joined([] if track is None else [(index, track)], tuple(FULL))))


def _series(workspace: Workspace, index: int, output: str) -> pl.DataFrame:
    try:
        found = session_series(workspace, workspace.now.ids[index], output)
    except SessionError:  # the list of walks contains it
        found = {}
    columns = series_columns(found, CHART_POINTS, (-np.inf, np.inf))
    return pl.DataFrame({"session": np.full(len(columns["t"]), index, np.uint16), **columns})


def write_rows(
    table: pl.DataFrame | pl.LazyFrame,
    folder: Folder,
    name: str,
    notes: dict[str, str] | None = None,
    group_rows: int = GROUP_ROWS,
) -> None:
    """Write a table for the page in groups of rows, with ``notes`` as metadata of the file."""
    write_parquet(table, folder, name, compression="snappy", row_group_size=group_rows, metadata=notes)


DATASET, SHARED_PAGE = "dataset", "page"


class SharedFolder(FiniteRecord):
    """A folder that can be shared."""

    folder: str
    file: str
    """Its file to open in a browser."""
    files: int
    size_bytes: int
    stale: bool
    """There are newer labels."""


class SharedView(FiniteRecord):
    """The shared folder of the survey; None if there is none."""

    dataset: SharedFolder | None
    page: SharedFolder | None


def make_dataset(
    workspace: Workspace, no_ssid: bool, hash_bssid: bool, jobs: int, progress: Progress[SessionStep] = silent
) -> None:
    """Build the data set, after updating outdated labels; addresses are hashed with a key that is not stored.

    Raises what ``vislam2tag dataset`` raises.
    """
    settings = workspace.settings
    options = BuildOptions(
        labels=workspace.out,
        labelling=settings,
        walkable=settings.walkable,
        privacy=Privacy(hash_key=secrets.token_bytes(32) if hash_bssid else None, keep_ssids=not no_ssid),
    )
    build_dataset(
        workspace.root, beside(workspace.root, DATASET), settings.dataset, options, jobs=jobs, progress=progress
    )


def make_page(workspace: Workspace, progress: Progress[str] = silent) -> None:
    """Write the page; raises what ``vislam2tag studio --export`` raises."""
    export_survey(workspace, beside(workspace.root, SHARED_PAGE), progress=progress)


@endpoint("GET", "/api/shared")
def shared_view(workspace: Workspace) -> SharedView:
    """The shared folders next to the survey."""
    dataset, page = (beside(workspace.root, name) for name in (DATASET, SHARED_PAGE))
    results = (workspace.out / RESULTS).glob("*.json")
    newest_ns = max((file.stat().st_mtime_ns for file in results), default=0)
    return SharedView(
        dataset=_shared(dataset, PAGE_FILE, newest_ns) if is_dataset(dataset) else None,
        page=_shared(page, "index.html", newest_ns) if (page / EXPORT_FILE).is_file() else None,
    )


def _shared(folder: Path, file: str, newest_ns: int) -> SharedFolder:
    found = [path.stat() for path in folder.rglob("*") if path.is_file()]
    return SharedFolder(
        folder=str(folder),
        file=file,
        files=len(found),
        size_bytes=sum(stat.st_size for stat in found),
        stale=(folder / file).stat().st_mtime_ns < newest_ns,
    )
