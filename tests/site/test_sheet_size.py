"""Sizes of paper and of the images on them."""

from __future__ import annotations

import math

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.sheets.settings import SHEET_SIZES, sheet_size


def test_the_image_is_the_paper_less_its_quiet_borders() -> None:
    widths = {name: size.image_m for name, size in SHEET_SIZES.items()}
    assert widths == {"A4": 0.19, "Letter": 0.196, "A3": 0.277, "A2": 0.4, "A1": 0.574, "A0": 0.821}
    assert list(widths.values()) == sorted(widths.values())


@pytest.mark.parametrize("name", ["A4", "A3", "A2", "A1", "A0"])
def test_iso_sizes_keep_their_shape(name: str) -> None:
    size = SHEET_SIZES[name]
    assert size.height_m / size.width_m == pytest.approx(math.sqrt(2), abs=0.003)


def test_names_are_found_in_any_case_and_unknown_ones_told() -> None:
    assert sheet_size(" a3 ").name == "A3"
    assert sheet_size("LETTER").name == "Letter"
    with pytest.raises(UsageError, match=r"'B5' is no size of paper; there are: A4, Letter, A3, A2, A1, A0"):
        sheet_size("B5")
