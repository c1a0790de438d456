"""The quality function refuses what a tracker could not follow, and says why."""

from __future__ import annotations

import io

import numpy as np
import pytest
import segno
from PIL import Image

from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.images import ImageQuality, dead_leaves_picture, quality_of, reference_features

SIDE = 640


def measured(image: GreyImage) -> ImageQuality:
    return quality_of(image, reference_features(image))


def half_empty() -> GreyImage:
    image = dead_leaves_picture(0, "9")
    image[: 2 * SIDE // 3] = 200
    return image


def qr_code() -> GreyImage:
    buffer = io.BytesIO()
    segno.make("Main building/1/7").save(buffer, kind="png", scale=16)
    return np.array(Image.open(buffer).convert("L"))


BAD: dict[str, tuple[GreyImage, str]] = {
    "black": (np.zeros((SIDE, SIDE), np.uint8), "contrast 0, 30 is needed; 0 features, 500 are needed"),
    "ramp": (np.tile(np.linspace(0, 255, SIDE).astype(np.uint8), (SIDE, 1)), "0 features, 500 are needed"),
    "small": (np.ascontiguousarray(dead_leaves_picture(0, "1")[:299]), "its shorter side has 299 px, 300 are needed"),
    "pale": ((dead_leaves_picture(0, "1") // 8 + 200).astype(np.uint8), "contrast 9, 30 is needed"),
    "half empty": (half_empty(), "of its area, 75 % are needed"),
    "chessboard": (
        np.kron(np.indices((16, 16)).sum(0) % 2 * 255, np.ones((40, 40))).astype(np.uint8),
        "% of its features repeat",
    ),
    "wallpaper": (
        np.tile(dead_leaves_picture(0, "7")[:160, :160], (4, 4)),
        "% of its features repeat, at most 25 % may",
    ),
    "QR code": (qr_code(), "it holds a QR code or barcode"),
    "noise": (np.random.default_rng(0).integers(0, 256, (SIDE, SIDE)).astype(np.uint8), "seen from 40 degrees"),
}


@pytest.mark.parametrize("name", list(BAD))
def test_unfit_images_are_refused_with_the_figure(name: str) -> None:
    image, reason = BAD[name]
    assert reason in "; ".join(measured(image).faults)


@pytest.mark.parametrize("landmark", ["1", "lobby", "Küche 3"])
def test_generated_pictures_are_fit_by_a_margin(landmark: str) -> None:
    quality = measured(dead_leaves_picture(0, landmark))
    assert quality.faults == ()
    assert quality.shorter_side_px == SIDE
    assert quality.contrast > 60
    assert quality.features > 1500
    assert quality.spread > 0.9
    assert quality.repeats < 0.1
    assert not quality.holds_code
    assert quality.inliers >= 25


def test_shape_and_size_do_not_matter_for_a_good_image() -> None:
    tall = np.vstack((dead_leaves_picture(0, "1"), dead_leaves_picture(0, "2")))
    assert measured(tall).faults == ()
    assert measured(np.ascontiguousarray(dead_leaves_picture(0, "3")[::2, ::2])).faults == ()
