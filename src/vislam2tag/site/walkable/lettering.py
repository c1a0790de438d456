"""Text on a plan that has a colour of its own: it is taken off even where it touches walls."""

from __future__ import annotations

import cv2
import numpy as np

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.walkable.ink import Bytes

_LETTER_PX = (4, 14)
"""Letters that can be read have a size in this range, pixels, or are smaller than a symbol."""
_LEAST_LETTERS = 12
_ALIKE = 30
"""Colours that differ by less in each channel (of 255) are one."""
_UNLIKE = 60
"""Colours that differ by more in some channel are two."""
_AGREE = 0.6
"""This share of the letters has one colour ..."""
_OTHERS = 0.35
"""... that at most this share of all other ink has, too."""
_STROKE_PX = 5
"""Walls go on below strokes of up to twice this."""
_DIRECTIONS = 12


def lettering(image: Bytes, ink: Bytes, walls: BoolArray, symbol_px: float) -> BoolArray:
    """Tell which pixels of an image (rows, columns, 3) are text, where walls have another colour.

    ``ink`` and ``walls`` (rows, columns) are the image's own. Ink that touches nothing else and is as large as letters
    tells the text's colour; without enough of it, or where walls have that colour, nothing is text.
    """
    letters = _letters(walls, max(symbol_px, _LETTER_PX[1]))
    colour = _colour_of(image, ink, letters)
    if colour is None:
        return np.zeros_like(walls)
    alike = (np.abs(image.astype(np.int16) - colour) <= _ALIKE).all(axis=2)
    # Darker lines have seams of any grey, the text's as well.
    seams = _widened(ink > ink[alike & walls].max(initial=0))
    alike &= walls & ~seams
    others = walls & (letters == 0)
    unlike = others & ~alike
    if (alike & others).sum() > _OTHERS * others.sum() or not _differ(colour, image[unlike], ink[unlike]):
        return np.zeros_like(walls)
    text = walls & _widened(alike) & ~seams
    return text & ~_going_on_below(walls & ~text)


def _widened(mask: BoolArray) -> BoolArray:
    """The mask (rows, columns) and all pixels beside it."""
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), dtype=np.uint8)) > 0)


def _letters(walls: BoolArray, largest_px: float) -> Bytes:
    """Which ink (rows, columns) may be letters, by number of the letter; 0 elsewhere."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(walls.astype(np.uint8), connectivity=8)
    sides = np.asarray(stats)[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    letter = (sides >= _LETTER_PX[0]) & (sides <= largest_px)
    numbers = np.cumsum(letter) * letter
    numbers[0] = 0
    return np.asarray(numbers[np.asarray(labels)])


def _colour_of(image: Bytes, ink: Bytes, letters: Bytes) -> Bytes | None:
    """The colour (3,) that letters have where they are darkest; None where they are few or of many colours."""
    row, column = np.nonzero(letters)
    order = np.lexsort((-ink[row, column].astype(np.int16), letters[row, column]))
    row, column = row[order], column[order]
    _, darkest = np.unique(letters[row, column], return_index=True)
    if len(darkest) < _LEAST_LETTERS:
        return None
    colours = image[row[darkest], column[darkest]].astype(np.int16)
    usual = np.median(colours, axis=0).astype(np.int16)
    agree = (np.abs(colours - usual) <= _ALIKE).all(axis=1).mean() >= _AGREE
    return np.asarray(usual) if agree else None


def _differ(text: Bytes, walls: Bytes, ink: Bytes) -> bool:
    """Whether text has another colour (3,) than walls (n, 3), seams left out; compression blurs both."""
    core = walls[ink >= np.median(ink)] if len(ink) else walls
    return len(core) > 0 and bool((np.abs(np.median(core, axis=0) - text) > _UNLIKE).any())


def _going_on_below(walls: BoolArray) -> BoolArray:
    """The walls (rows, columns) with their gaps closed, along lines of many directions."""
    closed = walls.astype(np.uint8)
    centre = np.array((_STROKE_PX, _STROKE_PX))
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        reach = np.round(_STROKE_PX * np.array((np.cos(angle), np.sin(angle)))).astype(int)
        line = np.zeros((2 * _STROKE_PX + 1,) * 2, dtype=np.uint8)
        cv2.line(line, (centre - reach).tolist(), (centre + reach).tolist(), 1)
        closed |= np.asarray(cv2.morphologyEx(walls.astype(np.uint8), cv2.MORPH_CLOSE, line))
    return closed > 0
