"""All steps of ``vislam2tag sheets``: landmarks, their images, whether these can be told apart, the folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.whole_folder import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, counted, silent
from vislam2tag.common.text_paths import AnyPath, path_or_none
from vislam2tag.preparation.sheets.images import LandmarkImage, generated_image, own_files, own_images
from vislam2tag.preparation.sheets.settings import SheetSettings
from vislam2tag.preparation.sheets.sheet_folder import (
    SheetsRecord,
    checked_lookalikes,
    is_sheets,
    lay_out_sheets,
    sheets_record,
    write_sheets,
)
from vislam2tag.preparation.sheets.sheet_requests import MOST_SHEETS, SheetRequest, requested_sheets
from vislam2tag.site.sheet_size import sheet_size

_NAMED = 10
"""Landmarks that a message names."""


@dataclass(frozen=True)
class SheetOptions:
    """What is asked for."""

    source: AnyPath | None = None
    """Site's folder, or file of landmarks."""
    ids: str | None = None
    images: AnyPath | None = None
    """Folder of users' own images; None: they are generated."""
    tag: bool = False
    """Print an AprilTag below the picture."""
    settings: SheetSettings = field(default_factory=SheetSettings)


def make_sheets(options: SheetOptions, out: AnyPath, progress: Progress[int] = silent) -> SheetsRecord:
    """Make the sheets into ``out``, which appears whole or not at all.

    Raises OutputError where it holds something else or cannot be written, UsageError and SurveyError as the steps do.
    """
    out = Path(out)
    paper = sheet_size(options.settings.paper)
    files = {} if options.images is None else own_files(Path(options.images))
    requests, findings = _requests(options, files)
    names = tuple(dict.fromkeys(one.landmark for one in requests))
    if len(names) > MOST_SHEETS:
        raise UsageError(f"{len(names)} landmarks: a phone's database holds {MOST_SHEETS} images; pick some with --ids")
    total = 2 * len(names) + len(requests)
    step = counted(progress, total)
    seed = options.settings.seed if options.images is None else None
    with whole_folder(out, is_sheets) as folder:
        images = _images(options, files, names, step)
        sheets = lay_out_sheets(requests, images, paper, options.settings.width_m, tagged=options.tag)
        record = sheets_record(sheets, images, checked_lookalikes(images, seed, step), seed, findings)
        write_sheets(folder, record, sheets, images, step)
    return record


def _requests(options: SheetOptions, files: Mapping[str, Path]) -> tuple[tuple[SheetRequest, ...], tuple[Finding, ...]]:
    if options.images is not None and options.source is None and options.ids is None:
        return tuple(SheetRequest(name) for name in files), ()
    requests, findings = requested_sheets(path_or_none(options.source), options.ids)
    missing = [] if options.images is None else [one.landmark for one in requests if one.landmark not in files]
    if missing:
        raise SurveyError(
            f"{options.images}: holds no image of landmark {', '.join(missing[:_NAMED])}; add it as ID.png"
        )
    return requests, findings


def _images(
    options: SheetOptions, files: Mapping[str, Path], names: Sequence[str], step: Progress[str]
) -> tuple[LandmarkImage, ...]:
    if options.images is not None:
        return own_images(Path(options.images), {name: files[name] for name in names}, step)
    images = []
    for name in names:
        images.append(generated_image(options.settings.seed, name))
        step(name, len(names))
    return tuple(images)
