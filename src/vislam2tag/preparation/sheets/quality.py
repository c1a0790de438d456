"""Whether an image can be a landmark: what a recogniser needs, measured; for generated images and for users' own."""

from __future__ import annotations

import cv2
import numpy as np

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import Features, GreyImage, features_of, orb, reference
from vislam2tag.preparation.sheets.recognition import ENOUGH_INLIERS, FEATURES, FRAME_FEATURES, sighting
from vislam2tag.preparation.sheets.views import FRAME_PX, View, bordered, camera_frame

LEAST_SIDE_PX = 300
"""ARCore's own least size of a reference image."""
LEAST_CONTRAST = 30.0
"""Standard deviation of the grey levels (0 to 255)."""
LEAST_FEATURES = 500
LEAST_SPREAD = 0.75
MOST_REPEATS = 0.25
HARD_VIEW = View(share=0.2, roll_deg=15, yaw_deg=40, blur_px=1.5, light=0.3, noise=6)
"""A sheet filling a fifth of the view, turned away by 40 degrees, blurred, in dim light."""
_COUNTED = 2000
"""Features that are looked for where they are counted."""
_CELLS = 6
"""The image is looked at in as many columns and rows."""
_OF_A_CELL = 3
"""Features that a cell needs to count as covered."""
_TWIN_BITS = 40
"""Features that differ in at most so many of 256 bits look the same."""
_APART = 0.08
"""Sides of the image between two features that count as a repeat; nearer ones are one corner found twice."""


class ImageQuality(Record):
    """What was measured of one image."""

    shorter_side_px: int
    contrast: float
    """Standard deviation of the grey levels."""
    features: int
    """Features found at the size of reference, at most 2000."""
    spread: float
    """Share of 36 cells of the image that hold features."""
    repeats: float
    """Share of the features that look like another one elsewhere in the image."""
    holds_code: bool
    """A QR code or barcode stands in it."""
    inliers: int
    """Features that agree where the sheet is seen as in :data:`HARD_VIEW`."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the image is no landmark, each with its figure and what is needed; empty where it is one."""
        checks = (
            (
                self.shorter_side_px < LEAST_SIDE_PX,
                f"its shorter side has {self.shorter_side_px} px, {LEAST_SIDE_PX} are needed",
            ),
            (self.contrast < LEAST_CONTRAST, f"contrast {self.contrast:.0f}, {LEAST_CONTRAST:.0f} is needed"),
            (self.features < LEAST_FEATURES, f"{self.features} features, {LEAST_FEATURES} are needed"),
            (
                self.spread < LEAST_SPREAD,
                f"features in {100 * self.spread:.0f} % of its area, {100 * LEAST_SPREAD:.0f} % are needed",
            ),
            (
                self.repeats > MOST_REPEATS,
                f"{100 * self.repeats:.0f} % of its features repeat, at most {100 * MOST_REPEATS:.0f} % may",
            ),
            (self.holds_code, "it holds a QR code or barcode, which trackers follow badly"),
            (
                self.inliers < ENOUGH_INLIERS,
                f"seen from 40 degrees, blurred and in dim light {self.inliers} features agree, "
                f"{ENOUGH_INLIERS} are needed",
            ),
        )
        return tuple(fault for present, fault in checks if present)


def reference_features(image: GreyImage) -> Features:
    """Take the features that a recogniser keeps of an image (height, width)."""
    return features_of(reference(image), orb(FEATURES))


def quality_of(image: GreyImage, features: Features) -> ImageQuality:
    """Measure an image (height, width) whose :func:`reference_features` are known."""
    wall = np.full((FRAME_PX[1], FRAME_PX[0]), 180, np.uint8)
    frame = camera_frame(*bordered(image), HARD_VIEW, wall)
    every = features_of(reference(image), orb(_COUNTED))
    return ImageQuality(
        shorter_side_px=min(image.shape),
        contrast=round(float(image.std()), 1),
        features=len(every),
        spread=round(_spread(every), 3),
        repeats=round(_repeats(features), 3),
        holds_code=_holds_code(reference(image)),
        inliers=sighting(features_of(frame.image, orb(FRAME_FEATURES)), features).inliers,
    )


def _spread(features: Features) -> float:
    """Share of the image's cells that hold enough features."""
    cells: FloatArray = np.floor(features.points / features.size_px * _CELLS)
    index = (cells[:, 0] * _CELLS + cells[:, 1]).astype(np.int64)
    return float(np.mean(np.bincount(index, minlength=_CELLS**2) >= _OF_A_CELL))


def _repeats(features: Features) -> float:
    """Share of the features that have a twin elsewhere in the image."""
    if not len(features):
        return 0.0
    bits = np.unpackbits(features.descriptors, axis=1).astype(np.float32)
    ones = bits.sum(axis=1)
    differing = ones[:, None] + ones - 2 * bits @ bits.T
    apart = np.linalg.norm(features.points[:, None] - features.points, axis=2) > _APART * min(features.size_px)
    return float(np.mean(np.any((differing <= _TWIN_BITS) & apart, axis=1)))


def _holds_code(image: GreyImage) -> bool:
    """Whether OpenCV reads a QR code or a barcode in an image (height, width)."""
    if cv2.QRCodeDetector().detectAndDecode(image)[0]:
        return True
    return bool(cv2.barcode.BarcodeDetector().detectAndDecode(image)[0])
