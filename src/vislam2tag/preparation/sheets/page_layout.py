"""Where everything stands on a sheet: lengths in metres from the paper's lower left corner."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.common.errors import UsageError
from vislam2tag.site.sheet_size import QUIET_M, SHEET_SIZES, SheetSize

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
    """Width of the largest image of this height over width that the paper holds, in whole millimetres (down)."""
    return int(1000 * paper.image_m / max(1.0, aspect) + _TOLERANCE_M) / 1000


def page_layout(paper: SheetSize, width_m: float, aspect: float, landmark: str) -> PageLayout:
    """Lay out a sheet: the image's centre is in the middle of the largest square that the paper holds.

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
    advice = f"choose {' or '.join(enough[:2])}" if enough else "no size of paper holds it: make it smaller"
    return (
        f"landmark {landmark}: an image {width_m:g} m wide does not fit {paper.name} with {QUIET_M * 1000:.0f} mm of "
        f"white around (at most {most:g} m); {advice}"
    )
