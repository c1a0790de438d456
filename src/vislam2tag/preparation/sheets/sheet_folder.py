"""All steps of ``vislam2tag sheets``, and the folder that it writes: PDF, images, manifest and a record."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import polars as pl
from PIL import Image
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import SurveyError, UsageError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.common.progress import Progress, counted, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.preparation.sheets.images import (
    ImageQuality,
    LandmarkImage,
    Likeness,
    confused,
    generated_image,
    lookalikes,
    own_files,
    own_images,
)
from vislam2tag.preparation.sheets.page import (
    TAG_FILE,
    SheetPage,
    SheetTag,
    largest_width_m,
    page_layout,
    printable,
    sheet_tag,
    tag_number,
    tag_rows,
    write_pdf,
)
from vislam2tag.preparation.sheets.settings import SheetSettings, SheetSize, sheet_size
from vislam2tag.preparation.sheets.sheet_requests import MOST_SHEETS, SheetRequest, requested_sheets
from vislam2tag.site.model import is_reserved, landmark_id, unique_slugs


def image_names(ids: Sequence[str]) -> tuple[str, ...]:
    """Name the image file of each id, ``lobby.png``; ids that would share a name get a hash of the id."""
    return tuple(f"{slug}.png" for slug in unique_slugs([_plain(name) for name in ids], ids))


def _plain(name: str) -> str:
    """Make a name that is neither empty, hidden nor reserved."""
    shown = name.replace(":", "").lstrip(".")
    return f"landmark-{shown}" if not shown or is_reserved(shown) else shown


PDF_FILE, RECORD_FILE, IMAGE_FOLDER, MANIFEST_FILE = "sheets.pdf", "sheets.json", "images", "manifest.csv"
_PAIRS_NAMED = 10


class ImageRecord(Record):
    """One image: what the phone loads, and what was measured of it."""

    landmark: str
    file: str
    width_m: float
    height_m: float
    attempt: int
    """Pictures of this id that were thrown away before."""
    quality: ImageQuality
    most_like: str
    """The other image of the set that it is most like; empty where none comes near."""
    most_like_inliers: int


class PageRecord(Record):
    """One page of the PDF."""

    page: int
    landmark: str
    floor: int | None
    sheet: str
    width_m: float
    code: str
    """Text of its QR code."""


class SheetsRecord(Result):
    """``sheets.json``."""

    main_table: ClassVar[str] = "pages"

    version: str
    seed: int | None
    """None: the images are the user's own."""
    images: tuple[ImageRecord, ...]
    pages: tuple[PageRecord, ...]
    findings: tuple[Finding, ...]


def is_sheets(folder: Path) -> bool:
    """Whether a folder contains sheets."""
    try:
        SheetsRecord.model_validate_json(read_bytes(folder / RECORD_FILE))
    except (OSError, ValidationError):
        return False
    return True


def lay_out_sheets(
    requests: Sequence[SheetRequest],
    images: Sequence[LandmarkImage],
    paper: SheetSize,
    width_m: float | None,
    *,
    tagged: bool = False,
) -> tuple[SheetPage, ...]:
    """Lay out a sheet for each landmark; ``paper`` and ``width_m`` are for those that name none themselves.

    ``tagged`` sheets have an AprilTag. Raises UsageError where an image does not fit, one id would have images of two
    widths, or an id is not a number that a tag may have.
    """
    aspects = {image.landmark: image.pixels.shape[0] / image.pixels.shape[1] for image in images}
    widths: dict[str, float] = {}
    sheets = []
    for one in requests:
        aspect, size = aspects[one.landmark], one.sheet or paper
        width = one.width_m or width_m or largest_width_m(size, aspect)
        if widths.setdefault(one.landmark, width) != width:
            raise UsageError(
                f"landmark {one.landmark}: its image is {widths[one.landmark]:g} m wide on one floor, {width:g} m on "
                "another; a phone needs a single width for each image: use one width, or give each floor's landmark "
                "its own id"
            )
        tag = tag_number(one.landmark) if tagged else None
        sheets.append(SheetPage(one, page_layout(size, width, aspect, one.landmark), tag))
    return tuple(sheets)


def checked_lookalikes(
    images: Sequence[LandmarkImage], seed: int | None, progress: Progress[str]
) -> tuple[Likeness, ...]:
    """Measure how like the images of a set are; raises UsageError or SurveyError where two would be confused."""
    found = tuple(lookalikes(images, progress))
    pairs = confused([image.landmark for image in images], found)
    if pairs:
        more = ", ..." if len(pairs) > _PAIRS_NAMED else ""
        message = f"these images would be confused: {', '.join(pairs[:_PAIRS_NAMED])}{more}"
        raise (
            SurveyError(f"{message}; replace one of each")
            if seed is None
            else UsageError(f"--seed {seed}: {message}; choose another seed")
        )
    return found


def sheets_record(
    sheets: Sequence[SheetPage],
    images: Sequence[LandmarkImage],
    likeness: Sequence[Likeness],
    seed: int | None,
    findings: Sequence[Finding] = (),
) -> SheetsRecord:
    """Sum up what is made: files, pages, what was measured, and what is worth knowing."""
    files = image_names([image.landmark for image in images])
    boxes = {sheet.request.landmark: sheet.layout.image for sheet in sheets}
    return SheetsRecord(
        version=__version__,
        seed=seed,
        images=tuple(
            ImageRecord(
                landmark=image.landmark,
                file=f"{IMAGE_FOLDER}/{file}",
                width_m=boxes[image.landmark].width_m,
                height_m=round(boxes[image.landmark].height_m, 6),
                attempt=image.attempt,
                quality=image.quality,
                most_like=other,
                most_like_inliers=inliers,
            )
            for image, file, (other, inliers) in zip(images, files, likeness, strict=True)
        ),
        pages=tuple(_page(number, sheet) for number, sheet in enumerate(sheets, start=1)),
        findings=(*findings, *_notes(sheets, images)),
    )


def write_sheets(
    folder: Folder,
    record: SheetsRecord,
    sheets: Sequence[SheetPage],
    images: Sequence[LandmarkImage],
    progress: Progress[str] = silent,
) -> None:
    """Write PDF, images, manifest and record into an empty folder; raises OSError where that cannot be."""
    for image, row in zip(images, record.images, strict=True):
        with folder.writing(row.file) as file:
            Image.fromarray(image.pixels).save(file, "PNG", optimize=True)
    folder.write(f"{IMAGE_FOLDER}/{MANIFEST_FILE}", _manifest_rows(record.images))
    tags = _tags(sheets)
    if tags:
        folder.write(f"{IMAGE_FOLDER}/{TAG_FILE}", tag_rows(tags))
    write_pdf(folder, PDF_FILE, sheets, {image.landmark: image.pixels for image in images}, progress)
    folder.write(RECORD_FILE, record.model_dump_json(indent=1) + "\n")


def _tags(sheets: Sequence[SheetPage]) -> dict[str, SheetTag]:
    """The tags by landmark; raises UsageError where one landmark's sheets have them at two places."""
    tags: dict[str, SheetTag] = {}
    for sheet in sheets:
        if sheet.tag is not None:
            own, name = sheet_tag(sheet.tag, sheet.layout), sheet.request.landmark
            if tags.setdefault(name, own) != own:
                raise UsageError(
                    f"landmark {name}: its tag would be at another position on another paper: use the same paper for it"
                )
    return tags


def _page(number: int, sheet: SheetPage) -> PageRecord:
    return PageRecord(
        page=number,
        landmark=sheet.request.landmark,
        floor=sheet.request.floor,
        sheet=sheet.layout.paper.name,
        width_m=sheet.layout.image.width_m,
        code=sheet.code,
    )


def image_widths(folder: Path) -> dict[str, float]:
    """Read the widths of a folder's images by landmark, metres, as ``sheets`` wrote them beside the images.

    Raises SurveyError where the file is missing or is not understood.
    """
    path = folder / MANIFEST_FILE
    try:
        rows = read_csv(path, schema={"id": pl.String, "file": pl.String, "width_m": pl.Float64})
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SurveyError(
            f"{path}: expected id,file,width_m as `vislam2tag sheets` writes it ({first_line(error)})"
        ) from error
    widths = {landmark_id(name): width for name, width in rows.select("id", "width_m").iter_rows() if name and width}
    if not all(0 < width < math.inf for width in widths.values()):
        raise SurveyError(f"{path}: widths must be above 0, metres")
    return widths


def _manifest_rows(images: Sequence[ImageRecord]) -> str:
    """What a phone loads: ``id,file,width_m``, one row an image, UTF-8, quoted as RFC 4180 says."""
    rows = ((image.landmark, Path(image.file).name, f"{image.width_m:g}") for image in images)
    return csv_rows((("id", "file", "width_m"), *rows))


def _notes(sheets: Sequence[SheetPage], images: Sequence[LandmarkImage]) -> list[Finding]:
    """What is worth knowing of the sheets that were made."""
    floors = Counter(sheet.request.landmark for sheet in sheets)
    twice = [name for name, count in floors.items() if count > 1]
    odd = [name for name in floors if printable(name) != name]
    again = [image.landmark for image in images if image.attempt]
    notes: tuple[tuple[FindingKind, list[str], str], ...] = (
        (
            "same_image",
            twice,
            "have the same image on several floors: a walk over these floors cannot distinguish them",
        ),
        ("unprintable_id", odd, "have letters that the sheets' font cannot print; the QR code contains them"),
        ("generated_anew", again, "have another picture, because the first was not suitable"),
    )
    return [
        Finding(kind=kind, file="", count=len(names), message=f"{_listed(names)} {text}", severity=severity)
        for (kind, names, text), severity in zip(notes, (Severity.WARNING, Severity.INFO, Severity.INFO), strict=True)
        if names
    ]


def _listed(names: Sequence[str]) -> str:
    more = ", ..." if len(names) > _PAIRS_NAMED else ""
    return f"landmarks {', '.join(names[:_PAIRS_NAMED])}{more}"


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

    Raises OutputError where it contains something else or cannot be written, UsageError and SurveyError as the steps
    do.
    """
    out = Path(out)
    paper = sheet_size(options.settings.paper)
    files = {} if options.images is None else own_files(Path(options.images))
    requests, findings = _requests(options, files)
    names = tuple(dict.fromkeys(one.landmark for one in requests))
    if len(names) > MOST_SHEETS:
        raise UsageError(
            f"{len(names)} landmarks: a phone's database contains at most {MOST_SHEETS} images; select some with --ids"
        )
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
            f"{options.images}: contains no image of landmark {', '.join(missing[:_NAMED])}; add it as ID.png"
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
