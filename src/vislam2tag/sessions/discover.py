"""Opening a survey: its site, and the session folders that a registered format recognises."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.errors import SurveyError
from vislam2tag.findings import Finding, Severity
from vislam2tag.sessions.registry import format_of
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import read_corrections, unused_corrections
from vislam2tag.survey.discover import read_site, session_folders
from vislam2tag.survey.model import SessionKey, SessionRef, Survey
from vislam2tag.survey.slugs import session_slugs


def open_survey(root: Path, default_sigma_m: float = Settings().default_landmark_sigma_m) -> Survey:
    """Look at a survey folder: read the site's files, list the sessions, read none of them.

    ``default_sigma_m`` is the standard deviation per axis of landmarks whose file gives none. Raises SurveyError
    where the folder is missing, no folder, holds no floor or no session, or ``corrections.toml`` is wrong.
    """
    site, findings = read_site(root, default_sigma_m)
    sessions: list[tuple[SessionKey, Path, str]] = []
    unknown: list[Finding] = []
    for key, folder in session_folders(root):
        name = format_of(folder)
        if name is None:
            unknown.append(_unrecognised(str(folder.relative_to(root))))
        else:
            sessions.append((key, folder, name))
    if not sessions:
        raise SurveyError(f"{root}: not a survey: no session (a folder floor_K/DEVICE/SESSION with poses.csv) in it")
    keys = [key for key, _, _ in sessions]
    unused = unused_corrections(read_corrections(root), keys, site.landmarks)
    slugs = session_slugs(keys)
    refs = tuple(SessionRef(*session, slug) for session, slug in zip(sessions, slugs, strict=True))
    return Survey(root, site, refs, (*findings, *unused, *unknown))


def _unrecognised(folder: str) -> Finding:
    message = "no file of a known session format in it; left out"
    return Finding(kind="unrecognised_folder", file=folder, count=1, message=message, severity=Severity.INFO)
