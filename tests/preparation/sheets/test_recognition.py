"""Images of a set are told apart in views of them, and nothing else is taken for one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

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

WALL: GreyImage = np.full((FRAME_PX[1], FRAME_PX[0]), 170, np.uint8)


@pytest.fixture(scope="module", name="images")
def _images() -> list[GreyImage]:
    return [dead_leaves_picture(0, str(number)) for number in range(12)]


@pytest.fixture(scope="module", name="recogniser")
def _recogniser(images: list[GreyImage]) -> Recogniser:
    return Recogniser([reference_features(image) for image in images])


def looked_at(image: GreyImage, view: View) -> tuple[Features, np.ndarray]:
    frame = camera_frame(*bordered(image), view, WALL)
    return features_of(frame.image, orb(FRAME_FEATURES)), frame.corners


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
    nothing = features_of(WALL, orb(FRAME_FEATURES))
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
