"""The check without ground truth: a survey folder goes in; accuracies, bad landmarks and best places come out.

How much of the plans was walked is a part of it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Unpack

from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.whole_output import output_errors
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.check_session import CheckedSession, check_session
from vislam2tag.pipeline.labels.walked_floors import FloorWalked, WalkPlaces, walked_floors
from vislam2tag.pipeline.run.selection import OpenedSurvey, RunChoices
from vislam2tag.quality.landmark_gain import GainMap
from vislam2tag.quality.self_check import bad_landmarks, judgement_of
from vislam2tag.quality.self_check_record import FloorCheck, SessionCheck, SurveyCheck
from vislam2tag.site.links import left_out_of, shared_survey
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.views.check_page import write_check_page

CHECK_FILE, PAGE_FILE = "check.json", "check.html"


def check(
    survey_root: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    out: AnyPath | None = None,
    walkable: WalkableSettings | None = None,
    follow_links: bool = False,
    progress: Progress[SessionCheck] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    **choices: Unpack[RunChoices],
) -> SurveyCheck:
    """Check a survey against itself: leave out each landmark or fix in turn, session by session.

    docs/explanation/self-check.md tells more.

    What was walked of the space that can be walked on the plans is found by ``walkable``. Plans and other site files
    that links lead to outside the survey are not shown, unless ``follow_links`` is given; ``tell`` is called with their
    names. With ``out`` all is written there as ``check.json`` and ``check.html``. ``landmarks``, ``selection`` and
    ``jobs`` are as :class:`RunChoices` says. Raises SurveyError where ``survey_root`` is no survey or ``landmarks`` no
    landmark file for it, UsageError for a selection that matches nothing, OutputError where ``out`` cannot be written;
    a bad session is only counted in ``SurveyCheck.failed``.
    """
    opened, out = OpenedSurvey.at(survey_root, settings, **choices), path_or_none(out)
    survey, settings, refs = opened.survey, opened.settings, opened.refs
    if out is not None:
        opened.refuse_output(out, _checked_before(out))
        _make_folder(out)
    early: dict[str, CheckedSession] = {}
    sessions: list[SessionCheck] = []
    gains, places = GainMap(), list[WalkPlaces]()

    def report(checked: CheckedSession) -> None:
        """Add sessions up as they end, in the survey's order, so that sums do not depend on the workers."""
        early[checked.record.slug] = checked
        while len(sessions) < len(refs) and (following := early.pop(refs[len(sessions)].slug, None)):
            sessions.append(following.record)
            gains.add(following.gains)
            places.extend(following.places)
        progress(checked.record, len(refs))

    opened.run_all(partial(check_session, settings), opened.tasks(refs), report=report)
    shown = shared_survey(survey, follow_links=follow_links)
    tell(left_out_of(shown.findings))
    walked = walked_floors(shown.root, shown.site, places, walkable)
    bad = bad_landmarks([session for session in sessions if not session.fixes])
    doubtful = sum(len(session.doubtful_fixes) for session in sessions)
    found = SurveyCheck(
        version=__version__,
        max_sigma_m=settings.labels.model_dump(mode="json")["max_sigma_m"],
        sessions=sessions,
        floors=[_with_rooms(floor, walked) for floor in gains.floors(survey.site.landmarks)],
        bad_landmarks=[one.model_copy(update={"room": _room(walked, one.floor, one.surveyed_m)}) for one in bad],
        judgement=judgement_of(sessions, len(bad) + doubtful),
        walked=[floor.record for floor in walked.values()],
    )
    if out is not None:
        folder = Folder.at(out)
        with output_errors(out / CHECK_FILE):
            folder.write(CHECK_FILE, json.dumps(found.model_dump(mode="json"), indent=1) + "\n")
        spaces = {number: floor.space for number, floor in walked.items()}
        with output_errors(out / PAGE_FILE):
            page = folder.without_links(PAGE_FILE)
        write_check_page(page, shown, found, gains, spaces)
    return found


def _with_rooms(floor: FloorCheck, walked: Mapping[int, FloorWalked]) -> FloorCheck:
    """Say of each proposed place in which room it is, where the plan tells."""
    rooms = [_room(walked, floor.number, (place.x_m, place.y_m)) for place in floor.places]
    places = [
        place.model_copy(update={"near": ", ".join(filter(None, (room and f"in {room}", place.near)))})
        for place, room in zip(floor.places, rooms, strict=True)
    ]
    return floor.model_copy(update={"places": places})


def _room(walked: Mapping[int, FloorWalked], floor: int, place_m: tuple[float, float]) -> str:
    """What people call the room or corridor at a place; empty where it has no name."""
    space = walked[floor].space if floor in walked else None
    return "" if space is None else space.areas.of_place(place_m)


def _checked_before(out: Path) -> list[str]:
    """Slugs of the sessions that the check in a folder is about; none if it contains no check that can be read."""
    try:
        before = SurveyCheck.model_validate_json(read_bytes(out / CHECK_FILE))
    except (OSError, ValidationError):
        return []
    return [session.slug for session in before.sessions]


def _make_folder(out: Path) -> None:
    try:
        Folder.at(out).make()
    except OSError as error:
        reason = "a file, not a folder" if out.is_file() else error.strerror
        raise OutputError(f"{out}: cannot be the output folder ({reason}); choose another --out") from error
