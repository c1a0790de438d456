"""Generated images and users' own: what is made, what is refused and by which name.

The quality function refuses what a tracker could not follow, and says why.

Generated pictures: the same for the same seed and id, others otherwise.
"""

from __future__ import annotations

import hashlib
import io
from pathlib import Path

import numpy as np
import pytest
import segno
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.images import (
    SIDE_PX,
    ImageQuality,
    confused,
    dead_leaves_picture,
    generated_image,
    lookalikes,
    own_files,
    own_images,
    quality_of,
    reference_features,
)

PLAIN: GreyImage = np.full((400, 400), 200, np.uint8)


def folder_of(root: Path, images: dict[str, GreyImage]) -> Path:
    root.mkdir(exist_ok=True)
    for name, pixels in images.items():
        Image.fromarray(pixels).save(root / name)
    return root


def test_an_image_does_not_depend_on_other_ids_or_runs() -> None:
    first, second = generated_image(3, "7"), generated_image(3, "7")
    assert first.pixels.tobytes() == second.pixels.tobytes()
    assert first.attempt == 0
    assert first.quality.faults == ()
    assert first.quality == second.quality


def test_an_unfit_picture_is_generated_anew_the_same_way_each_time() -> None:
    def draw(seed: int, landmark: str, attempt: int) -> GreyImage:
        return PLAIN if attempt < 2 else dead_leaves_picture(seed, landmark, attempt)

    image = generated_image(0, "7", draw)
    assert image.attempt == 2
    np.testing.assert_array_equal(image.pixels, dead_leaves_picture(0, "7", 2))


def test_a_seed_that_never_gives_a_fit_picture_is_told() -> None:
    with pytest.raises(
        UsageError, match="--seed 5: none of 20 pictures of landmark 7 is suitable; choose another seed"
    ):
        generated_image(5, "7", lambda seed, landmark, attempt: PLAIN)


def test_own_images_are_read_by_name(tmp_path: Path) -> None:
    coloured = np.dstack([dead_leaves_picture(0, "1")] * 3)
    folder = folder_of(tmp_path / "own", {"007.png": dead_leaves_picture(0, "2"), "lobby.JPG": coloured})
    (tmp_path / "own" / "notes.txt").write_text("no image")
    first, second = own_images(folder, own_files(folder))
    assert (first.landmark, second.landmark) == ("7", "lobby")
    np.testing.assert_array_equal(first.pixels, dead_leaves_picture(0, "2"))
    assert second.pixels.shape == (640, 640)


def test_a_large_or_transparent_image_is_brought_to_grey_on_white(tmp_path: Path) -> None:
    drawn = dead_leaves_picture(0, "1")
    see_through = np.dstack([drawn, drawn, drawn, np.where(np.arange(640) < 64, 0, 255) * np.ones((640, 1))])
    folder = folder_of(
        tmp_path / "own", {"a.png": see_through.astype(np.uint8), "b.png": np.kron(drawn, np.ones((4, 4), np.uint8))}
    )
    first, second = own_images(folder, own_files(folder))
    assert first.pixels[:, :64].min() == 255
    assert second.pixels.shape == (2000, 2000)


def test_unfit_own_images_are_refused_by_name_all_at_once(tmp_path: Path) -> None:
    folder = folder_of(
        tmp_path / "own", {"sky.png": PLAIN, "fine.png": dead_leaves_picture(0, "1"), "wall.png": PLAIN[:200]}
    )
    with pytest.raises(SurveyError) as told:
        own_images(folder, own_files(folder))
    message = str(told.value)
    assert "2 of 3 images are not suitable as landmarks: sky.png (its contrast is 0, but must be at least 30" in message
    assert "wall.png (its shorter side has 200 px, but needs 300" in message
    assert "fine.png" not in message


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ((), "contains no image (.png, .jpg, .jpeg)"),
        (("7.png", "07.jpg"), "07.jpg and 7.png have the same id, 7; rename one"),
        (("a;b.png",), "'a;b' is not a valid id; rename the file"),
    ],
)
def test_folders_that_cannot_be_used(tmp_path: Path, names: tuple[str, ...], message: str) -> None:
    folder = folder_of(tmp_path / "own", dict.fromkeys(names, PLAIN))
    with pytest.raises(SurveyError) as told:
        own_files(folder)
    assert message in str(told.value)


def test_a_missing_folder_and_a_broken_image(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"cannot be listed .No such file or directory.; expected a folder of images"):
        own_files(tmp_path / "gone")
    (tmp_path / "7.png").write_bytes(b"no image")
    with pytest.raises(SurveyError, match=r"7.png: cannot be read as an image; replace it"):
        own_images(tmp_path, own_files(tmp_path))


def test_copies_are_confused_and_named_once() -> None:
    images = [generated_image(0, name) for name in ("1", "2", "3")]
    copy = generated_image(
        0, "9", lambda seed, landmark, attempt: np.ascontiguousarray(dead_leaves_picture(0, "2")[::-1, ::-1])
    )
    assert confused(("1", "2", "3", "9"), tuple(lookalikes([*images, copy]))) == ("2 and 9",)
    assert confused(("1", "2", "3"), tuple(lookalikes(images))) == ()
    assert confused(("b", "a", "c"), (("a", 20), ("b", 30), ("a", 19))) == ("a and b",)


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
    "black": (
        np.zeros((SIDE, SIDE), np.uint8),
        "its contrast is 0, but must be at least 30; it has 0 features, but needs 500",
    ),
    "ramp": (np.tile(np.linspace(0, 255, SIDE).astype(np.uint8), (SIDE, 1)), "it has 0 features, but needs 500"),
    "small": (np.ascontiguousarray(dead_leaves_picture(0, "1")[:299]), "its shorter side has 299 px, but needs 300"),
    "pale": ((dead_leaves_picture(0, "1") // 8 + 200).astype(np.uint8), "its contrast is 9, but must be at least 30"),
    "half empty": (half_empty(), "of its area, but needs 75 %"),
    "chessboard": (
        np.kron(np.indices((16, 16)).sum(0) % 2 * 255, np.ones((40, 40))).astype(np.uint8),
        "% of its features repeat",
    ),
    "wallpaper": (
        np.tile(dead_leaves_picture(0, "7")[:160, :160], (4, 4)),
        "% of its features repeat, but at most 25 % may",
    ),
    "QR code": (qr_code(), "it contains a QR code or barcode"),
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


def test_the_picture_is_the_one_that_was_printed_before() -> None:
    """Sheets hang for years: the picture of a seed and id must never change."""
    digest = hashlib.sha256(dead_leaves_picture(0, "7").tobytes()).hexdigest()
    assert digest == "3d75f8fa17b6f7ce199446f72c0897b10118e575d0e5f10e03590620777f2285"


@settings(max_examples=10)
@given(seed=st.integers(), landmark=st.text(max_size=20), attempt=st.integers(0, 20))
def test_a_picture_follows_from_seed_id_and_attempt(seed: int, landmark: str, attempt: int) -> None:
    image = dead_leaves_picture(seed, landmark, attempt)
    assert image.shape == (SIDE_PX, SIDE_PX)
    np.testing.assert_array_equal(image, dead_leaves_picture(seed, landmark, attempt))
    for other in (dead_leaves_picture(seed + 1, landmark, attempt), dead_leaves_picture(seed, landmark + "x", attempt)):
        assert np.mean(other == image) < 0.2
    assert np.mean(dead_leaves_picture(seed, landmark, attempt + 1) == image) < 0.2


def test_it_has_the_statistics_of_photographs() -> None:
    """All tones in every corner of it, and power that falls with the square of the frequency."""
    image = dead_leaves_picture(0, "lobby").astype(float)
    for part in (image[:160, :160], image[-160:, -160:], image[240:400, 240:400]):
        assert part.std() > 50
    power = np.abs(np.fft.fft2(image - image.mean())) ** 2
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(SIDE_PX) * SIDE_PX] * 2))
    low, high = (power[(frequency > edge) & (frequency < 2 * edge)].mean() for edge in (20, 80))
    assert -3.5 < np.log(high / low) / np.log(4) < -1.5
