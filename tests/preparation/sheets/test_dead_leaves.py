"""Generated pictures: the same for the same seed and id, others otherwise."""

from __future__ import annotations

import hashlib

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.preparation.sheets.images import SIDE_PX, dead_leaves_picture


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
