"""Opening a survey: its site, and the session folders that a registered format recognises."""

from __future__ import annotations

import os
from pathlib import Path

from vislam2tag.errors import SurveyError
from vislam2tag.findings import Finding, Severity
from vislam2tag.sessions.registry import format_of
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import read_corrections, unused_corrections
from vislam2tag.survey.discover import read_site, session_folders
from vislam2tag.survey.model import SessionKey, SessionRef, Survey
from vislam2tag.survey.slugs import session_slugs


def open_survey(
    root: Path,
    default_sigma_m: float = Settings().default_landmark_sigma_m,
    landmark_file: Path | None = None,
) -> Survey:
    """Look at a survey folder: read the site's files, list the sessions, read none of them.

    ``default_sigma_m`` is the standard deviation per axis of landmarks whose file gives none; ``landmark_file``
    replaces the floors' own landmark files. Raises SurveyError where the folder is missing, no folder, cannot be
    looked into, holds no floor or no session, or where ``corrections.toml`` or ``landmark_file`` is wrong.
    """
    try:
        site, findings = read_site(root, default_sigma_m, landmark_file)
        sessions, odd_folders = _sessions(root)
    except OSError as error:
        raise SurveyError(f"{root}: cannot be looked into: {error}") from error
    if not sessions:
        locked = [f"; {folder.file} {folder.message}" for folder in odd_folders if folder.kind == "unreadable_folder"]
        raise SurveyError(
            f"{root}: not a survey: no session (a folder floor_K/DEVICE/SESSION with poses.csv) in it"
            + "".join(locked[:1])
        )
    keys = [key for key, _, _ in sessions]
    unused = unused_corrections(read_corrections(root), keys, site.landmarks)
    slugs = session_slugs(keys)
    refs = tuple(SessionRef(*session, slug) for session, slug in zip(sessions, slugs, strict=True))
    return Survey(root, site, refs, (*findings, *unused, *odd_folders))


def _sessions(root: Path) -> tuple[list[tuple[SessionKey, Path, str]], list[Finding]]:
    sessions = []
    folders, findings = session_folders(root)
    for key, folder in folders:
        path = os.fsencode(folder.relative_to(root)).decode("utf-8", errors="replace")
        name = format_of(folder)
        if "\ufffd" in path:
            message = "the folder's name is not UTF-8; left out: rename it"
            findings.append(_unrecognised(path, message, Severity.WARNING))
        elif name is None:
            findings.append(_unrecognised(path, "no file of a known session format in it; left out", Severity.INFO))
        else:
            sessions.append((key, folder, name))
    return sessions, findings


def _unrecognised(folder: str, message: str, severity: Severity) -> Finding:
    return Finding(kind="unrecognised_folder", file=folder, count=1, message=message, severity=severity)
