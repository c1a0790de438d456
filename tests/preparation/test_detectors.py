"""What a camera sees of tags, sheets and QR codes: oblique, in glare, twice; drawn by the projection that is undone."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import segno

from tests.preparation.sheets.printed import printed
from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.detect_landmarks import (
    Detector,
    Seen,
    placed,
    qr_detector,
    sheet_detector,
    sheet_tag_detector,
    surest,
    tag_detector,
)
from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.images import dead_leaves_picture
from vislam2tag.preparation.sheets.page import (
    SheetPage,
    largest_width_m,
    page_layout,
    read_tags,
    sheet_tag,
    tag_rows,
    write_pdf,
)
from vislam2tag.preparation.sheets.settings import SHEET_SIZES
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest

SIZE_PX = (1280, 960)
LENS_PX = np.array((1000.0, 1000.0, 640.0, 480.0))
SIDE_M = 0.2
Place = tuple[float, float, float]


def tag(number: int) -> GreyImage:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    return np.pad(np.asarray(cv2.aruco.generateImageMarker(dictionary, number, 400), np.uint8), 50, constant_values=255)


def seen_at(
    poster: GreyImage, paper_m: float, place_m: Place, turned_deg: float, onto: GreyImage | None = None
) -> GreyImage:
    """A poster whose middle is at ``place_m`` (right, down, ahead of the camera), turned about its upright."""
    picture = np.full((SIZE_PX[1], SIZE_PX[0]), 150, np.uint8) if onto is None else onto.copy()
    side = poster.shape[0]
    half = paper_m / 2
    turn = cv2.Rodrigues(np.array((0.0, np.radians(turned_deg), 0.0)))[0]
    corners = np.array(((-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0))) @ turn.T + place_m
    there = (corners[:, :2] / corners[:, 2:] * LENS_PX[:2] + LENS_PX[2:]).astype(np.float32)
    here = np.array(((0, 0), (side, 0), (side, side), (0, side)), np.float32)
    warped = cv2.getPerspectiveTransform(here, there)
    smooth = cv2.GaussianBlur(poster, (0, 0), max(0.3, side / np.ptp(there[:, 0]) / 3))
    cv2.warpPerspective(np.asarray(smooth, np.uint8), warped, SIZE_PX, dst=picture, borderMode=cv2.BORDER_TRANSPARENT)
    return picture


def found_in(picture: GreyImage, *detectors: Detector) -> tuple[dict[str, FloatArray], int]:
    """Where each landmark was found, right, down and ahead of the camera, metres, and how many are doubtful."""
    sure, doubtful = surest([detect(picture) for detect in detectors], LENS_PX)
    return {name: pose.position_m * (1, -1, -1) for name, pose in sure.items()}, doubtful


@pytest.mark.parametrize("turned_deg", [0.0, 45.0, -60.0, 70.0])
def test_oblique_tags_are_placed_within_their_sigma(turned_deg: float) -> None:
    place = (0.3, -0.2, 2.5)
    picture = seen_at(tag(7), 0.25, place, turned_deg)
    (seen,) = tag_detector("apriltag-36h11", SIDE_M)(picture)
    pose = placed(seen, LENS_PX)
    assert pose is not None
    error = np.linalg.norm(pose.position_m * (1, -1, -1) - place)
    assert error < max(0.02, 3 * np.sqrt(3) * pose.sigma_m)
    assert pose.sigma_m < 0.1


@pytest.mark.parametrize(("left_px", "side_px"), [(100, 40), (100, 60), (600, 80), (580, 120)])
def test_corners_seen_exactly_from_the_front_have_their_pose(left_px: int, side_px: int) -> None:
    corners = np.array(((0, 0), (1, 0), (1, 1), (0, 1))) * side_px + (left_px, 420.0)
    pose = placed(Seen("7", corners, 0.5, (SIDE_M, SIDE_M)), LENS_PX)
    assert pose is not None
    ahead = LENS_PX[0] * SIDE_M / side_px
    middle = (corners.mean(axis=0) - LENS_PX[2:]) / LENS_PX[:2] * ahead
    np.testing.assert_allclose(pose.position_m, (middle[0], -middle[1], -ahead), atol=1e-6)


def in_glare(picture: GreyImage, x: int, y: int, radius: int) -> GreyImage:
    """The picture with a lamp's reflection, white in its middle."""
    glare = np.zeros(picture.shape, np.float32)
    cv2.circle(glare, (x, y), radius, 1.0, -1)
    return np.asarray(np.clip(picture + 255 * cv2.GaussianBlur(glare, (0, 0), 15), 0, 255), np.uint8)


def moved_while_exposed(picture: GreyImage, pixels: int) -> GreyImage:
    """The picture of a camera that turns sideways by so many pixels."""
    return np.asarray(cv2.blur(picture, (pixels, 1)), np.uint8)


def test_glare_hides_a_tag_and_moves_none() -> None:
    picture = seen_at(tag(7), 0.25, (-0.4, 0, 2.0), 20.0, seen_at(tag(9), 0.25, (0.5, 0, 2.0), -20.0))
    detector = tag_detector("apriltag-36h11", SIDE_M)
    clear, _ = found_in(picture, detector)
    assert clear.keys() == {"7", "9"}
    left, _ = found_in(in_glare(picture, 440, 480, 60), detector)
    assert left.keys() == {"9"}
    np.testing.assert_allclose(left["9"], clear["9"], atol=0.01)


SHEET_M = 0.3
SHEET_PICTURES = {name: dead_leaves_picture(0, name) for name in ("3", "4", "5")}


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> Detector:
    folder = tmp_path_factory.mktemp("images")
    for name, picture in SHEET_PICTURES.items():
        cv2.imwrite(str(folder / f"{name}.png"), picture)
    rows = "".join(f"{name},{name}.png,{SHEET_M}\n" for name in SHEET_PICTURES)
    (folder / "manifest.csv").write_text(f"id,file,width_m\n{rows}", encoding="utf-8")
    return sheet_detector(folder)


@pytest.mark.parametrize(("turned_deg", "blur_px"), [(0.0, 1), (45.0, 1), (-50.0, 1), (20.0, 13)])
def test_a_sheet_is_placed_obliquely_and_in_motion(turned_deg: float, blur_px: int, sheets: Detector) -> None:
    place = (0.0, -0.1, 1.2)
    picture = moved_while_exposed(seen_at(SHEET_PICTURES["4"], SHEET_M, place, turned_deg), blur_px)
    found, doubtful = found_in(picture, sheets)
    assert (set(found), doubtful) == ({"4"}, 0)
    np.testing.assert_allclose(found["4"], place, atol=0.05)


@pytest.mark.parametrize(("turned_deg", "blur_px"), [(0.0, 60), (65.0, 1)])
def test_a_sheet_too_blurred_or_oblique_to_know_is_not_found(turned_deg: float, blur_px: int, sheets: Detector) -> None:
    picture = moved_while_exposed(seen_at(SHEET_PICTURES["4"], SHEET_M, (0, 0, 1.2), turned_deg), blur_px)
    assert found_in(picture, sheets) == ({}, 0)


def test_glare_hides_a_sheet_or_a_part_of_it_and_moves_none(sheets: Detector) -> None:
    other = seen_at(SHEET_PICTURES["5"], SHEET_M, (0.35, 0, 1.2), -20.0)
    picture = seen_at(SHEET_PICTURES["3"], SHEET_M, (-0.3, 0, 1.2), 20.0, other)
    clear, _ = found_in(picture, sheets)
    assert clear.keys() == {"3", "5"}, "all sheets of a picture count"
    for radius, left in ((45, {"3", "5"}), (180, {"5"})):
        found, doubtful = found_in(in_glare(picture, 390, 480, radius), sheets)
        assert (set(found), doubtful) == (left, 0)
        for name, place in found.items():
            np.testing.assert_allclose(place, clear[name], atol=0.03)


def test_what_hangs_twice_in_one_picture_is_doubtful(sheets: Detector) -> None:
    for poster, side_m, detector in (
        (SHEET_PICTURES["3"], SHEET_M, sheets),
        (tag(7), 0.25, tag_detector("apriltag-36h11", SIDE_M)),
    ):
        other = seen_at(poster, side_m, (0.35, 0, 1.2), 0.0)
        assert found_in(seen_at(poster, side_m, (-0.3, 0, 1.2), 0.0, other), detector) == ({}, 2)


def test_qr_codes_name_their_landmark() -> None:
    rows = np.array(segno.make_qr("Main building/1/lobby", error="m").matrix)
    code = np.pad(np.kron(1 - rows, np.ones((12, 12))) * 255, 48, constant_values=255).astype(np.uint8)
    side_m = 0.3
    picture = seen_at(code, side_m * code.shape[0] / (12 * rows.shape[0]), (0.1, 0.1, 1.2), 25.0)
    place, doubtful = found_in(picture, qr_detector(side_m))
    assert (set(place), doubtful) == ({"lobby"}, 0)
    np.testing.assert_allclose(place["lobby"], (0.1, 0.1, 1.2), atol=0.05)
    assert not qr_detector(side_m)(np.full((480, 640), 90, np.uint8))


def test_a_printed_tag_tells_where_the_picture_beside_it_is(tmp_path: Path) -> None:
    size = SHEET_SIZES["A4"]
    layout = page_layout(size, largest_width_m(size, 1.0), 1.0, "12")
    sheet = SheetPage(SheetRequest("12", "Main", 1), layout, 12)
    write_pdf(Folder.at(tmp_path), "sheets.pdf", [sheet], {"12": dead_leaves_picture(0, "12")})
    (tmp_path / "tags.csv").write_text(tag_rows({"12": sheet_tag(12, layout)}), encoding="utf-8")
    page = printed(tmp_path / "sheets.pdf", dpi=101.6).shown  # 4 px a millimetre
    detector = sheet_tag_detector(read_tags(tmp_path))
    (seen,) = detector(page)
    centre = seen.corners_px.mean(axis=0) / 4000 - np.array(seen.centre_m) * (1, -1)
    x, y = layout.image.centre_m
    np.testing.assert_allclose(centre, (x, size.height_m - y), atol=0.0005)
    height, width = page.shape
    square = np.full((height, height), 150, np.uint8)
    square[:, (height - width) // 2 : (height - width) // 2 + width] = page
    place, _ = found_in(seen_at(square, size.height_m, (0.0, 0.0, 1.5), 30.0), detector)
    up = y - size.height_m / 2
    np.testing.assert_allclose(place["12"], (0.0, -up, 1.5), atol=0.03)
