"""A picture of many distinct features: opaque leaves of random shape, size and tone that fall on each other.

The dead-leaves model (Lee, Mumford, Huang: Occlusion models for natural images, IJCV 2001) has the statistics of
photographs: corners at every scale, so that it is recognised from near and far, and no line or grid that repeats. It is
made of random numbers alone, so nobody has rights in it.
"""

from __future__ import annotations

import hashlib

import cv2
import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import GreyImage

SIDE_PX = 640
"""Side of a picture: 3.4 px a millimetre on A4. ARCore gains nothing beyond 300 px, the print does."""
_TONES = 16
"""Grey levels kept: half the bytes of 256, and what blurs, dims and prints is the same."""
_LEAVES = 700
_SMALLEST, _LARGEST = 1 / 45, 1 / 6
"""Mean radius of a leaf, sides of the picture: the smallest are seen where the sheet fills a fifth of the view."""
_SIZE_POWER = 3.0
"""Density of radii r is r^-3, as in the model: each scale covers the same area."""
_CORNERS = 7
_ROUGHNESS = 0.45
"""How much the radius of a corner differs from the leaf's, at most."""
_SUBPIXEL_BITS = 4
_NUMBERS = 4 + 2 * _CORNERS


def dead_leaves_picture(seed: int, landmark: str, attempt: int = 0) -> GreyImage:
    """Draw the grey picture (SIDE_PX, SIDE_PX) of a landmark: the same for the same seed, id and attempt.

    Leaves fall in the order of their size, the largest first, so that no large one buries the rest of its area.
    """
    chance = _uniform(seed, landmark, attempt)
    radius = np.sort(_radii(chance[:, 0]))[::-1]
    corners = _corners(radius, chance)
    image = np.full((SIDE_PX, SIDE_PX), 128, np.uint8)
    for outline, tone in zip(corners, (255 * chance[:, 1]).astype(int).tolist(), strict=True):
        cv2.fillPoly(image, [outline], tone, cv2.LINE_AA, _SUBPIXEL_BITS)
    step = 256 // _TONES
    return image // np.uint8(step) * np.uint8(255 // (_TONES - 1))


def _uniform(seed: int, landmark: str, attempt: int) -> FloatArray:
    """Random numbers (leaves, ...) in [0, 1) that follow from seed, id and attempt alone."""
    digest = hashlib.sha256(f"{seed}\0{attempt}\0{landmark}".encode("utf-8", "surrogateescape")).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big"))).random((_LEAVES, _NUMBERS))


def _radii(chance: FloatArray) -> FloatArray:
    """Radii (n,) in pixels, by the inverse of their distribution."""
    power = 1 - _SIZE_POWER
    small, large = _SMALLEST**power, _LARGEST**power
    radii: FloatArray = SIDE_PX * (small + chance * (large - small)) ** (1 / power)
    return radii


def _corners(radius: FloatArray, chance: FloatArray) -> npt.NDArray[np.int32]:
    """Corners (n, c, 2) of the leaves, in sixteenths of a pixel; centres reach beyond the picture's edge."""
    centre = SIDE_PX * (1.2 * chance[:, 2:4] - 0.1)
    turn, length = chance[:, 4 : 4 + _CORNERS], chance[:, 4 + _CORNERS :]
    angle = 2 * np.pi * (np.arange(_CORNERS) + 0.9 * turn) / _CORNERS
    reach = radius[:, None] * (1 + _ROUGHNESS * (2 * length - 1))
    arms = reach[..., None] * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    corners: npt.NDArray[np.int32] = np.rint((centre[:, None] + arms) * 2**_SUBPIXEL_BITS).astype(np.int32)
    return corners
