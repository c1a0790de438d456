"""The PDF as it comes out of a printer: sizes, marks, scale bar, code, text, and its bytes.

Where things stand on paper: the image's true size, its marks, and room for the rest.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.preparation.sheets.printed import printed
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.preparation.sheets.images import dead_leaves_picture
from vislam2tag.preparation.sheets.page import MISSING, SheetPage, largest_width_m, page_layout, printable, write_pdf
from vislam2tag.preparation.sheets.settings import QUIET_M, SHEET_SIZES
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest

LOBBY = SheetRequest("lobby", "Main building", 1, "Ground", (12.3, 4.5), 1.55, near="room 0.17")


def sheet(request: SheetRequest, paper: str = "A4", width_m: float | None = None, aspect: float = 1.0) -> SheetPage:
    size = SHEET_SIZES[paper]
    return SheetPage(request, page_layout(size, width_m or largest_width_m(size, aspect), aspect, request.landmark))


def written(folder: Path, *sheets: SheetPage) -> Path:
    images = {one.request.landmark: dead_leaves_picture(0, one.request.landmark) for one in sheets}
    write_pdf(Folder.at(folder), "sheets.pdf", sheets, images)
    return folder / "sheets.pdf"


@pytest.mark.parametrize("paper", list(SHEET_SIZES))
def test_paper_and_image_have_their_true_size(tmp_path: Path, paper: str) -> None:
    page = printed(written(tmp_path, sheet(LOBBY, paper)), dpi=25.4)
    size = SHEET_SIZES[paper]
    assert page.size_m == pytest.approx((size.width_m, size.height_m), abs=1e-5)
    ((left, low, right, high),) = page.images_m
    assert (right - left, high - low) == pytest.approx((size.image_m, size.image_m), abs=1e-5)


def test_a_chosen_width_is_the_width_on_paper(tmp_path: Path) -> None:
    page = printed(written(tmp_path, sheet(LOBBY, "A3", 0.123)), dpi=25.4)
    ((left, low, right, high),) = page.images_m
    assert (right - left, high - low) == pytest.approx((0.123, 0.123), abs=1e-5)
    assert "Image 0.123 m wide." in page.text


@pytest.mark.parametrize("paper", ["A4", "Letter", "A2"])
def test_the_scale_bar_is_100_mm_long(tmp_path: Path, paper: str) -> None:
    laid = sheet(LOBBY, paper)
    page = printed(written(tmp_path, laid))
    low = laid.layout.foot_m - 51 * laid.layout.unit_m
    strip = page.part(0, low - 0.001, page.size_m[0], low + 0.001)  # 10 px a millimetre
    dark = np.flatnonzero((strip < 128).any(axis=0))
    assert np.ptp(dark) + 1 == pytest.approx(1000, abs=4)
    ticks = page.part(0, low + 0.0015, page.size_m[0], low + 0.0025)
    starts = np.flatnonzero(np.diff((ticks < 128).all(axis=0).astype(int)) == 1)
    np.testing.assert_allclose(np.diff(starts), 100, atol=1.5)
    assert len(starts) == 11


def test_the_marks_outside_show_the_images_centre(tmp_path: Path) -> None:
    laid = sheet(LOBBY)
    page = printed(written(tmp_path, laid))
    ((left, low, right, high),) = page.images_m
    beside = page.part(left - 0.005, low, left - 0.003, high)
    above = page.part(left, high + 0.003, right, high + 0.005)
    middle = [np.flatnonzero((strip < 128).all(axis=axis)).mean() for strip, axis in ((beside, 1), (above, 0))]
    np.testing.assert_allclose(middle, 950, atol=1.5)  # of 1900 px


def test_the_border_around_the_image_is_white_but_for_the_marks(tmp_path: Path) -> None:
    page = printed(written(tmp_path, sheet(LOBBY)))
    ((left, low, right, high),) = page.images_m
    inner = page.part(left, low, right, high).size
    outer = page.part(left - 0.006, low - 0.006, right + 0.006, high + 0.006)
    ring = int((outer < 250).sum()) - int((page.part(left - 1e-4, low - 1e-4, right + 1e-4, high + 1e-4) < 250).sum())
    assert ring < 4 * 50 * 8
    assert outer.size - inner > 1e5


def test_the_code_reads_building_floor_and_id(tmp_path: Path) -> None:
    umlaut = SheetRequest("Küche", "", 2)
    path = written(tmp_path, sheet(LOBBY), sheet(umlaut, "Letter"), sheet(SheetRequest("9")))
    for number, text in enumerate(("Main building/1/lobby", "2/Küche", "9")):
        shown = printed(path, number).shown
        assert cv2.QRCodeDetector().detectAndDecode(shown[shown.shape[0] // 2 :])[0] == text


def test_people_read_what_they_need(tmp_path: Path) -> None:
    text = printed(written(tmp_path, sheet(LOBBY)), dpi=25.4).text
    for part in (
        "Main building, floor 1 (Ground)",
        "UP",
        "lobby",
        "Image 0.190 m wide. Hang its centre 1.55 m above the floor. Place: x 12.30 m, y 4.50 m (room 0.17).",
        "Position mark: please do not remove, move or cover.",
        "100 mm: measure it.",
    ):
        assert part in text


def test_what_is_unknown_is_left_out(tmp_path: Path) -> None:
    bare = sheet(SheetRequest("7"))
    text = printed(written(tmp_path, bare), dpi=25.4).text
    assert "floor " not in text.replace("above the floor", "")
    assert "Place" not in text
    assert "Hang its centre 1.40 m above the floor." in text
    assert sheet(SheetRequest("7", floor=3, floor_name="Floor 3")).place == "floor 3"


def test_the_largest_print_is_the_id_and_long_ones_shrink(tmp_path: Path) -> None:
    long = "a-landmark-with-a-name-that-takes-far-more-room-than-there-is"
    path = written(tmp_path, sheet(SheetRequest("42")), sheet(SheetRequest(long)))
    for number in range(2):
        page = printed(path, number)
        gap = page.part(0.169, 0.03, 0.1735, 0.075)  # between text and QR code
        assert gap.min() > 250
    heights = []
    for number in range(2):
        line = printed(path, number).part(0.008, 0.0545, 0.165, 0.078)
        heights.append(np.ptp(np.flatnonzero((line < 128).any(axis=1))) / 10)
    assert heights[0] > 15  # mm
    assert heights[1] < 6


def test_same_sheets_same_bytes_and_one_page_each(tmp_path: Path) -> None:
    sheets = [sheet(SheetRequest(str(number), floor=number % 2), "A4" if number % 2 else "A3") for number in range(4)]
    first = written(tmp_path, *sheets).read_bytes()
    assert written(tmp_path, *sheets).read_bytes() == first
    document = pypdfium2.PdfDocument(first)
    assert len(document) == 4
    assert [entry.get_title() for entry in document.get_toc()] == [f"floor {n % 2}: {n}" for n in range(4)]
    document.close()
    assert b"PrintScaling /None" in first
    assert len(first) < 4 * 70_000


def test_one_image_on_two_pages_is_stored_once(tmp_path: Path) -> None:
    one = len(written(tmp_path, sheet(LOBBY)).read_bytes())
    two = len(written(tmp_path, sheet(LOBBY), sheet(SheetRequest("lobby", floor=2))).read_bytes())
    assert two < 1.2 * one


@pytest.mark.parametrize("text", ["lobby 7", "Küche", "Αθήνα", "Москва", "n° 4 – 5", ""])
def test_european_letters_are_drawn(text: str) -> None:
    assert printable(text) == text


def test_what_is_not_drawn_is_marked() -> None:
    assert printable("7日") == f"7{MISSING}"
    assert printable(MISSING) == MISSING


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
        "landmark 7: an image 0.25 m wide does not fit A4 with 10 mm white margin (at most 0.19 m); choose A3 or A2"
    )
    with pytest.raises(UsageError, match="no paper size is large enough: make it smaller"):
        page_layout(SHEET_SIZES["A0"], 0.9, 1.0, "7")
