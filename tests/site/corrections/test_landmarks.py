from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.site.corrections.test_file import EXAMPLE, KEY, corrections_of
from tests.walks import landmarks_at
from vislam2tag.site.corrections.landmarks import corrected_landmarks
from vislam2tag.site.model import SessionKey


def test_landmarks_are_moved_and_excluded_on_their_floor(tmp_path: Path) -> None:
    marks = landmarks_at({"10": (1, 1), "7": (2, 2), "3": (3, 3)})
    marks.heading_rad[:] = 1.0
    corrected, uses = corrected_landmarks(marks, corrections_of(tmp_path, EXAMPLE), KEY)
    assert corrected.ids == ("10", "3")
    assert corrected.position_bcs.tolist() == [[3.0, 4.5], [3.0, 3.0]]
    assert np.isnan(corrected.heading_rad).tolist() == [True, False]
    assert uses == ("Landmark 10 is placed at (3, 4.5).",)
    assert marks.position_bcs[0].tolist() == [1.0, 1.0]


def test_an_entrys_floor_is_the_landmarks(tmp_path: Path) -> None:
    marks = landmarks_at({"10": (1, 1), "7": (2, 2)})
    marks.floor[:] = 3
    text = "[[move_landmark]]\nid = 10\nfloor = {0}\nx = 5\ny = 6\n[[exclude_landmark]]\nid = 7\nfloor = {0}\n"
    there, uses = corrected_landmarks(marks, corrections_of(tmp_path, text.format(3)), KEY)
    assert (there.ids, there.position_bcs.tolist(), len(uses)) == (("10",), [[5.0, 6.0]], 1)
    elsewhere, uses = corrected_landmarks(marks, corrections_of(tmp_path, text.format(KEY.floor)), KEY)
    assert (elsewhere.ids, uses) == (("10", "7"), ())


def test_a_moved_landmark_has_the_sigma_of_the_entry_else_its_own(tmp_path: Path) -> None:
    text = "[[move_landmark]]\nid = 10\nx = 5\ny = 6\n"
    for more, variance in (("", 0.0025), ("sigma_m = 0.2\n", 0.04)):
        marks = landmarks_at({"10": (1, 1)})
        marks.covariance_bcs[0] = np.eye(2) * 0.0025
        corrected, _ = corrected_landmarks(marks, corrections_of(tmp_path, text + more), KEY)
        np.testing.assert_allclose(corrected.covariance_bcs[0], np.eye(2) * variance)


def test_moving_an_unsurveyed_landmark_surveys_it(tmp_path: Path) -> None:
    marks = landmarks_at({"10": (np.nan, np.nan)})
    marks.covariance_bcs[0] = np.diag([np.inf, np.inf])
    corrected, _ = corrected_landmarks(marks, corrections_of(tmp_path, EXAMPLE), KEY, 0.25)
    assert corrected.surveyed.all()
    assert corrected.covariance_bcs.tolist() == [[[0.0625, 0.0], [0.0, 0.0625]]]


def test_tables_in_feet_mirrored_and_turned(tmp_path: Path) -> None:
    """In feet, then mirrored about x = 0, a quarter turn, a shift; the other floor stays."""
    text = """
[[landmark_units]]
floor = 0
unit = "ft"

[[turn_landmarks]]
floor = 0
mirrored = true
turn_deg = 90.0
shift_m = [10.0, 1.0]
"""
    corrections = corrections_of(tmp_path, text)
    before = landmarks_at({"1": (10.0, 20.0)})
    corrected, uses = corrected_landmarks(before, corrections, KEY)
    np.testing.assert_allclose(corrected.position_bcs, [[10 - 6.096, 1 - 3.048]])
    np.testing.assert_allclose(corrected.covariance_bcs, before.covariance_bcs, atol=1e-12)
    np.testing.assert_allclose(before.position_bcs, [[10.0, 20.0]])
    assert len(uses) == 2
    assert corrected_landmarks(before, corrections.for_session(SessionKey(7, "LG", "x")), KEY)[1] == ()
