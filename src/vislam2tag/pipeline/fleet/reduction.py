"""Tables of a fleet, one file per survey and floor: ``tables/TABLE/survey=SURVEY/floor=FLOOR/TABLE.parquet``.

Polars and DuckDB read them with one pattern and only open files that match a condition on ``survey`` and ``floor``. The
tables contain ``wifi`` and ``ble``; the larger tables of frames and sensors stay with each survey's labels.

A worker reduces a survey after its sessions: summary and report as by ``process``, tables, pages. Surveys are reduced
to the fleet by the catalogue's rows, so no process keeps all sessions in memory. A mark, ``reduced/SURVEY.json``, is
removed before any change and written at the end. If a run is interrupted, the next one finds no mark and reduces the
survey again.

The pages about a fleet as a whole only use its catalogue.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import polars as pl

from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.stored_folder import AnyStore, any_store_at
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.core.status import Status, labelled_share
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.fleet.catalogue import DONE, FAILED, LABELS, REDUCED, REPORT, SURVEYS, TABLES, Fleet, totals_of
from vislam2tag.pipeline.labels.label_run import opened_run
from vislam2tag.pipeline.run.keys import code_key
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import OpenedSurvey
from vislam2tag.pipeline.run.workers import Job
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.views.fleet_pages import fleet_pages, session_page, survey_pages

SESSIONS = "sessions"
HEARD = ("wifi", "ble")
SESSION_COLUMNS: dict[str, pl.DataType] = {
    "floor": pl.Int32(),
    "device": pl.String(),
    "session": pl.String(),
    "slug": pl.String(),
    "format": pl.String(),
    "strategy": pl.String(),
    "error": pl.String(),
    "duration_s": pl.Float64(),
    "distance_m": pl.Float64(),
    "frames": pl.Int64(),
    "frames_labelled": pl.Int64(),
    "labelled_share": pl.Float64(),
    "sigma_median_m": pl.Float64(),
    "sigma_p95_m": pl.Float64(),
    "wifi_scans": pl.Int64(),
    "visits": pl.Int64(),
    "findings": pl.Int64(),
}
"""Columns of ``sessions``; ``slug`` is the file-name stem of the session's outputs."""


def session_row(result: SessionResult) -> dict[str, Any]:
    """A session's row of the fleet's table ``sessions``."""
    frames = sum(count for status, count in result.frames.items() if status != Status.DUPLICATE.label)
    return {
        **{name: getattr(result, name) for name in SESSION_COLUMNS if name in SessionResult.model_fields},
        "frames": frames,
        "frames_labelled": result.frames.get(Status.OK.label, 0),
        "labelled_share": labelled_share(result.frames),
        "sigma_median_m": None if result.sigma is None else result.sigma.median_m,
        "sigma_p95_m": None if result.sigma is None else result.sigma.p95_m,
        "wifi_scans": 0 if result.scans is None else result.scans.scans,
        "visits": len(result.visits),
        "findings": sum(finding.count for finding in result.findings),
    }


def write_tables(fleet: Path, survey: str, rows: Sequence[dict[str, Any]]) -> None:
    """Write a survey's part of the fleet's tables, from ``rows`` and its labels, and remove its earlier files.

    A floor's readings are on this machine while they are written.
    """
    sessions = pl.DataFrame(rows, schema=SESSION_COLUMNS, orient="row")
    floors = sorted(sessions["floor"].unique())
    at = any_store_at(fleet / TABLES / SESSIONS / f"survey={survey}")
    _replace(at, SESSIONS, floors, sessions.lazy())
    for table in HEARD:
        _write_heard(fleet, survey, table, sessions["slug"].to_list())


def _write_heard(fleet: Path, survey: str, table: str, slugs: Sequence[str]) -> None:
    labels, to = any_store_at(fleet / LABELS / survey), any_store_at(fleet / TABLES / table / f"survey={survey}")
    with scratch_folder() as scratch:
        files: list[Path] = []
        for file in labels.list(table):
            slug = file.name.rpartition("/")[2].removesuffix(".parquet")
            if slug in slugs:
                files.append(scratch / f"{len(files):06d}.parquet")
                labels.fetch(f"{table}/{slug}.parquet", scratch, files[-1].name)
        found = scan_parquet(files) if files else pl.LazyFrame(schema={"floor": pl.Int32()})
        floors = found.select(pl.col("floor").unique().sort()).collect()["floor"].to_list()
        _replace(to, table, floors, found)


def _replace(to: AnyStore, table: str, floors: Iterable[int], rows: pl.LazyFrame) -> None:
    """Upload a file for each floor and remove those of other floors. The floor is only in the file's address."""
    ours = re.compile(rf"floor=-?\d+/{table}\.parquet")
    before, now = {file.name for file in to.list() if ours.fullmatch(file.name)}, set()
    for floor in floors:
        name = f"floor={floor}/{table}.parquet"
        with scratch_folder() as scratch:
            write_parquet(rows.filter(pl.col("floor") == floor).drop("floor"), scratch, table)
            to.put(name, scratch / table)
        now.add(name)
    to.delete(before - now)


_PAGE = re.compile(r"(index(_\d+)?|floor_.*)\.html")
"""Names of the pages about a survey and its sessions; other files are never removed."""


@dataclass(frozen=True)
class SurveyOutcome:
    """Outcome of a survey: entries of its row in the catalogue."""

    survey: str
    row: dict[str, Any]
    error: str | None
    """Why it could not be reduced."""

    @property
    def problem(self) -> str | None:
        """Why the survey is not done, unless its sessions say so themselves."""
        if self.error is not None:
            return self.error
        return None if self.row["state"] == DONE or self.row["failed"] else f"{self.survey}: {self.row['error']}"


@dataclass(frozen=True)
class SurveyJob(Job[SurveyOutcome]):
    """All that a worker needs to reduce a survey."""

    fleet: Path
    survey: str
    settings: ProcessSettings
    out: OutputFolder
    code: str
    labels: str
    """Key of the inputs of the labels."""
    follow_links: bool = False
    """Whether pages show what links lead to outside the survey."""

    @property
    def slug(self) -> str:
        """What tasks are called by."""
        return f"survey-{self.survey}"

    def code_here(self) -> str:
        """Key of the source that would reduce it in this process."""
        return reduction_code()

    def opened(self) -> AbstractContextManager[Callable[[], SurveyOutcome]]:
        """Reduce it as a whole: its sessions are read one at a time."""
        return nullcontext(partial(reduce_survey, self))

    def given_up(self, error: str) -> SurveyOutcome:
        """End it for an external cause."""
        return failed_survey(self.survey, error)


@cache
def reduction_code() -> str:
    """Key of the source that reduces surveys."""
    return code_key(__name__)


def is_reduced(fleet: Path, survey: str, labels: str) -> bool:
    """Whether summary, tables and pages of a survey are those of labels with this key."""
    found = any_store_at(fleet).get(_mark(survey))
    return found is not None and found.data == _mark_of(labels)


def reduce_survey(job: SurveyJob) -> SurveyOutcome:
    """Reduce a survey, and write its part of the fleet's tables and report. One that cannot be opened has an error.

    Raises OutputError or StoreError if files cannot be read or written.
    """
    fleet = any_store_at(job.fleet)
    fleet.delete([_mark(job.survey)])
    rows: list[dict[str, Any]] = []
    pages = any_store_at(job.fleet / REPORT / job.survey)
    before = {file.name for file in pages.list() if _PAGE.fullmatch(file.name)}
    written = set()

    def put(name: str, text: str) -> None:
        pages.put(name, text.encode("utf-8", errors="replace"))
        written.add(name)

    with survey_at_hand(job.fleet / SURVEYS / job.survey) as root:
        run = opened_run(OpenedSurvey.at(root, job.settings), job.out, follow_links=job.follow_links)
        shown = run.shown

        def take(result: SessionResult) -> None:
            rows.append(session_row(result))
            put(f"{result.slug}.html", session_page(shown, result))

        summary = run.reduced(take)
        for name, text in survey_pages(shown, summary, rows):
            put(name, text)
    write_tables(job.fleet, job.survey, rows)
    pages.delete(before - written)
    fleet.put(_mark(job.survey), _mark_of(job.labels))
    return SurveyOutcome(job.survey, _row(summary, rows), None)


def failed_survey(survey: str, error: Vislam2tagError | str) -> SurveyOutcome:
    """The outcome of a survey that could not be reduced."""
    return SurveyOutcome(survey, {}, f"{survey}: {error}")


def _mark(survey: str) -> str:
    return f"{REDUCED}/{survey}.json"


def _mark_of(labels: str) -> bytes:
    return (json.dumps({"labels": labels}) + "\n").encode()


def _row(summary: Summary, rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "state": DONE if summary.problem is None else FAILED,
        "sessions": summary.sessions,
        "failed": summary.failed,
        "error": summary.problem,
        "duration_s": summary.duration_s,
        "distance_m": summary.distance_m,
        "frames": sum(row["frames"] for row in rows),
        "frames_labelled": sum(row["frames_labelled"] for row in rows),
    }


def write_fleet_report(fleet: AnyPath) -> int:
    """Write ``report/index.html`` and, for many surveys, further pages; return their number.

    Raises UsageError if there is no fleet, StoreError if it cannot be written.
    """
    fleet = Path(fleet)
    table = Fleet(fleet).catalogue()
    store = any_store_at(fleet / REPORT)
    pages = list(fleet_pages(fleet.name, totals_of(table).model_dump(), table.to_dicts()))
    for name, text in pages:
        store.put(name, text.encode("utf-8", errors="replace"))
    return len(pages)
