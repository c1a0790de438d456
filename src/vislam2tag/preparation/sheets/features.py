"""Local features of an image: what a recogniser knows it by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import AnyArray, BoolArray

GreyImage: TypeAlias = npt.NDArray[np.uint8]
"""Grey levels (height, width), 0 black to 255 white; recognisers use no colour."""

REFERENCE_PX = 400
"""Length of an image's shorter side when its features are taken, as a recogniser stores it."""
BITS = 256
"""Length of an ORB descriptor."""
_EDGE_PX = 16
"""How near to the edge of an image features are taken: half of what a descriptor looks at."""


@dataclass(frozen=True)
class Features:
    """Features of one image, ``k`` of them, the strongest first.

    ``points`` (k, 2) pixels; ``descriptors`` (k, 32) bytes of bits, or (k, d) floats where a detector makes such;
    ``size_px`` is width and height of the image that the points lie in.
    """

    points: npt.NDArray[np.float32]
    descriptors: AnyArray
    size_px: tuple[int, int]

    def __len__(self) -> int:
        return len(self.points)

    def strongest(self, count: int) -> Features:
        """Keep the first ``count``."""
        return Features(self.points[:count], self.descriptors[:count], self.size_px)

    def only(self, wanted: BoolArray) -> Features:
        """Keep those that ``wanted`` (k,) says."""
        return Features(self.points[wanted], self.descriptors[wanted], self.size_px)


def orb(count: int) -> cv2.Feature2D:
    """Make an ORB detector of the ``count`` strongest features (Rublee et al., ICCV 2011)."""
    return cv2.ORB.create(nfeatures=count, edgeThreshold=_EDGE_PX)


def features_of(image: GreyImage, detector: cv2.Feature2D) -> Features:
    """Find the features of an image (height, width) as it is."""
    found, descriptors = detector.detectAndCompute(image, None)
    height, width = image.shape
    if not found:
        return Features(np.empty((0, 2), np.float32), np.empty((0, BITS // 8), np.uint8), (width, height))
    order = np.argsort([-point.response for point in found], kind="stable")
    points = np.array([point.pt for point in found], np.float32)
    return Features(points[order], np.asarray(descriptors)[order], (width, height))


def reference(image: GreyImage) -> GreyImage:
    """Bring an image (height, width) to the size at which its features are taken: its shorter side
    :data:`REFERENCE_PX`.
    """
    scale = REFERENCE_PX / min(image.shape)
    return resized(image, (round(image.shape[1] * scale), round(image.shape[0] * scale)))


def resized(image: GreyImage, size_px: tuple[int, int]) -> GreyImage:
    """Bring an image (height, width) to another size; the mean of areas where it shrinks, as a lens does."""
    shrinks = size_px[0] < image.shape[1]
    way = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size_px, interpolation=way), np.uint8)
