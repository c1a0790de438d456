"""The simulated camera: where the image lies in the frame, and what light and blur do.

Images of a set are told apart in views of them, and nothing else is taken for one.
"""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import (
    ENOUGH_INLIERS,
    FRAME_FEATURES,
    FRAME_PX,
    VOTERS,
    Features,
    GreyImage,
    Recogniser,
    View,
    bordered,
    camera_frame,
    features_of,
    orb,
    sighting,
)
from vislam2tag.preparation.sheets.images import HARD_VIEW, dead_leaves_picture, reference_features

WALL: GreyImage = np.full((FRAME_PX[1], FRAME_PX[0]), 100, np.uint8)
BLACK: GreyImage = np.zeros((300, 300), np.uint8)


def area(corners: FloatArray) -> float:
    x, y = corners.T
    return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2)


@pytest.mark.parametrize("share", [0.06, 0.25])
@pytest.mark.parametrize("shape", [(300, 300), (450, 300)])
def test_a_faced_image_fills_its_share_of_the_frame(share: float, shape: tuple[int, int]) -> None:
    frame, corners = camera_frame(*bordered(np.zeros(shape, np.uint8)), View(share=share, noise=0), WALL)
    whole = FRAME_PX[0] * FRAME_PX[1]
    assert area(corners) == pytest.approx(share * whole)
    assert np.mean(frame < 50) == pytest.approx(share, rel=0.03)
    np.testing.assert_allclose(corners.mean(axis=0), (320, 240), atol=0.01)
    assert corners[0, 0] < 320
    assert corners[0, 1] < 240


def test_corners_are_where_the_image_is_seen() -> None:
    view = View(share=0.2, roll_deg=20, yaw_deg=40, pitch_deg=10, noise=0)
    frame, corners = camera_frame(*bordered(BLACK), view, WALL)
    inside = cv2.fillPoly(np.zeros_like(WALL), [np.rint(corners).astype(np.int32)], 1)
    dark = (frame < 50).astype(np.uint8)
    assert np.mean(inside != dark) < 0.005


def test_turning_away_narrows_and_the_nearer_side_is_longer() -> None:
    corners = camera_frame(*bordered(BLACK), View(yaw_deg=40, noise=0), WALL)[1]
    left, right = (np.linalg.norm(corners[i] - corners[j]) for i, j in ((0, 3), (1, 2)))
    width, height = np.ptp(corners, axis=0)
    assert width < height * 0.85
    assert abs(left - right) > 30


def test_paper_around_the_image_is_seen_too() -> None:
    paper = np.full((900, 600), 255, np.uint8)
    paper[100:600, 50:550] = 0
    whole, corners = camera_frame(paper, (50, 100, 500, 500), View(noise=0), WALL)
    side = np.sqrt(0.25 * FRAME_PX[0] * FRAME_PX[1])
    low = int(corners[2, 1])
    assert np.all(whole[low + 5 : 475, 320] > 250)  # 300 px of paper below the image
    assert np.ptp(corners[:, 0]) == pytest.approx(side, rel=0.01)


def test_light_blur_and_noise() -> None:
    bright = camera_frame(*bordered(BLACK), View(noise=0), WALL)[0]
    dim = camera_frame(*bordered(BLACK), View(light=0.25, noise=0), WALL)[0]
    np.testing.assert_allclose(dim, bright * 0.25, atol=1)
    blurred = camera_frame(*bordered(BLACK), View(blur_px=3, noise=0), WALL)[0]
    edges = [np.abs(np.diff(image[240].astype(int))).max() for image in (bright, blurred)]
    assert edges[1] < edges[0] / 3
    noisy = camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=1)[0]
    assert np.std(noisy[:50].astype(float)) == pytest.approx(8, rel=0.1)
    np.testing.assert_array_equal(noisy, camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=1)[0])
    assert np.any(noisy != camera_frame(*bordered(BLACK), View(noise=8), WALL, seed=2)[0])


GREY_WALL: GreyImage = np.full((FRAME_PX[1], FRAME_PX[0]), 170, np.uint8)


@pytest.fixture(scope="module", name="images")
def _images() -> list[GreyImage]:
    return [dead_leaves_picture(0, str(number)) for number in range(12)]


@pytest.fixture(scope="module", name="recogniser")
def _recogniser(images: list[GreyImage]) -> Recogniser:
    return Recogniser([reference_features(image) for image in images])


def looked_at(image: GreyImage, view: View) -> tuple[Features, np.ndarray]:
    frame, corners = camera_frame(*bordered(image), view, GREY_WALL)
    return features_of(frame, orb(FRAME_FEATURES)), corners


@pytest.mark.parametrize(
    "view",
    [
        View(share=0.2),
        View(share=0.06),
        View(roll_deg=40),
        View(yaw_deg=40),
        View(pitch_deg=-40),
        View(blur_px=3),
        View(light=0.2, noise=6),
        HARD_VIEW,
    ],
    ids=["20 %", "6 %", "rolled", "sideways", "downwards", "blurred", "dim", "hard"],
)
def test_views_are_recognised_as_the_right_image_in_the_right_place(
    images: list[GreyImage], recogniser: Recogniser, view: View
) -> None:
    for index in (0, 7):
        features, corners = looked_at(images[index], view)
        found = recogniser.best(features)
        assert found.index == index
        assert found.inliers >= ENOUGH_INLIERS
        assert np.linalg.norm(found.corners - corners, axis=1).max() < 20


def test_what_is_not_in_the_set_is_not_recognised(recogniser: Recogniser) -> None:
    assert recogniser.best(looked_at(dead_leaves_picture(1, "0"), View())[0]).inliers < ENOUGH_INLIERS
    nothing = features_of(GREY_WALL, orb(FRAME_FEATURES))
    assert (recogniser.best(nothing).index, recogniser.best(nothing).inliers) == (-1, 0)


def test_generated_images_are_unlike_each_other(recogniser: Recogniser) -> None:
    found = [recogniser.most_like(index) for index in range(12)]
    assert all(one.index != index for index, one in enumerate(found))
    assert max(one.inliers for one in found) < ENOUGH_INLIERS


@pytest.mark.parametrize("voters", [VOTERS, 400])
@pytest.mark.parametrize(
    "alter",
    [
        lambda image: cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE),
        lambda image: image[100:540, 80:520],
        lambda image: (image // 2 + 60).astype(np.uint8),
    ],
    ids=["turned", "a part", "paler"],
)
def test_an_altered_copy_is_most_like_its_original(images: list[GreyImage], voters: int, alter) -> None:  # type: ignore[no-untyped-def]
    copy = np.ascontiguousarray(alter(images[3]))
    recogniser = Recogniser([reference_features(image) for image in (*images, copy)], voters)
    for index, original in ((12, 3), (3, 12)):
        found = recogniser.most_like(index)
        assert found.index == original
        assert found.inliers >= ENOUGH_INLIERS


def test_a_set_of_one_is_like_no_other(images: list[GreyImage]) -> None:
    found = Recogniser([reference_features(images[0])]).most_like(0)
    assert (found.index, found.inliers) == (-1, 0)


def test_too_few_features_make_no_sighting(images: list[GreyImage]) -> None:
    features = reference_features(images[0])
    assert sighting(features.strongest(10), features).inliers == 0
    assert sighting(features, features.strongest(10)).inliers == 0
    assert np.isnan(sighting(features, features.strongest(10)).corners).all()


def test_features_are_sorted_by_strength_and_none_of_a_plain_image(images: list[GreyImage]) -> None:
    features = reference_features(images[0])
    assert len(features) >= 400
    assert features.size_px == (400, 400)
    assert features.points.min() >= 0
    assert features.points.max() < 400
    plain = reference_features(np.full((500, 700), 9, np.uint8))
    assert (len(plain), plain.descriptors.shape, plain.size_px) == (0, (0, 32), (560, 400))
