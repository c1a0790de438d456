"""Extents of floors, tables of landmarks, surveyed points and data sets."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.common.findings import Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.extents import (
    FloorFit,
    fingerprint_findings,
    fingerprint_problem,
    floor_findings,
    floor_fit,
    landmark_findings,
    refused_positions,
    too_far,
)

HALL = np.array([(0.0, 0.0), (52.0, 3.0), (40.0, 31.0), (9.0, 18.0), (np.nan, np.nan)])
GRID = np.array([-7_541.3, 4_864_920.8])
DEGREES = np.array([8.4, 49.0]) + HALL / 1e5


@pytest.mark.parametrize(
    ("scale", "severity"), [(1e-5, Severity.ERROR), (1e-3, Severity.ERROR), (1000, Severity.ERROR), (100, "warning")]
)
def test_landmarks_in_another_unit_are_reported(scale: float, severity: str) -> None:
    (found,) = landmark_findings(1, HALL * scale, None)
    assert (found.kind, found.count, found.severity) == ("implausible_extent", 4, severity)
    assert "Possible cause: " in found.message


def test_possible_landmarks_are_not_reported() -> None:
    for places in (HALL, HALL + GRID, HALL[:2] / 1000, HALL[:0]):
        assert landmark_findings(1, places, (60.0, 40.0)) == []


def test_a_floor_whose_landmarks_are_in_a_corner_may_be_in_centimetres() -> None:
    (found,) = landmark_findings(1, HALL, (6000.0, 4000.0))
    assert "span 52 m of a plan that is 6000 m long" in found.message
    assert landmark_findings(1, HALL[:3], (6000.0, 4000.0)) == [], "three may be at one end of a large hall"


@pytest.mark.parametrize(
    ("sides", "words"),
    [
        ({1: (5200.0, 3100.0)}, "floor 1 is 5200 m x 3100 m"),
        ({1: (52.0, 31.0), 2: (2000.0, 1200.0)}, "floor 2 is 2000 m long and floor 1 52 m"),
    ],
)
def test_sizes_of_floors(sides: dict[int, tuple[float, float]], words: str) -> None:
    (found,) = floor_findings("site.toml", sides)
    assert words in found.message
    assert floor_findings("site.toml", {1: (200.0, 100.0), 2: (20.0, 15.0)}) == []


def test_points_to_survey_are_metres_of_any_grid() -> None:
    names = list("abcd")
    assert "4 points span 0.00052 m" in refused_positions(names, DEGREES[:4])
    assert refused_positions(names, HALL[:4] + GRID) == ""
    assert refused_positions(["a", "b", "a"], DEGREES[:3]) == "", "one point may be measured often"


def test_positions_that_readers_skip_are_not_written() -> None:
    assert "the coordinates of b" in too_far(["a", "b"], np.array([(1.0, 2.0), GRID]))
    assert too_far(["a"], np.array([(999_999.0, -2.0)])) == ""


def rows(position: FloatArray, building: str = "") -> pl.DataFrame:
    known = position[np.isfinite(position).all(axis=1)]
    return pl.DataFrame({"building": building, "x": known[:, 0], "y": known[:, 1]})


def test_fingerprints_in_another_unit_are_refused() -> None:
    assert "about (8.4" in fingerprint_problem(rows(DEGREES))
    two = pl.concat([rows(DEGREES[:1], "A"), rows(DEGREES[1:2], "B")])
    assert "span 0.00052 m" in fingerprint_problem(two), "each building has a single position"
    assert "4 of 4 positions are more than" in fingerprint_problem(rows(HALL * 1000 - 26_000))


def test_fingerprints_of_a_national_grid_are_clean() -> None:
    campus = pl.concat([rows(HALL + GRID, "A"), rows(HALL - GRID, "B")])
    assert (fingerprint_problem(campus), fingerprint_findings(campus)) == ("", [])


def test_a_building_in_centimetres_is_reported() -> None:
    (found,) = fingerprint_findings(rows(HALL[:4] * 100))
    assert "the positions of a building span 5,200 m" in found.message
    assert fingerprint_problem(rows(HALL[:4] * 100)) == ""


def test_single_positions_far_away_and_equal_positions_are_reported() -> None:
    many = np.concatenate([np.tile(HALL[:4], (5, 1)), [(9e5, 0.0)]])
    assert fingerprint_problem(rows(many)) == ""
    assert [found.count for found in fingerprint_findings(rows(many))] == [1]
    (equal,) = fingerprint_findings(rows(np.tile(HALL[:1], (4, 1))))
    assert "all fingerprints have the same position" in equal.message


@pytest.mark.parametrize(
    ("other", "fit"),
    [
        ((0, 70.2, 0, 40.2), FloorFit.FITS),
        ((0, 71.0, 0, 40.0), FloorFit.FITS),
        ((0, 73.8, 0, 53.5), FloorFit.OTHER_SHAPE),
        ((0, 35.1, 0, 20.1), FloorFit.OTHER_SIZE),
        ((5, 73.8, 2, 53.5), FloorFit.DIFFERS),
        ((5, 75.2, 2, 42.2), FloorFit.FITS),
        ((5, 40.1, 2, 22.1), FloorFit.OTHER_SIZE),
        ((65, 135.2, 0, 40.2), FloorFit.APART),
        ((4_398_200, 4_398_270, 0, 40), FloorFit.APART),
        ((0, 70.2, 41, 81), FloorFit.APART),
    ],
)
def test_floors_of_a_building_are_above_each_other(other: tuple[float, float, float, float], fit: FloorFit) -> None:
    assert floor_fit(other, (0, 70.2, 0, 40.2)) is fit
