"""Detects landmarks in pictures of walks from other apps, and writes a table to each session's folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.common.errors import OutputError, SessionError, UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.common.progress import Progress, Stage, silent
from vislam2tag.common.tabular import TabularResult
from vislam2tag.sessions.apps import SIGHTINGS_FILE, AppFormat
from vislam2tag.sessions.registry import FORMATS, at_hand, format_for, open_survey
from vislam2tag.site.links import write_in_survey
from vislam2tag.site.model import SessionRef

if TYPE_CHECKING:
    from vislam2tag.preparation.detect_landmarks import Detector, PictureSighting, Search


@dataclass(frozen=True, repr=False)
class SightingsFound(TabularResult):
    """Result for one session's pictures: ``landmarks`` are the ids found; ``skipped`` or ``error`` give the reason why
    none were searched for.
    """

    session: str
    landmarks: tuple[str, ...] = ()
    sightings: int = 0
    doubtful: int = 0
    missing: int = 0
    skipped: str = ""
    error: str = ""


def _detectors(
    images: Path | None, family: str | None, side_m: float | None, qr_side_m: float | None
) -> list[Detector]:
    """Create detectors of sheets with images in a folder, of tags of a family and of QR codes, with their sizes.

    Raises UsageError if none is requested, or the family is unknown or has no size.
    """
    from vislam2tag.preparation.detect_landmarks import (
        TAG_FAMILIES,
        qr_detector,
        sheet_detector,
        sheet_tag_detector,
        tag_detector,
    )
    from vislam2tag.preparation.sheets.page import read_tags

    if images is None and family is None and qr_side_m is None:
        raise UsageError(
            "no landmarks to search for; use --images (a folder of `sheets`), --tags with --tag-side-m, or --qr-side-m"
        )
    found: list[Detector] = [] if images is None else [sheet_detector(images)]
    if images is not None and (printed := read_tags(images)):
        found.append(sheet_tag_detector(printed))
    if qr_side_m is not None:
        found.append(qr_detector(qr_side_m))
    if family is not None:
        if family not in TAG_FAMILIES:
            raise UsageError(f"--tags {family}: unknown family; choose one of {', '.join(TAG_FAMILIES)}")
        if side_m is None:
            raise UsageError("--tags needs --tag-side-m, the side of the black square in metres; measure a printed tag")
        found.append(tag_detector(family, side_m))
    return found


def sightings(
    root: AnyPath,
    images: AnyPath | None = None,
    tags: str | None = None,
    tag_side_m: float | None = None,
    qr_side_m: float | None = None,
    again: bool = False,
    progress: Progress[SightingsFound] = silent,
    within: Progress[Stage] = silent,
) -> list[SightingsFound]:
    """Search the pictures of each session and write :data:`SIGHTINGS_FILE` to its folder.

    Landmarks are sheets with ``images`` in a folder, ``tags`` of a family with a black square of this side, and QR
    codes of a side with texts that end in the id. ``progress`` is called for each finished session, ``within`` with
    the number of finished sessions, including the finished part of the current one.
    Sessions that already have that file are skipped, unless ``again``. A session with unusable pictures has an
    error. Raises SurveyError if ``root`` is not a survey, UsageError as the detectors do.
    """
    root, images = Path(root), path_or_none(images)
    detectors = _detectors(images, tags, tag_side_m, qr_side_m)
    survey = open_survey(root)
    found = list[SightingsFound]()
    for ref in survey.sessions:
        part = _part_of(within, str(ref.key), len(found), len(survey.sessions))
        one = _of_session(survey.root, ref, detectors, again, part)
        found.append(one)
        progress(one, len(survey.sessions))
    return found


def _part_of(within: Progress[Stage], session: str, done: int, sessions: int) -> Progress[int]:
    """Report the progress of one session as a part of all."""
    return lambda passed, pictures: within(Stage(session, done + passed / pictures), sessions)


def _of_session(
    root: Path, ref: SessionRef, detectors: Sequence[Detector], again: bool, progress: Progress[int]
) -> SightingsFound:
    known = FORMATS.named(ref.format) if ref.format in FORMATS.names() else None
    if not isinstance(known, AppFormat):
        return SightingsFound(str(ref.key), skipped=f"pictures of the format {ref.format} cannot be searched")
    target = ref.folder / SIGHTINGS_FILE
    if target.exists() and not again:
        return SightingsFound(str(ref.key), skipped=f"{SIGHTINGS_FILE} already exists; use --replace to search again")
    from vislam2tag.preparation.detect_landmarks import search

    try:
        with at_hand(ref, whole=True) as here:
            format_for(here)
            pictures = known.pictures(here.folder)
            if pictures is None:
                return SightingsFound(str(ref.key), error="it has no pictures")
            outcome = search(pictures, detectors, progress)
        write_in_survey(root, target, _table(outcome.sightings))
    except (SessionError, OutputError, OSError) as error:
        return SightingsFound(str(ref.key), error=str(error))
    return _summary(ref, outcome)


def _summary(ref: SessionRef, outcome: Search) -> SightingsFound:
    ids = tuple(dict.fromkeys(each.landmark for each in outcome.sightings))
    return SightingsFound(str(ref.key), ids, len(outcome.sightings), outcome.doubtful, outcome.missing)


def _table(sightings: Sequence[PictureSighting]) -> bytes:
    """Rows as described in docs/reference/formats.md: metres to a tenth of a millimetre."""
    lines = []
    for each in sightings:
        numbers = [*each.pose.position_m.tolist(), *each.pose.orientation.tolist(), each.pose.sigma_m]
        lines.append(f"{each.landmark}; {each.time_ns}; " + "; ".join(f"{number:.6f}" for number in numbers) + "\n")
    return "".join(lines).encode()
