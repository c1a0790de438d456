"""Adds surveys to a fleet: copies them if they are elsewhere, reads them, and enters them into its catalogue."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from pathlib import Path

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.given_files import AnyPath, paths_of
from vislam2tag.common.files.store import address_of, shown
from vislam2tag.common.files.stored_folder import AnyStore, any_store_at
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.pipeline.fleet.catalogue import (
    CATALOGUE,
    CHANGED,
    DONE,
    FAILED,
    NEW,
    SURVEYS,
    UNREADABLE,
    Fleet,
    FleetTotals,
    is_fleet,
    survey_name,
)
from vislam2tag.pipeline.fleet.raw_copy import AddedSurvey, RawCopy, planned_copy
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.sessions.registry import open_survey, survey_files
from vislam2tag.site.links import CURE, left_out_files, links_in, site_name
from vislam2tag.site.model import Survey
from vislam2tag.site.settings import SurveySettings
from vislam2tag.site.stored_survey import survey_at_hand

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


def add_surveys(
    fleet: AnyPath,
    surveys: AnyPath | Sequence[AnyPath] = (),
    *,
    name: str | None = None,
    replace: bool = False,
    follow_links: bool = False,
    progress: Progress[AddedSurvey] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> FleetTotals:
    """Enter surveys into a fleet's catalogue; without any, all in its folder ``surveys`` are read again.

    A survey that is elsewhere, on this machine or in a store, is first copied to ``surveys/NAME``: by its folder's name
    or, for a single one, by ``name``. If the fleet contains a survey of that name, only new files are
    added. Files that differ are refused unless ``replace`` is given: their former versions are then kept in
    ``replaced/NAME``. No file of a survey is removed. Files that links lead to outside the survey are not copied, and
    ``tell`` is called with them, unless ``follow_links`` is given. ``progress`` is called with what changed of each
    survey.

    Raises UsageError if a name cannot be used, if the fleet contains another survey of that name or other versions of
    files, and if there is no fleet; nothing is copied then. Raises SurveyError if one is not a survey, StoreError if a
    store cannot be read or written.
    """
    fleet = Path(fleet)
    at = Fleet(fleet)
    known = {row["survey"]: row for row in at.catalogue().to_dicts()} if is_fleet(fleet) else {}
    given = [_whole(survey) for survey in paths_of(surveys)]
    todo: Sequence[RawCopy | AddedSurvey] = [AddedSurvey(survey=each) for each in _present(fleet)]
    if given:
        names = _names(given, name)
        left_out = {survey: _outside_links(survey) for survey in given if not follow_links and not address_of(survey)}
        todo = _copies(fleet, given, names, replace, left_out)
        linked = [(survey, left_out_files(sorted(links))) for survey, links in left_out.items() if links]
        tell([finding.model_copy(update={"file": str(survey)}) for survey, finding in linked])
    if not todo:
        raise UsageError(
            f"{shown(fleet)}: its folder {SURVEYS} contains no survey; add one with fleet add STORE SURVEY"
        )
    rows = []
    for each in todo:
        changes = each.carry_out() if isinstance(each, RawCopy) else each
        row, error = looked_at(fleet, changes.survey)
        if given and error is not None:
            raise error
        rows.append(_with_what_was_made(row, known.get(changes.survey)))
        progress(changes, len(todo))
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
    """The catalogue's row of a survey."""
    dates = sorted(found for ref in survey.sessions if (found := _date(ref.key.session)) is not None)
    return {
        "site": site_name(survey.root) or survey.root.resolve().name,
        "floors": [floor.number for floor in survey.site.floors],
        "devices": sorted({ref.key.device for ref in survey.sessions}),
        "first_date": dates[0] if dates else None,
        "last_date": dates[-1] if dates else None,
        "sessions": len(survey.sessions),
    }


def inputs_of(store: AnyStore) -> str:
    """A mark of a survey's files, from their listing."""
    return key_of(sorted([file.name, file.size, file.version.mark] for file in store.list()))


def _with_what_was_made(row: dict[str, object], before: dict[str, object] | None) -> dict[str, object]:
    """Keep the labels of an earlier row, with the state for changed files if they differ."""
    if before is None or before["labels"] is None:
        return row
    kept = {
        name: before[name] for name in ("failed", "labels", "duration_s", "distance_m", "frames", "frames_labelled")
    }
    unchanged = before["inputs"] == row["inputs"] and before["state"] in (DONE, FAILED)
    if row["state"] == UNREADABLE:
        return row
    return row | kept | {"state": before["state"] if unchanged else CHANGED}


def _names(surveys: Sequence[Path], name: str | None) -> list[str]:
    """Names of surveys in the fleet; raises UsageError if two would have the same name."""
    if name is not None and len(surveys) != 1:
        raise UsageError("--name applies to one survey; give exactly one SURVEY with it")
    names = [survey_name(survey.name if name is None else name) for survey in surveys]
    (most, uses), *_ = Counter(names).most_common(1)
    if uses > 1:
        alike = " and ".join(shown(survey) for survey, own in zip(surveys, names, strict=True) if own == most)
        raise UsageError(
            f"{alike}: these surveys would have the same name in the fleet; add each separately with --name"
        )
    return names


def _copies(
    fleet: Path,
    surveys: Sequence[Path],
    names: Sequence[str],
    replace: bool,
    left_out: Mapping[Path, frozenset[str]],
) -> list[RawCopy | AddedSurvey]:
    """Files to copy for each survey, all compared before the first copy; surveys in the fleet are kept."""
    return [
        AddedSurvey(survey=own)
        if any_store_at(survey) == any_store_at(_whole(fleet / SURVEYS / own))
        else planned_copy(fleet, survey, own, replace=replace, left_out=left_out.get(survey, frozenset()))
        for survey, own in zip(surveys, names, strict=True)
    ]


def _outside_links(root: Path) -> frozenset[str]:
    """Names of a survey's links that lead outside it, and of the sessions with such files, which are skipped.

    Raises SurveyError if no session remains.
    """
    links = frozenset(link.name for link in links_in(root) if link.outside)
    sessions = survey_files(root, SurveySettings().landmark_sigma_m, walked=False).sessions
    outside = [found for found in sessions if found.from_outside]
    if outside and len(outside) == len(sessions):
        raise SurveyError(f"{root}: links lead to the files of all sessions outside the survey; {CURE}")
    folders = {path for found in outside for path in (found.folder, found.packed) if path is not None}
    return links | {path.relative_to(root).as_posix() for path in folders}


def _present(fleet: Path) -> list[str]:
    """Names of the surveys that are in a fleet."""
    return [survey_name(name) for name in any_store_at(fleet / SURVEYS).folders()]


def _whole(place: Path) -> Path:
    return place if address_of(place) else place.resolve()


def _date(session: str) -> date | None:
    """The date at the start of a session's name."""
    found = _DATE.match(session)
    try:
        return date.fromisoformat(found[0]) if found else None
    except ValueError:
        return None
