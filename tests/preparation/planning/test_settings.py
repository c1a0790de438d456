"""Which sheet is recognised from where."""

from __future__ import annotations

from math import radians, tan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.preparation.planning.settings import CameraSettings
from vislam2tag.preparation.sheets.sheet_requests import SHEET_SIZES

CAMERA = CameraSettings()
ALL = tuple(SHEET_SIZES)


def test_the_camera_sees_what_the_command_says_it_does_by_default() -> None:
    assert CAMERA.field_of_view_rad == tuple(round(radians(angle), 4) for angle in (67, 53))


@pytest.mark.parametrize("name", ALL)
def test_from_its_distance_a_sheet_fills_a_quarter_of_the_picture(name: str) -> None:
    distance = CAMERA.fill_distance_m(SHEET_SIZES[name])
    width, height = (2 * distance * tan(angle / 2) for angle in CAMERA.field_of_view_rad)
    assert SHEET_SIZES[name].image_m ** 2 / (width * height) == pytest.approx(0.25)


@given(st.floats(0.1, 6.0))
def test_the_smallest_sheet_that_is_recognised_without_a_detour_is_taken(line_m: float) -> None:
    found = CAMERA.sheet_for(line_m, ALL, 3.6)
    easy_m = max(line_m - CAMERA.aside_m, CAMERA.nearest_m)
    large_enough = [name for name in ALL if CAMERA.fill_distance_m(SHEET_SIZES[name]) >= easy_m]
    if large_enough:
        assert found is not None
        assert found[0].name == large_enough[0]
        assert found[1] == easy_m
    elif found is not None:
        assert found[0].name == "A0"
        assert line_m - found[1] <= 3.6


def test_walls_too_far_off_and_sheets_too_small_to_be_neared_are_no_place() -> None:
    assert CAMERA.sheet_for(8.0, ("A4", "A3"), 3.6) is None
    assert CAMERA.model_copy(update={"nearest_m": 0.5}).sheet_for(1.0, ("A4",), 3.6) is None


def test_a_wider_lens_asks_for_larger_sheets() -> None:
    wide = CAMERA.model_copy(update={"field_of_view_rad": (1.9, 1.5)})
    assert wide.fill_distance_m(SHEET_SIZES["A4"]) < CAMERA.fill_distance_m(SHEET_SIZES["A4"])
