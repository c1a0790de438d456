"""What is measured of rendered PDF pages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pypdfium2
from pypdfium2 import raw

from vislam2tag.preparation.sheets.features import GreyImage

POINTS_A_METRE = 72 / 0.0254


@dataclass(frozen=True)
class Printed:
    """A page: its size and its images (left, low, right, high) in metres, its text, and it rendered at ``dpi``."""

    size_m: tuple[float, float]
    images_m: tuple[tuple[float, ...], ...]
    text: str
    shown: GreyImage
    dpi: float

    def part(self, left_m: float, low_m: float, right_m: float, high_m: float) -> GreyImage:
        """Cut out a part of the page."""
        scale = self.dpi / 0.0254
        rows = [round((self.size_m[1] - y) * scale) for y in (high_m, low_m)]
        columns = [round(x * scale) for x in (left_m, right_m)]
        return self.shown[rows[0] : rows[1], columns[0] : columns[1]]


def printed(pdf: Path, page: int = 0, dpi: float = 254.0) -> Printed:
    """Render a page as a printer would."""
    document = pypdfium2.PdfDocument(pdf)
    try:
        sheet = document[page]
        found = [one.get_bounds() for one in sheet.get_objects() if one.type == raw.FPDF_PAGEOBJ_IMAGE]
        return Printed(
            size_m=tuple(side / POINTS_A_METRE for side in sheet.get_size()),
            images_m=tuple(tuple(edge / POINTS_A_METRE for edge in bounds) for bounds in found),
            text=sheet.get_textpage().get_text_range(),
            shown=np.array(sheet.render(scale=dpi / 72).to_pil().convert("L"), np.uint8),
            dpi=dpi,
        )
    finally:
        document.close()
