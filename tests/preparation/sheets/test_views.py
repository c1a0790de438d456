"""The simulated camera: where the image lies in the frame, and what light and blur do."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import FRAME_PX, GreyImage, View, bordered, camera_frame

WALL: GreyImage = np.full((FRAME_PX[1], FRAME_PX[0]), 100, np.uint8)
BLACK: GreyImage = np.zeros((300, 300), np.uint8)


def area(corners: FloatArray) -> float:
    x, y = corners.T
    return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2)


@pytest.mark.parametrize("share", [0.06, 0.25])
@pytest.mark.parametrize("shape", [(300, 300), (450, 300)])
def test_a_faced_image_fills_its_share_of_the_frame(share: float, shape: tuple[int, int]) -> None:
    frame = camera_frame(*bordered(np.zeros(shape, np.uint8)), View(share=share, noise=0), WALL)
    whole = FRAME_PX[0] * FRAME_PX[1]
    assert area(frame.corners) == pytest.approx(share * whole)
    assert np.mean(frame.image < 50) == pytest.approx(share, rel=0.03)
    np.testing.assert_allclose(frame.corners.mean(axis=0), (320, 240), atol=0.01)
    assert frame.corners[0, 0] < 320
    assert frame.corners[0, 1] < 240


def test_corners_are_where_the_image_is_seen() -> None:
    view = View(share=0.2, roll_deg=20, yaw_deg=40, pitch_deg=10, noise=0)
    frame = camera_frame(*bordered(BLACK), view, WALL)
    inside = cv2.fillPoly(np.zeros_like(WALL), [np.rint(frame.corners).astype(np.int32)], 1)
    dark = (frame.image < 50).astype(np.uint8)
    assert np.mean(inside != dark) < 0.005


def test_turning_away_narrows_and_the_nearer_side_is_longer() -> None:
    corners = camera_frame(*bordered(BLACK), View(yaw_deg=40, noise=0), WALL).corners
    left, right = (np.linalg.norm(corners[i] - corners[j]) for i, j in ((0, 3), (1, 2)))
    width, height = np.ptp(corners, axis=0)
    assert width < height * 0.85
    assert abs(left - right) > 30


def test_paper_around_the_image_is_seen_too() -> None:
    paper = np.full((900, 600), 255, np.uint8)
    paper[100:600, 50:550] = 0
    whole = camera_frame(paper, (50, 100, 500, 500), View(noise=0), WALL)
    side = np.sqrt(0.25 * FRAME_PX[0] * FRAME_PX[1])
    low = int(whole.corners[2, 1])
    assert np.all(whole.image[low + 5 : 475, 320] > 250)  # 300 px of paper below the image
    assert np.ptp(whole.corners[:, 0]) == pytest.approx(side, rel=0.01)


def test_light_blur_and_noise() -> None:
    bright = camera_frame(*bordered(BLACK), View(noise=0), WALL).image
    dim = camera_frame(*bordered(BLACK), View(light=0.25, noise=0), WALL).image
    np.testing.assert_allclose(dim, bright * 0.25, atol=1)
    blurred = camera_frame(*bordered(BLACK), View(blur_px=3, noise=0), WALL).image
    edges = [np.abs(np.diff(image[240].astype(int))).max() for image in (bright, blurred)]
    assert edges[1] < edges[0] / 3
    noisy = camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=1).image
    assert np.std(noisy[:50].astype(float)) == pytest.approx(8, rel=0.1)
    np.testing.assert_array_equal(noisy, camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=1).image)
    assert np.any(noisy != camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=2).image)
