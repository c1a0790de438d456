"""Surveys join a fleet: copied into it where they lie elsewhere, looked at, and entered into its catalogue."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.folder_store import AnyStore, any_store_at
from vislam2tag.common.files.store import address_of, shown
from vislam2tag.common.files.stored_folder import is_safe_name
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_paths import AnyPath, paths_of
from vislam2tag.pipeline.fleet.catalogue import (
    CATALOGUE,
    CHANGED,
    DONE,
    FAILED,
    NEW,
    UNREADABLE,
    Fleet,
    FleetTotals,
    is_fleet,
)
from vislam2tag.pipeline.fleet.layout import SURVEYS, survey_name
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.sessions.registry import open_survey, survey_files
from vislam2tag.survey.links import CURE, left_out_files, links_in
from vislam2tag.survey.model import Survey
from vislam2tag.survey.settings import SurveySettings
from vislam2tag.survey.site_file import has_site_file, read_site_file
from vislam2tag.survey.stored_survey import survey_at_hand

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


def add_surveys(
    fleet: AnyPath,
    surveys: AnyPath | Sequence[AnyPath] = (),
    *,
    follow_links: bool = False,
    progress: Progress[str] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> FleetTotals:
    """Enter surveys into a fleet's catalogue; without any, all that lie in its folder ``surveys`` are looked at again.

    A survey that lies elsewhere, on this machine or in a store, is first copied to ``surveys/NAME``, by its folder's
    name. What links lead to outside it is not copied, of which ``tell`` hears, unless ``follow_links``
    is given. Raises UsageError where a name cannot be used or there is no fleet, SurveyError where one is no survey,
    StoreError where a store cannot be read or written.
    """
    fleet = Path(fleet)
    at = Fleet(fleet)
    known = {row["survey"]: row for row in at.catalogue().to_dicts()} if is_fleet(fleet) else {}
    names = [_joined(fleet, survey, follow_links, tell) for survey in paths_of(surveys)] or _lying_in(fleet)
    if not names:
        raise UsageError(f"{shown(fleet)}: no survey lies in its folder {SURVEYS}; name one: fleet add STORE SURVEY")
    rows = []
    for name in names:
        row, error = looked_at(fleet, name)
        if surveys and error is not None:
            raise error
        rows.append(_with_what_was_made(row, known.get(name)))
        progress(name, len(names))
    return at.change(rows)


def looked_at(fleet: Path, name: str) -> tuple[dict[str, object], SurveyError | None]:
    """The row of a survey that was never processed, and why it cannot be opened, if so."""
    folder = fleet / SURVEYS / name
    row = dict.fromkeys(CATALOGUE, None) | {"survey": name, "inputs": inputs_of(any_store_at(folder))}
    row |= dict.fromkeys(("sessions", "failed", "frames", "frames_labelled"), 0) | {
        "duration_s": 0.0,
        "distance_m": 0.0,
    }
    try:
        with survey_at_hand(folder) as root:
            return row | {"state": NEW} | described(open_survey(root)), None
    except SurveyError as error:
        return row | {"site": name, "floors": [], "devices": [], "state": UNREADABLE, "error": str(error)}, error


def described(survey: Survey) -> dict[str, object]:
    """What the catalogue says of a survey as it is found."""
    dates = sorted(found for ref in survey.sessions if (found := _date(ref.key.session)) is not None)
    title = read_site_file(survey.root).name if has_site_file(survey.root) else ""
    return {
        "site": title or survey.root.resolve().name,
        "floors": [floor.number for floor in survey.site.floors],
        "devices": sorted({ref.key.device for ref in survey.sessions}),
        "first_date": dates[0] if dates else None,
        "last_date": dates[-1] if dates else None,
        "sessions": len(survey.sessions),
    }


def inputs_of(store: AnyStore) -> str:
    """What tells a survey's files from any others, by their listing."""
    return key_of(sorted([file.name, file.size, file.version.mark] for file in store.list()))


def _with_what_was_made(row: dict[str, object], before: dict[str, object] | None) -> dict[str, object]:
    """Keep what an earlier row says of labels; where the files are others now, that they have changed."""
    if before is None or before["labels"] is None:
        return row
    kept = {
        name: before[name] for name in ("failed", "labels", "duration_s", "distance_m", "frames", "frames_labelled")
    }
    unchanged = before["inputs"] == row["inputs"] and before["state"] in (DONE, FAILED)
    if row["state"] == UNREADABLE:
        return row
    return row | kept | {"state": before["state"] if unchanged else CHANGED}


def _joined(fleet: Path, survey: Path, follow_links: bool, tell: Callable[[Sequence[Finding]], None]) -> str:
    """Copy a survey into the fleet unless it lies there; return its name."""
    name = survey_name(_whole(survey).name)
    source, target = (any_store_at(_whole(place)) for place in (survey, fleet / SURVEYS / name))
    if source == target:
        return name
    links = frozenset[str]() if follow_links or address_of(survey) else _outside_links(_whole(survey))
    files = [file for file in source.list() if is_safe_name(file.name) and not _is_below(file.name, links)]
    if links:
        tell([left_out_files(sorted(links)).model_copy(update={"file": name})])
    if not files:
        raise SurveyError(f"{shown(survey)}: nothing is there; give the folder of a survey")
    gone = {file.name for file in target.list()} - {file.name for file in files}
    with scratch_folder() as scratch:
        for file in files:
            source.fetch(file.name, scratch, "file")
            target.put(file.name, scratch / "file")
    target.delete(gone)
    return name


def _outside_links(root: Path) -> frozenset[str]:
    """Names of a survey's links that lead outside it, and of the sessions with such files, which are left out whole.

    Raises SurveyError where no session remains.
    """
    links = frozenset(link.name for link in links_in(root) if link.outside)
    sessions = survey_files(root, SurveySettings().landmark_sigma_m, walked=False).sessions
    outside = [found for found in sessions if found.from_outside]
    if outside and len(outside) == len(sessions):
        raise SurveyError(f"{root}: links lead to the files of all sessions outside the survey; {CURE}")
    folders = {path for found in outside for path in (found.folder, found.packed) if path is not None}
    return links | {path.relative_to(root).as_posix() for path in folders}


def _is_below(name: str, folders: frozenset[str]) -> bool:
    """Whether a file is one of these, or in one of them."""
    return any(str(part) in folders for part in (PurePosixPath(name), *PurePosixPath(name).parents))


def _lying_in(fleet: Path) -> list[str]:
    """Names of the surveys that lie in a fleet."""
    return [survey_name(name) for name in any_store_at(fleet / SURVEYS).folders()]


def _whole(place: Path) -> Path:
    return place if address_of(place) else place.resolve()


def _date(session: str) -> date | None:
    """The day that a session's name begins with."""
    found = _DATE.match(session)
    try:
        return date.fromisoformat(found[0]) if found else None
    except ValueError:
        return None
