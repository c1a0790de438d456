"""What a worker makes of a survey whose sessions are done: summary and report as process makes them, tables, pages.

Sessions reduce to their survey there, surveys to the fleet by the catalogue's rows, so that nobody holds all sessions.
A mark, ``reduced/SURVEY.json``, is removed before any of that changes and written when all of it is there: whatever
ends a run between, the next one finds no mark and reduces the survey again.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.folder_store import any_store_at
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.fleet.catalogue import DONE, FAILED
from vislam2tag.pipeline.fleet.layout import REDUCED, REPORT, SURVEYS
from vislam2tag.pipeline.fleet.tables import session_row, write_tables
from vislam2tag.pipeline.labels.process import opened_run
from vislam2tag.pipeline.labels.stored_session import Output
from vislam2tag.pipeline.run.keys import code_key
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.views.fleet_pages import session_page, survey_pages

_PAGE = re.compile(r"(index(_\d+)?|floor_.*)\.html")
"""Names of the pages about a survey and its sessions; what else people put beside them stays."""


@dataclass(frozen=True)
class SurveyJob:
    """All that a worker needs to reduce a survey."""

    fleet: Path
    survey: str
    settings: ProcessSettings
    out: Output
    code: str
    labels: str
    """Key of what the labels were made of."""
    follow_links: bool = False
    """Whether pages show what links lead to outside the survey."""

    @property
    def slug(self) -> str:
        """What tasks are called by."""
        return f"survey-{self.survey}"


@dataclass(frozen=True)
class SurveyOutcome:
    """What became of a survey: entries of its row in the catalogue."""

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


def reduction_code() -> str:
    """Key of the source that reduces surveys."""
    return code_key(__name__)


def is_reduced(fleet: Path, survey: str, labels: str) -> bool:
    """Whether summary, tables and pages of a survey are those of labels with this key."""
    found = any_store_at(fleet).get(_mark(survey))
    return found is not None and found.data == _mark_of(labels)


def reduce_survey(job: SurveyJob) -> SurveyOutcome:
    """Reduce a survey, write its part of the fleet's tables and report. One that cannot be opened has an error.

    Raises OutputError or StoreError where what it needs cannot be read or written.
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
        run = opened_run(root, job.settings, job.out, follow_links=job.follow_links)
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
    """What is told of a survey that could not be reduced."""
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
