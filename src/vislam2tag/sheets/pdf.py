"""All sheets as one PDF in true size; the same sheets give the same bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PIL import Image
from reportlab import rl_config
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas

from vislam2tag.sheets.features import GreyImage
from vislam2tag.sheets.fonts import printable
from vislam2tag.sheets.page import Sheet, draw_page


def write_pdf(
    path: Path, sheets: Sequence[Sheet], images: Mapping[str, GreyImage], progress: Callable[[], None] = lambda: None
) -> None:
    """Write a page for each sheet with the image of its landmark; raises OSError where that cannot be."""
    rl_config.useA85 = 0  # images as bytes, not as text a quarter longer
    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    canvas.setTitle("Landmarks")
    canvas.setViewerPreference("PrintScaling", "None")
    readers: dict[str, ImageReader] = {}
    for sheet in sheets:
        name = sheet.asked.landmark
        if name not in readers:
            readers[name] = ImageReader(Image.fromarray(images[name]))
        canvas.bookmarkPage(f"page {canvas.getPageNumber()}")
        canvas.addOutlineEntry(
            printable(f"{sheet.place}: {name}" if sheet.place else name), f"page {canvas.getPageNumber()}"
        )
        draw_page(canvas, sheet, readers[name])
        progress()
    canvas.save()
