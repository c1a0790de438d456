"""One page of the PDF: the image, an AprilTag beside it, and around it what people need to hang and survey it."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import matplotlib
import numpy as np
import polars as pl
import segno
from PIL import Image
from reportlab import rl_config
from reportlab.lib.utils import ImageReader
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from vislam2tag.common.errors import SurveyError, UsageError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.settings import QUIET_M, SHEET_SIZES, SheetSize
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest
from vislam2tag.site.model import landmark_id

SCALE_BAR_M = 0.100
"""Length of the scale bar, on every size of paper: what a ruler shows."""
MARK_GAP_M = 0.0015
"""White between the image and a centre mark."""
MARK_M = 0.0045
"""Length of a centre mark: it ends 4 mm from the paper's edge, which printers reach."""
_HEAD_UNITS = 22
_TOLERANCE_M = 1e-6


@dataclass(frozen=True)
class Box:
    """A rectangle: lower left corner, width and height, metres."""

    left_m: float
    low_m: float
    width_m: float
    height_m: float

    @property
    def centre_m(self) -> tuple[float, float]:
        """Its middle."""
        return self.left_m + self.width_m / 2, self.low_m + self.height_m / 2


@dataclass(frozen=True)
class PageLayout:
    """A sheet's paper and the image on it; text grows with the paper, by ``unit_m`` (1 mm on A4)."""

    paper: SheetSize
    image: Box
    unit_m: float
    head_m: float
    """Height above the lower edge at which the space above the image starts."""
    foot_m: float
    """Height above the lower edge at which the space below the image ends."""

    @property
    def marks_m(self) -> tuple[tuple[float, float, float, float], ...]:
        """Lines (x, y, x, y) outside the image that point at its centre: left, right, below, above."""
        x, y = self.image.centre_m
        near, far = MARK_GAP_M, MARK_GAP_M + MARK_M
        left, right = self.image.left_m, self.image.left_m + self.image.width_m
        low, high = self.image.low_m, self.image.low_m + self.image.height_m
        return (
            (left - far, y, left - near, y),
            (right + near, y, right + far, y),
            (x, low - far, x, low - near),
            (x, high + near, x, high + far),
        )


def largest_width_m(paper: SheetSize, aspect: float) -> float:
    """Width of the largest image of this height over width that fits on the paper, in whole millimetres (down)."""
    return int(1000 * paper.image_m / max(1.0, aspect) + _TOLERANCE_M) / 1000


def page_layout(paper: SheetSize, width_m: float, aspect: float, landmark: str) -> PageLayout:
    """Lay out a sheet: the image's centre is in the middle of the largest square that fits on the paper.

    ``aspect`` is the image's height over its width. Raises UsageError where the image is larger than that.
    """
    if width_m > largest_width_m(paper, aspect) + _TOLERANCE_M:
        raise UsageError(_too_wide(paper, width_m, aspect, landmark))
    unit = paper.width_m / 210
    side = paper.image_m
    top = paper.height_m - _HEAD_UNITS * unit
    middle = (paper.width_m / 2, top - side / 2)
    image = Box(middle[0] - width_m / 2, middle[1] - width_m * aspect / 2, width_m, width_m * aspect)
    return PageLayout(paper, image, unit, top, top - side)


def _too_wide(paper: SheetSize, width_m: float, aspect: float, landmark: str) -> str:
    most = largest_width_m(paper, aspect)
    enough = [name for name, size in SHEET_SIZES.items() if largest_width_m(size, aspect) >= width_m]
    advice = f"choose {' or '.join(enough[:2])}" if enough else "no paper size is large enough: make it smaller"
    return (
        f"landmark {landmark}: an image {width_m:g} m wide does not fit {paper.name} with {QUIET_M * 1000:.0f} mm "
        f"white margin (at most {most:g} m); {advice}"
    )


PLAIN, BOLD = "DejaVuSans", "DejaVuSans-Bold"
MISSING = "\N{REPLACEMENT CHARACTER}"


@cache
def _typeface() -> frozenset[int]:
    """Make the fonts known to ReportLab; return the code points that both draw."""
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    drawn: list[set[int]] = []
    for name in (PLAIN, BOLD):
        font = TTFont(name, str(folder / f"{name}.ttf"))
        pdfmetrics.registerFont(font)
        drawn.append(set(font.face.charToGlyph))
    return frozenset(set.intersection(*drawn))


def printable(text: str) -> str:
    """Replace what the typeface cannot draw; the QR code still contains the text as it is."""
    known = _typeface()
    return "".join(letter if ord(letter) in known else MISSING for letter in text)


POINTS_A_METRE = 72 / 0.0254
USUAL_HEIGHT_M = 1.4
"""Where the middle of a sheet hangs if nothing else is planned: where a walker holds the phone."""
_QR_UNITS = 26
_ID_UNITS = 26
"""Height of the id's line."""
_NOTE = "Position mark: please do not remove, move or cover."
_RULER = "100 mm: measure it. Longer or shorter? Print again at 100 % (actual size)."


@dataclass(frozen=True)
class SheetPage:
    """A page to draw."""

    request: SheetRequest
    layout: PageLayout
    tag: int | None = None
    """Number of the AprilTag below the picture; None: without."""

    @property
    def place(self) -> str:
        """Where it belongs, ``Main building, floor 1 (Ground)``; empty where no one said."""
        number = "" if self.request.floor is None else f"floor {self.request.floor}"
        name = self.request.floor_name
        floor = f"{number} ({name})" if number and name and name.lower() != number else number or name
        return ", ".join(filter(None, (self.request.building, floor)))

    @property
    def code(self) -> str:
        """Text of its QR code: building, floor and landmark between slashes, as far as known."""
        floor = "" if self.request.floor is None else str(self.request.floor)
        return "/".join(filter(None, (self.request.building, floor, self.request.landmark)))

    @property
    def hanging(self) -> str:
        """How it is to hang."""
        height = USUAL_HEIGHT_M if self.request.height_m is None else self.request.height_m
        parts = [
            f"Image {self.layout.image.width_m:.3f} m wide.",
            f"Hang its centre {height:.2f} m above the floor.",
        ]
        if self.request.position_m is not None:
            near = f" ({self.request.near})" if self.request.near else ""
            parts.append("Place: x {:.2f} m, y {:.2f} m".format(*self.request.position_m) + f"{near}.")
        return " ".join(parts)


def draw_page(canvas: Canvas, sheet: SheetPage, image: ImageReader) -> None:
    """Draw a sheet on a new page of the PDF."""
    paper = sheet.layout.paper
    canvas.setPageSize((paper.width_m * POINTS_A_METRE, paper.height_m * POINTS_A_METRE))
    canvas.scale(POINTS_A_METRE, POINTS_A_METRE)
    box = sheet.layout.image
    canvas.drawImage(image, box.left_m, box.low_m, box.width_m, box.height_m)
    canvas.setLineWidth(0.00025)
    for mark in sheet.layout.marks_m:
        canvas.line(*mark)
    _head(canvas, sheet)
    _foot(canvas, sheet)
    canvas.showPage()


def _head(canvas: Canvas, sheet: SheetPage) -> None:
    """Place to the left, the arrow that points up to the right, above the image."""
    unit = sheet.layout.unit_m
    low = sheet.layout.head_m + 7 * unit
    right = sheet.layout.paper.width_m - QUIET_M
    arrow = canvas.beginPath()
    arrow.moveTo(right - 6 * unit, low)
    arrow.lineTo(right, low)
    arrow.lineTo(right - 3 * unit, low + 6 * unit)
    arrow.close()
    canvas.drawPath(arrow, stroke=0, fill=1)
    _text(canvas, "UP", right - 14 * unit, low, BOLD, 4 * unit, 7 * unit)
    _text(canvas, sheet.place, QUIET_M, low, BOLD, 5 * unit, right - QUIET_M - 20 * unit)


def _foot(canvas: Canvas, sheet: SheetPage) -> None:
    """Id, QR code, notes and scale bar, below the image."""
    unit, top = sheet.layout.unit_m, sheet.layout.foot_m - 8 * sheet.layout.unit_m
    width = sheet.layout.paper.width_m - 2 * QUIET_M
    if sheet.tag is not None:
        box = tag_box(sheet.layout)
        _modules(canvas, tag_modules(sheet.tag), box)
        width = box.left_m - 8 * unit - QUIET_M
    code = segno.make_qr(sheet.code, error="m").matrix  # without a white border of its own: the paper is white
    _modules(canvas, code, Box(QUIET_M + width - _QR_UNITS * unit, top - _QR_UNITS * unit, _QR_UNITS * unit, 0))
    text_width = width - (_QR_UNITS + 6) * unit
    _text(canvas, sheet.request.landmark, QUIET_M, top - 20 * unit, BOLD, _ID_UNITS * unit, text_width)
    _text(canvas, sheet.hanging, QUIET_M, top - 28 * unit, PLAIN, 3.6 * unit, text_width)
    _text(canvas, _NOTE, QUIET_M, top - 34 * unit, BOLD, 3.6 * unit, text_width)
    _scale_bar(canvas, QUIET_M, top - 43 * unit, unit)


def _scale_bar(canvas: Canvas, left_m: float, low_m: float, unit_m: float) -> None:
    """A bar of 100 mm with a tick every 10 mm, and what it is for."""
    canvas.setLineWidth(0.0003)
    canvas.line(left_m, low_m, left_m + SCALE_BAR_M, low_m)
    for tick in range(11):
        x = left_m + SCALE_BAR_M * tick / 10
        canvas.line(x, low_m, x, low_m + (0.003 if tick % 5 else 0.0045))
    _text(canvas, _RULER, left_m, low_m - 4 * unit_m, PLAIN, 3 * unit_m, 1.0)


def _modules(canvas: Canvas, rows: Sequence[bytes | bytearray], box: Box) -> None:
    """Square modules as black runs."""
    side = box.width_m / len(rows)
    for index, row in enumerate(rows):
        low = box.low_m + (len(rows) - 1 - index) * side
        for start, stop in _runs(row):
            canvas.rect(box.left_m + start * side, low, (stop - start) * side, side, stroke=0, fill=1)


def _runs(row: bytes | bytearray) -> list[tuple[int, int]]:
    """Start and stop of each run of dark modules."""
    edges = [i for i in range(len(row) + 1) if bool(row[i - 1] if i else 0) != bool(row[i] if i < len(row) else 0)]
    return list(zip(edges[::2], edges[1::2], strict=True))


def _text(canvas: Canvas, text: str, left_m: float, low_m: float, font: str, size_m: float, width_m: float) -> None:
    """Write a line in a size of at most ``size_m``, smaller where it would be wider than ``width_m``."""
    shown = printable(text)
    wide = pdfmetrics.stringWidth(shown, font, size_m)
    canvas.setFont(font, size_m * min(1.0, width_m / wide) if wide else size_m)
    canvas.drawString(left_m, low_m, shown)


def write_pdf(
    folder: Folder,
    name: str,
    sheets: Sequence[SheetPage],
    images: Mapping[str, GreyImage],
    progress: Progress[str] = silent,
) -> None:
    """Write a page for each sheet with its image (height, width); raises OSError where that cannot be."""
    rl_config.useA85 = 0  # images as bytes, not as text a quarter longer
    content = io.BytesIO()
    canvas = Canvas(content, invariant=1, pageCompression=1)
    canvas.setTitle("Landmarks")
    canvas.setViewerPreference("PrintScaling", "None")
    readers: dict[str, ImageReader] = {}
    for sheet in sheets:
        landmark = sheet.request.landmark
        if landmark not in readers:
            readers[landmark] = ImageReader(Image.fromarray(images[landmark]))
        canvas.bookmarkPage(f"page {canvas.getPageNumber()}")
        canvas.addOutlineEntry(
            printable(f"{sheet.place}: {landmark}" if sheet.place else landmark), f"page {canvas.getPageNumber()}"
        )
        draw_page(canvas, sheet, readers[landmark])
        progress(landmark, len(sheets))
    canvas.save()
    folder.write(name, content.getvalue())


TAG_FAMILY, TAG_COUNT = "apriltag-36h11", 587
"""Its numbers differ in 11 modules at least, and are 0 to 586."""
TAG_FILE = "tags.csv"
"""Beside the images: ``id,family,number,side_m,right_m,up_m``."""
_SIDE_UNITS, _GAP_UNITS = 56, 8
_MODULES = 8
_SCHEMA = {
    "id": pl.String,
    "family": pl.String,
    "number": pl.Int64,
    **dict.fromkeys(("side_m", "right_m", "up_m"), pl.Float64),
}


@dataclass(frozen=True)
class SheetTag:
    """A tag on a sheet: its number, the side of its black square, and its centre from that of the picture, metres to
    the right and up as one looks at the sheet.
    """

    number: int
    side_m: float
    right_m: float
    up_m: float


def tag_number(landmark: str) -> int:
    """The number of a landmark's tag, which is its id; raises UsageError where the family has no such number."""
    if not landmark.isascii() or not landmark.isdecimal() or int(landmark) >= TAG_COUNT:
        raise UsageError(
            f"landmark {landmark}: a tag of {TAG_FAMILY} needs an id from 0 to {TAG_COUNT - 1}: change the landmark's "
            "id, or print without --tag"
        )
    return int(landmark)


def tag_box(layout: PageLayout) -> Box:
    """Where a sheet's tag is: below the picture, at the right, its side a whole number of millimetres."""
    top = layout.foot_m - _GAP_UNITS * layout.unit_m
    side = int(1000 * min(_SIDE_UNITS * layout.unit_m, top - QUIET_M)) / 1000
    return Box(layout.paper.width_m - QUIET_M - side, top - side, side, side)


def sheet_tag(number: int, layout: PageLayout) -> SheetTag:
    """The tag of a sheet, as it is printed."""
    box = tag_box(layout)
    (x, y), (image_x, image_y) = box.centre_m, layout.image.centre_m
    return SheetTag(number, box.width_m, round(x - image_x, 6), round(y - image_y, 6))


def tag_modules(number: int) -> list[bytes]:
    """Rows of a tag's modules from above, black is 1, with its black edge."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    drawn = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, _MODULES, borderBits=1))
    return [bytes(row) for row in (drawn < 128).astype(np.uint8)]


def tag_rows(tags: dict[str, SheetTag]) -> str:
    """The content of :data:`TAG_FILE`."""
    rows = (
        (landmark, TAG_FAMILY, str(tag.number), *(f"{value:g}" for value in (tag.side_m, tag.right_m, tag.up_m)))
        for landmark, tag in tags.items()
    )
    return csv_rows((tuple(_SCHEMA), *rows))


def read_tags(images: Path) -> dict[str, SheetTag]:
    """Read the tags of a folder of images by landmark; none where the sheets were printed without.

    Raises SurveyError where the file is not understood.
    """
    path = images / TAG_FILE
    if not path.is_file():
        return {}
    try:
        rows = read_csv(path, schema=_SCHEMA).drop_nulls()
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SurveyError(
            f"{path}: expected {','.join(_SCHEMA)} as `vislam2tag sheets` writes it ({first_line(error)})"
        ) from error
    return {landmark_id(row[0]): SheetTag(*row[2:]) for row in rows.iter_rows()}
