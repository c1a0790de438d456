"""How sheets are made, and the sizes of paper that landmarks are printed on."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field

from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import FiniteRecord


class SheetSettings(FiniteRecord):
    """Paper and image of landmarks that are printed (docs/how-to/sheets.md)."""

    paper: str = "A4"
    """Paper for landmarks whose file names none: A4, Letter, A3, A2, A1 or A0."""
    width_m: float | None = Field(default=None, ge=0.01)
    """Width of images whose file gives none, metres. Without a value, as wide as the paper allows."""
    seed: int = 0
    """Seed of the images. Another seed gives other images."""


QUIET_M = 0.010
"""White border between the image and the paper's edge: printers leave about 5 mm of it blank anyway."""


@dataclass(frozen=True)
class SheetSize:
    """One size of paper, upright; metres."""

    name: str
    width_m: float
    height_m: float

    @property
    def image_m(self) -> float:
        """Side of the largest square image that fits between its quiet borders, in whole millimetres."""
        return round(self.width_m - 2 * QUIET_M, 3)


SHEET_SIZES = {
    size.name: size
    for size in (
        SheetSize("A4", 0.210, 0.297),
        SheetSize("Letter", 0.2159, 0.2794),
        SheetSize("A3", 0.297, 0.420),
        SheetSize("A2", 0.420, 0.594),
        SheetSize("A1", 0.594, 0.841),
        SheetSize("A0", 0.841, 1.189),
    )
}
"""By name, smallest image first (ISO 216, ANSI/ASME Y14.1)."""


def sheet_size(name: str) -> SheetSize:
    """Find a size of paper by its name in any case; raises UsageError where there is none."""
    for size in SHEET_SIZES.values():
        if size.name.lower() == name.strip().lower():
            return size
    raise UsageError(f"'{name}' is not a paper size; available are: {', '.join(SHEET_SIZES)}")
