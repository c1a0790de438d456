"""What is drawn on a plan's image: ink that stands out from the paper."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from skimage.filters import apply_hysteresis_threshold, threshold_otsu

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray

Bytes = npt.NDArray[np.uint8]

FAINTEST = 32
"""Ink that differs from the paper by less (of 255) is paper: noise of JPEG, light fills."""
_LEAST_SHARE = 1e-4
"""A plan with less ink than this share of its pixels shows nothing."""
_OWN_SHARE = 0.1
"""Less faint ink than this share of the strong one is text or noise."""
_FILL_SHARE = 0.02
"""Of lines less than this share lies farther off an edge than a line's half width."""
_LINE_PX = 4.0
"""Lines may be so wide at least, pixels."""
_WEIGHTS = np.array([0.299, 0.587, 0.114])


def ink_on_paper(image: Bytes) -> Bytes:
    """How much each pixel of an image (rows, columns, 3) differs in lightness from the paper (0 to 255).

    The paper is the image's most frequent colour, so white lines on black are ink, too.
    """
    light = (image @ _WEIGHTS.astype(np.float32)).astype(np.int16)
    return np.abs(light - round(float(_paper_colour(image) @ _WEIGHTS))).clip(0, 255).astype(np.uint8)


def reduced(ink: Bytes, shape: tuple[int, int]) -> Bytes:
    """Ink on fewer pixels (rows, columns), each with the darkest of what falls into it, so that thin lines stay."""
    reach = tuple(int(np.ceil(old / new)) for old, new in zip(ink.shape, shape, strict=True))
    darkest = np.asarray(cv2.dilate(ink, np.ones(reach, dtype=np.uint8)))
    return np.asarray(cv2.resize(darkest, shape[::-1], interpolation=cv2.INTER_NEAREST), dtype=np.uint8)


def _paper_colour(image: Bytes) -> Bytes:
    """The most frequent (3,) of 16 x 16 x 16 colours."""
    coarse = (image >> 4).astype(np.int32)
    colour = (coarse[..., 0] << 8) + (coarse[..., 1] << 4) + coarse[..., 2]
    most = int(np.bincount(colour.ravel(), minlength=4096).argmax())
    return np.asarray(image[colour == most].mean(axis=0).round().astype(np.uint8))


def walls_in(ink: Bytes, contrast: float | None, line_px: float) -> BoolArray:
    """Tell which pixels (rows, columns) are walls: by a contrast (0 to 1) or, without one, by Otsu's threshold among
    all ink.

    Otsu's threshold parts walls from fills; where the fainter part is lines (thinner than ``line_px``), it is walls as
    well. Where there are no fills, fainter ink, down to half of the threshold, counts where it continues strong ink:
    thin lines are grey between pixels. Raises SurveyError where nothing stands out.
    """
    some = ink > (FAINTEST if contrast is None else contrast * 255)
    if some.mean() < _LEAST_SHARE:
        raise SurveyError(
            "the plan's image shows no walls: nothing stands out from its paper; expected walls that are much darker "
            "(or lighter) than the floor between them; give another image, a lower wall contrast or polygons"
        )
    if contrast is not None:
        return np.asarray(some)
    strong = _otsu(ink[some])
    fainter = some & (ink <= strong)
    while (own := _own(fainter, ink > strong)).any() and _is_lines(own, line_px):
        strong = _otsu(ink[fainter])
        fainter = some & (ink <= strong)
    weak = strong if own.any() else max(strong / 2, FAINTEST)
    return np.asarray(apply_hysteresis_threshold(ink, weak, strong))


def _otsu(values: Bytes) -> float:
    """Otsu's threshold of values (n,), below all of them where they are one."""
    return float(threshold_otsu(values)) if values.min() < values.max() else float(values.max()) - 1


def _own(fainter: BoolArray, stronger: BoolArray) -> BoolArray:
    """Fainter ink (rows, columns) without the seams of stronger ink; none where that is little."""
    seams = np.asarray(cv2.dilate(stronger.astype(np.uint8), np.ones((3, 3), dtype=np.uint8))) > 0
    own: BoolArray = fainter & ~seams
    return own if own.sum() >= _OWN_SHARE * stronger.sum() else np.zeros_like(own)


def _is_lines(ink: BoolArray, line_px: float) -> bool:
    """Whether ink (rows, columns) is lines, no fill."""
    distance = np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_3))
    return bool((distance[ink] > max(line_px, _LINE_PX) / 2).mean() < _FILL_SHARE)
