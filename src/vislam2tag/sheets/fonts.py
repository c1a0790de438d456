"""The typeface of sheets: DejaVu Sans, which Matplotlib brings, for ids in Latin, Greek, Cyrillic and more."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

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
