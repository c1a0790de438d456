"""PDF plans: one page, drawn by PDFium."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, file_bytes, register
from vislam2tag.site.plans.images import on_paper
from vislam2tag.site.plans.source import PlanSource, PlanText

if TYPE_CHECKING:
    import pypdfium2

_POINT_M = 0.0254 / 72
_MOST_TEXTS = 5000
"""Lines of text that are looked at."""


def read_pdf(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the page's size; it is drawn when it is asked for.

    A page; coordinates are points (1/72 inch) from its lower left corner upwards, as it is shown.
    """
    import pypdfium2  # of an extra

    data = file_bytes(path)
    document = _opened(data)
    try:
        pages = len(document)
        if source.page > pages:
            raise OSError(f"has no page {source.page}: it has {pages}; correct page")
        width, height = document.get_page_size(source.page - 1)
        texts = _texts(document[source.page - 1])
    finally:
        document.close()

    def picture(side_px: int) -> Image.Image:
        page_of = _opened(data)
        try:
            bitmap = page_of[source.page - 1].render(scale=side_px / max(width, height))
            return on_paper(bitmap.to_pil(), side_px)
        except pypdfium2.PdfiumError as error:
            raise OSError("cannot be drawn: its page is damaged") from error
        finally:
            page_of.close()

    return PlanDrawing((0.0, float(width), 0.0, float(height)), picture, texts=texts, paper_m=_POINT_M)


def _texts(page: pypdfium2.PdfPage) -> tuple[PlanText, ...]:
    """Lines of text with their middles; none of a turned page, whose text has other coordinates than its picture."""
    if page.get_rotation():
        return ()
    shown = page.get_textpage()
    left, low, _, _ = page.get_mediabox()
    boxes = [shown.get_rect(number) for number in range(min(shown.count_rects(), _MOST_TEXTS))]
    return tuple(
        PlanText(shown.get_text_bounded(*box), ((box[0] + box[2]) / 2 - left, (box[1] + box[3]) / 2 - low))
        for box in boxes
    )


def _opened(data: bytes) -> pypdfium2.PdfDocument:
    import pypdfium2

    try:
        return pypdfium2.PdfDocument(data)
    except pypdfium2.PdfiumError as error:
        raise OSError("cannot be read as PDF (damaged, or locked by a password)") from error


register(PlanFormat("pdf", (".pdf",), read_pdf, options=("page", "area")))
