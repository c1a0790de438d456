"""Where things stand on paper: the image's true size, its marks, and room for the rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.sheets.page import largest_width_m, page_layout
from vislam2tag.preparation.sheets.sheet_requests import QUIET_M, SHEET_SIZES

PAPERS = st.sampled_from(list(SHEET_SIZES.values()))


@given(paper=PAPERS, aspect=st.floats(0.2, 5), share=st.floats(0.05, 1))
def test_the_image_has_its_width_its_quiet_border_and_its_centre_stays(paper, aspect: float, share: float) -> None:  # type: ignore[no-untyped-def]
    width = share * largest_width_m(paper, aspect)
    laid = page_layout(paper, width, aspect, "7")
    assert laid.image.width_m == width
    assert laid.image.height_m == pytest.approx(width * aspect)
    assert laid.image.left_m >= QUIET_M - 1e-4
    assert paper.width_m - laid.image.left_m - width >= QUIET_M - 1e-4
    assert laid.foot_m - 1e-9 <= laid.image.low_m
    assert laid.image.low_m + laid.image.height_m <= laid.head_m + 1e-9
    middle = page_layout(paper, paper.image_m, 1.0, "7").image.centre_m
    np.testing.assert_allclose(laid.image.centre_m, middle, atol=1e-12)


@given(paper=PAPERS)
def test_what_is_written_below_has_room(paper) -> None:  # type: ignore[no-untyped-def]
    laid = page_layout(paper, paper.image_m, 1.0, "7")
    assert laid.foot_m > 55 * laid.unit_m
    assert laid.head_m + 13 * laid.unit_m < paper.height_m


def test_marks_point_at_the_centre_from_outside() -> None:
    laid = page_layout(SHEET_SIZES["A4"], 0.1, 0.5, "7")
    x, y = laid.image.centre_m
    left, right, below, above = laid.marks_m
    assert (left[1], left[3], right[1], right[3]) == (y, y, y, y)
    assert (below[0], below[2], above[0], above[2]) == (x, x, x, x)
    assert left[2] < laid.image.left_m < laid.image.left_m + 0.1 < right[0]
    assert below[3] < laid.image.low_m < laid.image.low_m + 0.05 < above[1]


def test_marks_of_the_largest_image_stay_4_mm_off_the_papers_edge() -> None:
    for paper in SHEET_SIZES.values():
        marks = np.array(page_layout(paper, paper.image_m, 1.0, "7").marks_m)
        assert marks[:, (0, 2)].min() >= 0.0039
        assert marks[:, (0, 2)].max() <= paper.width_m - 0.0039


def test_the_largest_width_is_whole_millimetres_and_holds_tall_images() -> None:
    assert largest_width_m(SHEET_SIZES["A4"], 1.0) == 0.19
    assert largest_width_m(SHEET_SIZES["A4"], 0.5) == 0.19
    assert largest_width_m(SHEET_SIZES["A4"], 4 / 3) == 0.142


def test_an_image_that_does_not_fit_is_told_with_the_paper_that_holds_it() -> None:
    with pytest.raises(UsageError) as told:
        page_layout(SHEET_SIZES["A4"], 0.25, 1.0, "7")
    assert str(told.value) == (
        "landmark 7: an image 0.25 m wide does not fit A4 with 10 mm of white around (at most 0.19 m); choose A3 or A2"
    )
    with pytest.raises(UsageError, match="no size of paper holds it: make it smaller"):
        page_layout(SHEET_SIZES["A0"], 0.9, 1.0, "7")
