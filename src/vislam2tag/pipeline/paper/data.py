"""The surveys of the paper's data, found wherever they lie below one folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.discover import floor_folders, subfolders
from vislam2tag.site.model import SessionKey, SessionRef, Survey

DEPTH = 2
"""Surveys are looked for in the folder itself and this many levels below."""


@dataclass(frozen=True)
class PaperData:
    """All surveys below a folder, sorted by path; where two hold one session, the first counts."""

    root: Path
    surveys: tuple[Survey, ...]

    def find(self, key: SessionKey) -> tuple[Survey, SessionRef]:
        """Return a session and its survey; raises SessionError where there is none of this key."""
        for survey in self.surveys:
            for ref in survey.sessions:
                if ref.key == key:
                    return survey, ref
        raise SessionError(f"{key} is not in this data")

    def refs(self) -> list[tuple[Survey, SessionRef]]:
        """Every session once, with its survey; those that corrections exclude are left out."""
        found: dict[SessionKey, tuple[Survey, SessionRef]] = {}
        for survey in self.surveys:
            corrections = read_corrections(survey.root)
            for ref in survey.sessions:
                if not corrections.excludes(ref.key):
                    found.setdefault(ref.key, (survey, ref))
        return list(found.values())


def open_paper_data(root: Path) -> PaperData:
    """Look for surveys in ``root`` and below; raises SurveyError where there is none."""
    # A folder without a survey is opened all the same: that says what is wrong with it.
    return PaperData(root, tuple(open_survey(folder) for folder in _survey_folders(root, DEPTH) or [root]))


def _survey_folders(folder: Path, depth: int) -> list[Path]:
    """The folder itself if it holds floors, else the surveys in its subfolders."""
    try:
        floor_folders(folder)
    except SurveyError:
        inside = _subfolders(folder) if depth else []
        return [found for below in inside for found in _survey_folders(below, depth - 1)]
    return [folder]


def _subfolders(folder: Path) -> list[Path]:
    try:
        return subfolders(folder)
    except OSError:
        return []


def read_mappable(survey: Survey, ref: SessionRef, settings: ProcessSettings) -> tuple[Session, Landmarks]:
    """Read a session and the landmarks that it may use, corrected; raises SessionError where it cannot be read."""
    prepared = prepared_session(session_task(ref, survey, read_corrections(survey.root), settings))
    return prepared.session, prepared.landmarks
