"""Coloured lines in the picture of a plan: escape routes and pipes beside walls of another colour are not walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.plans.taken_parts import Became, TakenPart
from vislam2tag.site.walkable.painted_cells import Bytes, parts_of, widened

_Degrees = npt.NDArray[np.floating[Any]]

_VIVID, _LEAST_VIVID = 0.3, 25
"""Channels of colours differ by more than this share of the contrast with the paper, and by so much of 255. The share
is the same in seams between a line and the paper."""
_COLOURS = (
    ("red", 15), ("orange", 40), ("yellow", 70), ("green", 165), ("cyan", 195), ("blue", 260), ("violet", 345),
    ("red", 361),
)  # fmt: skip
"""Names of hues up to so many degrees."""
_ONE_HUE_DEG = 40.0
"""Hues that differ by less from that of most lines are one, as in a blueprint."""
_DRAWN_IN = 2.0
"""A plan with so many times as long lines of one colour as grey ones is drawn in this colour."""
_UNCLEAR = 0.5
"""Lines of another colour that are at least this share as long as those of the walls may be walls."""
_SEAM = 0.5
"""Colour of which this share is beside darker grey ink is a seam or the inside of an outlined wall."""
_JOINED = 0.5
"""Lines of which more than this share touches other ink may be walls."""
_LOOKED_AT = 1_000_000
"""Lengths are measured among about so many pixels."""
_LEAST_SHARE = 1e-4
"""Less of the picture is not worth a line."""


@dataclass(frozen=True)
class ColouredLines:
    """Lines of other colours than the walls have."""

    left_out: BoolArray
    """(rows, columns) those that are not walls."""
    taken: tuple[TakenPart, ...] = ()
    """Their colours."""
    notes: tuple[str, ...] = ()
    """Colours that may be walls or not, sentences."""

    def join(self, ink: BoolArray, symbol_px: float) -> bool:
        """Whether most of those left out are longer than a symbol and touch other ``ink``, as walls do."""
        labels, boxes, sides = parts_of(self.left_out)
        touching = self.left_out & widened(ink & ~self.left_out)
        joined = (np.bincount(labels[touching], minlength=len(boxes)) > 0) & (sides >= symbol_px)
        area = boxes[1:, cv2.CC_STAT_AREA]
        return bool(area[joined[1:]].sum() > _JOINED * area.sum())


def coloured_lines(image: Bytes, paper: Bytes, ink: BoolArray, symbol_px: float) -> ColouredLines:
    """Find the ``ink`` of an image (rows, columns, 3) on ``paper`` (3,) that has another colour than the walls.

    Walls are grey, or have the colour of most lines longer than ``symbol_px``, where grey lines are few.
    """
    away = cv2.absdiff(image, np.broadcast_to(paper, image.shape))
    high, low = away.max(axis=2), away.min(axis=2)
    vivid = _without_seams(ink & (high - low > np.maximum(_VIVID * high, _LEAST_VIVID)), ink)
    if vivid.mean() < _LEAST_SHARE:
        return ColouredLines(np.zeros_like(vivid))
    # Hues as on white paper, so that white lines on blue have one, too.
    hue = 2.0 * cv2.cvtColor(255 - away, cv2.COLOR_RGB2HSV)[..., 0].astype(np.float32)
    walls_m = _length(ink & ~vivid, symbol_px)
    main = _main_hue(hue[vivid])
    own = vivid & (np.abs((hue - main + 180) % 360 - 180) < _ONE_HUE_DEG)
    own_m = _length(own, symbol_px)
    if own_m > _DRAWN_IN * walls_m:
        vivid, walls_m = vivid & ~own, own_m
    return _by_colour(vivid, hue, walls_m, symbol_px)


def _by_colour(vivid: BoolArray, hue: _Degrees, walls_px: float, symbol_px: float) -> ColouredLines:
    """Decide for each colour of ``vivid`` (rows, columns) ink with a ``hue`` by the length of its lines."""
    left_out, taken, notes = np.zeros_like(vivid), [], []
    number = np.digitize(hue, [up_to for _, up_to in _COLOURS])
    for name in dict(_COLOURS):
        own = vivid & np.isin(number, [each for each, (called, _) in enumerate(_COLOURS) if called == name])
        share = float(own.mean())
        if _length(own, symbol_px) >= _UNCLEAR * walls_px:
            notes.append(
                f"{name} lines are {_percent(share)} of the picture and count as walls, because there are nearly as "
                "many of them as of other lines: if they are not walls, use a plan without them"
            )
            continue
        left_out |= own
        if share >= _LEAST_SHARE:
            why = f"another colour than the walls, {_percent(share)} of the picture"
            taken.append(TakenPart(f"{name} lines", Became.LEFT_OUT, len(parts_of(own)[1]) - 1, why))
    return ColouredLines(left_out, tuple(taken), tuple(notes))


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"


def _main_hue(hue: _Degrees) -> float:
    """The most frequent hue, degrees."""
    count = np.bincount(np.round(hue / 10).astype(int) % 36, minlength=36)
    return 10.0 * int((np.roll(count, 1) + count + np.roll(count, -1)).argmax())


def _without_seams(vivid: BoolArray, ink: BoolArray) -> BoolArray:
    """Leave out of vivid ink (rows, columns) parts that mostly are beside other ink."""
    labels, boxes, _ = parts_of(vivid)
    count = np.bincount(labels[vivid & widened(ink & ~vivid)], minlength=len(boxes))
    seam = count >= _SEAM * boxes[:, cv2.CC_STAT_AREA]
    kept: BoolArray = vivid & ~seam[labels]
    return kept


def _length(ink: BoolArray, symbol_px: float) -> float:
    """Length of the lines in ink (rows, columns) that are longer than a symbol, in pixels of a smaller picture."""
    step = max(1, int(np.ceil((ink.size / _LOOKED_AT) ** 0.5)))
    small = cv2.dilate(ink.astype(np.uint8), np.ones((step, step), dtype=np.uint8))[::step, ::step] > 0
    labels, _, sides = parts_of(small)
    long = sides >= symbol_px / step
    long[0] = False
    return float(skeletonize(small & long[labels]).sum())
