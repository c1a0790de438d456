"""What is drawn on a plan's image: ink that stands out from the paper."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from skimage.filters import apply_hysteresis_threshold, threshold_otsu

from vislam2tag.core.arrays import BoolArray
from vislam2tag.errors import SurveyError

Bytes = npt.NDArray[np.uint8]

FAINTEST = 32
"""Ink that differs from the paper by less (of 255) is paper: noise of JPEG, light fills."""
_LEAST_SHARE = 1e-4
"""A plan with less ink than this share of its pixels shows nothing."""
_WEIGHTS = np.array([0.299, 0.587, 0.114])


def ink_on_paper(image: Bytes, shape: tuple[int, int]) -> Bytes:
    """How much each of ``shape`` (rows, columns) pixels of an image (., ., 3) differs in lightness from the paper.

    The paper is the image's most frequent colour, so white lines on black are ink, too. Smaller images are made from
    the darkest ink of what falls into a pixel, so that thin lines stay.
    """
    light = (image @ _WEIGHTS).astype(np.int16)
    ink = np.abs(light - _paper_lightness(image)).clip(0, 255).astype(np.uint8)
    reach = tuple(int(np.ceil(old / new)) for old, new in zip(ink.shape, shape, strict=True))
    if max(reach) > 1:
        ink = np.asarray(cv2.dilate(ink, np.ones(reach, dtype=np.uint8)))
    smaller = ink.size > shape[0] * shape[1]
    method = cv2.INTER_NEAREST if smaller else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(ink, shape[::-1], interpolation=method), dtype=np.uint8)


def _paper_lightness(image: Bytes) -> int:
    """Lightness of the most frequent of 16 x 16 x 16 colours."""
    coarse = (image >> 4).astype(np.int32)
    colour = (coarse[..., 0] << 8) + (coarse[..., 1] << 4) + coarse[..., 2]
    most = int(np.bincount(colour.ravel(), minlength=4096).argmax())
    return round(float(image[colour == most].mean(axis=0) @ _WEIGHTS))


def walls_in(ink: Bytes, contrast: float | None) -> BoolArray:
    """Tell which pixels are walls: by a contrast (0 to 1) or, without one, by Otsu's threshold among all ink.

    With Otsu's threshold fainter ink (down to half of it) counts where it continues strong ink: thin lines are grey
    between pixels. Raises SurveyError where nothing stands out.
    """
    some = ink > (FAINTEST if contrast is None else contrast * 255)
    if some.mean() < _LEAST_SHARE:
        raise SurveyError(
            "the plan's image shows no walls: nothing stands out from its paper; expected walls that are much darker "
            "(or lighter) than the floor between them; give another image, a lower wall contrast or polygons"
        )
    if contrast is not None:
        return np.asarray(some)
    values = ink[some]
    strong = float(threshold_otsu(values)) if values.min() < values.max() else float(values.max()) - 1
    return np.asarray(apply_hysteresis_threshold(ink, max(strong / 2, FAINTEST), strong))
