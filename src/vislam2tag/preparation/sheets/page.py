"""One page of the PDF: the image, and around it what people need to hang and survey it."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib
import segno
from PIL import Image
from reportlab import rl_config
from reportlab.lib.utils import ImageReader
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.progress import Progress, silent
from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.page_layout import SCALE_BAR_M, Box, PageLayout
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest
from vislam2tag.preparation.sheets.tags import tag_box, tag_modules
from vislam2tag.site.sheet_size import QUIET_M

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
    """Replace what the typeface cannot draw; the QR code still holds the text as it is."""
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
        """Where it belongs, ``Main building, floor 1 (Ground)``; empty where nobody said."""
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
            parts.append("Place: x {:.2f} m, y {:.2f} m.".format(*self.request.position_m))
        return " ".join(parts)


def draw_page(canvas: Canvas, sheet: SheetPage, image: ImageReader) -> None:
    """Draw a sheet on a new page of the PDF."""
    paper = sheet.layout.paper
    canvas.setPageSize((paper.width_m * POINTS_A_METRE, paper.height_m * POINTS_A_METRE))
    canvas.scale(POINTS_A_METRE, POINTS_A_METRE)
    box = sheet.layout.image
    canvas.drawImage(image, box.left_m, box.low_m, box.width_m, box.height_m)
    _marks(canvas, sheet.layout)
    _head(canvas, sheet)
    _foot(canvas, sheet)
    canvas.showPage()


def _marks(canvas: Canvas, layout: PageLayout) -> None:
    canvas.setLineWidth(0.00025)
    for mark in layout.marks_m:
        canvas.line(*mark)


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
    _code(canvas, sheet.code, Box(QUIET_M + width - _QR_UNITS * unit, top - _QR_UNITS * unit, _QR_UNITS * unit, 0))
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


def _code(canvas: Canvas, text: str, box: Box) -> None:
    """A QR code as black runs, without its own white border: the paper is white."""
    _modules(canvas, segno.make_qr(text, error="m").matrix, box)


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
