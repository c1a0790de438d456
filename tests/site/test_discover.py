"""Mistakes about a survey as a whole are findings."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from tests.locks import lock
from tests.mutations import mutate, some_or_many
from tests.site.site import plan_bytes, write_survey
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.discover import BESIDE_M, LEAST_BYTES, read_site
from vislam2tag.site.model import SessionKey


def kinds(findings: tuple[Finding, ...]) -> dict[tuple[str, str], tuple[int, ...]]:
    return {(finding.kind, finding.file): finding.lines for finding in findings}


def test_a_clean_survey_has_no_findings(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path))
    assert survey.findings == ()
    assert [ref.key for ref in survey.sessions] == [
        SessionKey(1, "LG", "2022-01-14T16:35:30"),
        SessionKey(1, "One Plus", "walk"),
        SessionKey(4, "LG", "2022-01-14T16:35:30"),
    ]
    assert [ref.slug for ref in survey.sessions] == [
        "floor_1.LG.2022-01-14T163530",
        "floor_1.One-Plus.walk",
        "floor_4.LG.2022-01-14T163530",
    ]
    assert {ref.format for ref in survey.sessions} == {"published"}
    one, four = survey.site.floors
    assert (one.number, one.name, one.width_m, one.height_m, one.elevation_m) == (1, "Floor 1", 60.0, 32.5, None)
    assert one.plan == tmp_path / "floor_1/floorplan.jpg"
    assert four.plan == tmp_path / "floor_4/floorplan.png"
    assert one.control_points.position_bcs.tolist() == [[1.0, 2.0], [3.5, 4.0]]
    assert four.control_points.ids == ()


def test_landmarks_of_all_floors_with_their_default_sigma(tmp_path: Path) -> None:
    marks = open_survey(write_survey(tmp_path), 0.05).site.landmarks
    assert list(zip(marks.floor.tolist(), marks.ids, strict=True)) == [(1, "10"), (1, "7"), (4, "10"), (4, "7")]
    assert marks.position_bcs.tolist() == [[1.5, 2.5], [30.0, 4.0], [9.0, 9.0], [1.0, 1.0]]
    np.testing.assert_allclose(marks.covariance_bcs, np.repeat(np.eye(2)[None] * 0.0025, 4, axis=0))
    assert marks.surveyed.all()
    assert np.isnan(marks.z_m).all()


def test_landmarks_and_control_points_know_their_lines(tmp_path: Path) -> None:
    changes: dict[str, str | bytes | None] = {
        "floor_1/marker_dict.csv": "id,x,y\n\n10,1,1\nbad,one,1\n7,2,2\n",
        "floor_1/refmarker.csv": "1,2\nbad\n3,4\n",
    }
    site = open_survey(write_survey(tmp_path, changes)).site
    assert site.landmarks.source[:2] == ("floor_1/marker_dict.csv:3", "floor_1/marker_dict.csv:5")
    assert site.landmarks.on_floor(4).source == ("floor_4/marker_dict.csv:2", "floor_4/marker_dict.csv:3")
    assert site.floors[0].control_points.source == ("floor_1/refmarker.csv:1", "floor_1/refmarker.csv:3")


def test_optional_columns_in_any_order(tmp_path: Path) -> None:
    text = "id,sigma_m,y,x,heading_rad,z,floor,heading_sigma_rad\n10.0,0.1,2,1,1.57,1.4,4.0,0.02\n7,,,,,,,\n"
    changes: dict[str, str | bytes | None] = {
        "floor_1/marker_dict.csv": text,
        "floor_4/marker_dict.csv": "id,x,y\n",
        "floor_dimensions.csv": "id,width,height,name,elevation\n1,60,32,Ground floor,0\n4,40,20,,12.5\n",
    }
    site = open_survey(write_survey(tmp_path, changes)).site
    marks = site.landmarks
    assert (marks.ids, marks.floor.tolist()) == (("10", "7"), [4, 1])
    assert marks.position_bcs[0].tolist() == [1.0, 2.0]
    assert (marks.z_m[0], marks.heading_rad[0], marks.heading_sigma_rad[0]) == (1.4, 1.57, 0.02)
    np.testing.assert_allclose(marks.covariance_bcs[0], np.eye(2) * 0.01)
    assert marks.surveyed.tolist() == [True, False]
    assert marks.covariance_bcs[1].tolist() == [[math.inf, 0.0], [0.0, math.inf]]
    assert [(floor.name, floor.elevation_m) for floor in site.floors] == [("Ground floor", 0.0), ("Floor 4", 12.5)]


def test_a_heading_without_a_sigma_counts_and_a_sigma_without_a_heading_says_nothing(tmp_path: Path) -> None:
    root = write_survey(tmp_path)
    text = "id,x,y,heading_rad,heading_sigma_rad\n10,1,2,1.57,\n7,3,4,,0.02\n"
    (root / "floor_1/marker_dict.csv").write_text(text)
    marks = open_survey(root).site.landmarks.on_floor(1)
    np.testing.assert_array_equal(marks.heading_rad, [1.57, np.nan])
    np.testing.assert_array_equal(marks.heading_sigma_rad, [0.05, np.nan])


BAD_LANDMARKS = "1,1,1\n\n2,one,1\n,1,1\n3,5\n4,1,1,0\n5,1e999,1\n1,2,2\n6,1,1,-1\n"
DAMAGE: dict[str, tuple[dict[str, str | bytes | None], dict[tuple[str, str], tuple[int, ...]]]] = {
    "no extents": ({"floor_dimensions.csv": None}, {("missing_file", "floor_dimensions.csv"): ()}),
    "wrong header": (
        {"floor_dimensions.csv": "a,b\n1,2\n"},
        {
            ("malformed_header", "floor_dimensions.csv"): (1,),
            ("floor_without_size", "floor_dimensions.csv"): (),
        },
    ),
    "bad extents": (
        {"floor_dimensions.csv": "id,width,height\n1,60,32\n4,0,20\n4,x,20\n4,1e7,20\n4,nan,20\n1,5,5\n4,40,20\n"},
        {
            ("malformed_lines", "floor_dimensions.csv"): (4, 6),
            ("implausible_extent", "floor_dimensions.csv"): (3, 5),
            ("duplicate_floor", "floor_dimensions.csv"): (7,),
        },
    ),
    "no plan": ({"floor_4/floorplan.png": None}, {("missing_plan", "floor_4/floorplan.jpg"): ()}),
    "no image": ({"floor_4/floorplan.png": "<html>"}, {("unreadable_plan", "floor_4/floorplan.png"): ()}),
    "half an image": (
        {"floor_1/floorplan.jpg": plan_bytes("JPEG")[:-60], "floor_4/floorplan.png": plan_bytes("PNG")[:-40]},
        {("unreadable_plan", "floor_1/floorplan.jpg"): (), ("unreadable_plan", "floor_4/floorplan.png"): ()},
    ),
    "no landmarks": ({"floor_1/marker_dict.csv": None}, {("missing_file", "floor_1/marker_dict.csv"): ()}),
    "empty landmarks": ({"floor_1/marker_dict.csv": b""}, {("malformed_header", "floor_1/marker_dict.csv"): ()}),
    "bad landmarks": (
        {"floor_1/marker_dict.csv": f"id,x,y,sigma_m\n{BAD_LANDMARKS}"},
        {
            ("malformed_lines", "floor_1/marker_dict.csv"): (4, 5, 6, 7, 10),
            ("non_finite_values", "floor_1/marker_dict.csv"): (8,),
            ("duplicate_landmarks", "floor_1/marker_dict.csv"): (9,),
        },
    ),
    "bad control points": (
        {"floor_1/refmarker.csv": "1,2\nx,3\n4\nnan,1\n,\n5,6\n"},
        {("malformed_lines", "floor_1/refmarker.csv"): (2, 3, 4, 5)},
    ),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_site_files_are_findings(tmp_path: Path, name: str) -> None:
    changes, expected = DAMAGE[name]
    survey = open_survey(write_survey(tmp_path, changes))
    assert kinds(survey.findings) == expected
    assert len(survey.sessions) == 3


def test_nan_written_as_a_coordinate_is_reported_and_empty_is_unsurveyed(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path, {"floor_1/marker_dict.csv": "id,x,y\n1,nan,nan\n2,,\n"}))
    assert kinds(survey.findings) == {("non_finite_values", "floor_1/marker_dict.csv"): (2,)}
    assert survey.site.landmarks.ids == ("2", "10", "7")


def test_absurd_coordinates_and_floors_are_not_used(tmp_path: Path) -> None:
    rows = "1,1e6,-1e6,,\n2,1e7,1,,\n3,1,-1e300,,\n4,1,1,1e300,\n5,1,1,,99999999999999999999\n"
    changes: dict[str, str | bytes | None] = {
        "floor_1/marker_dict.csv": f"id,x,y,sigma_m,floor\n{rows}",
        "floor_1/refmarker.csv": "1,2\n1e200,3\n4,-1000001\n",
    }
    survey = open_survey(write_survey(tmp_path, changes))
    assert kinds(survey.findings) == {
        ("malformed_lines", "floor_1/marker_dict.csv"): (5, 6),
        ("non_finite_values", "floor_1/marker_dict.csv"): (3, 4),
        ("malformed_lines", "floor_1/refmarker.csv"): (2, 3),
        ("landmarks_off_plan", ""): (),  # a thousand kilometres may be meant, but not on this plan
    }
    assert survey.site.landmarks.ids[:2] == ("1", "10")
    assert survey.site.floors[0].control_points.position_bcs.tolist() == [[1.0, 2.0]]


def test_spellings_of_a_number_are_one_landmark(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path, {"floor_1/marker_dict.csv": "id,x,y\n07,1,1\n7,2,2\n+8.0,3,3\n"}))
    assert kinds(survey.findings) == {("duplicate_landmarks", "floor_1/marker_dict.csv"): (3,)}
    assert survey.site.landmarks.ids[:2] == ("7", "8")


def test_a_landmark_listed_for_another_floor_is_a_duplicate_there(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path, {"floor_1/marker_dict.csv": "id,x,y,floor\n10,1,1,4\n"}))
    assert kinds(survey.findings) == {("duplicate_landmarks", "floor_4/marker_dict.csv"): (2,)}


def test_folders_without_a_session_are_named_but_a_devices_files_are_not(tmp_path: Path) -> None:
    write_survey(tmp_path)
    (tmp_path / "floor_4/tachymeter").mkdir()
    (tmp_path / "floor_4/tachymeter/20220214_Tracking.csv").write_text("time;X;Y\n")
    (tmp_path / "floor_4/LG/.hidden").mkdir()
    (tmp_path / "floor_4/LG/2022-01-15T10:00:00").mkdir()
    (tmp_path / "floor_04").mkdir()
    (tmp_path / "notes").mkdir()
    survey = open_survey(tmp_path)
    assert len(survey.sessions) == 3
    assert kinds(survey.findings) == {
        ("unrecognised_folder", "floor_4/LG/2022-01-15T10:00:00"): (),
        ("duplicate_floor", "floor_04"): (),
    }


def test_what_is_no_survey_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="no such folder"):
        open_survey(tmp_path / "gone")
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(SurveyError, match="not a folder"):
        open_survey(file)
    with pytest.raises(SurveyError, match="no folder named floor_0"):
        open_survey(tmp_path)
    (tmp_path / "floor_1" / "LG" / "empty").mkdir(parents=True)
    with pytest.raises(SurveyError, match="no session"):
        open_survey(tmp_path)


def test_a_session_folder_whose_name_is_not_text_is_left_out(tmp_path: Path) -> None:
    write_survey(tmp_path)
    name = os.fsdecode(b"walk\xff")
    try:
        (tmp_path / "floor_4/LG/2022-01-14T16:35:30").rename(tmp_path / "floor_4/LG" / name)
    except OSError:
        pytest.skip("this file system takes only text as names")
    survey = open_survey(tmp_path)
    assert len(survey.sessions) == 2
    assert kinds(survey.findings) == {("unrecognised_folder", "floor_4/LG/walk\ufffd"): ()}


def test_a_survey_that_cannot_be_looked_into_is_our_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock(monkeypatch, write_survey(tmp_path))
    with pytest.raises(SurveyError, match="Permission denied"):
        open_survey(tmp_path)


@pytest.mark.parametrize(
    ("locked", "expected", "sessions"),
    [
        ("floor_dimensions.csv", {("unreadable_file", "floor_dimensions.csv"): ()}, 3),
        ("floor_4/marker_dict.csv", {("unreadable_file", "floor_4/marker_dict.csv"): ()}, 3),
        ("floor_1/refmarker.csv", {("unreadable_file", "floor_1/refmarker.csv"): ()}, 3),
        ("floor_1/LG", {("unreadable_folder", "floor_1/LG"): ()}, 2),
        (
            "floor_4",
            {
                ("unreadable_folder", "floor_4"): (),
                ("unreadable_file", "floor_4/marker_dict.csv"): (),
                ("unreadable_file", "floor_4/refmarker.csv"): (),
            },
            2,
        ),
        ("floor_1/One Plus/walk", {}, 3),
    ],
)
def test_what_is_locked_is_a_finding_and_the_rest_goes_on(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    locked: str,
    expected: dict[tuple[str, str], tuple[int, ...]],
    sessions: int,
) -> None:
    lock(monkeypatch, write_survey(tmp_path) / locked)
    survey = open_survey(tmp_path)
    assert kinds(survey.findings) == expected
    assert {finding.severity for finding in survey.findings} <= {Severity.ERROR}
    assert len(survey.sessions) == sessions


def test_a_survey_whose_sessions_are_all_locked_away_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_survey(tmp_path)
    for name in ("floor_1", "floor_4"):
        lock(monkeypatch, tmp_path / name)
    with pytest.raises(SurveyError, match=r"no session .*; floor_1: the folder cannot be opened \(Permission denied\)"):
        open_survey(tmp_path)


@some_or_many
@pytest.mark.parametrize("name", ["floor_dimensions.csv", "floor_1/marker_dict.csv", "floor_1/refmarker.csv"])
def test_damaged_site_files_raise_nothing(tmp_path: Path, name: str, files: int) -> None:
    for floor in ("floor_1", "floor_4"):
        (tmp_path / floor).mkdir()
    clean = (write_survey(tmp_path / "clean") / name).read_bytes()
    rng = np.random.default_rng(4)
    for _ in range(files):
        (tmp_path / name).write_bytes(mutate(clean, rng))
        site, _ = read_site(tmp_path)
        surveyed = site.landmarks.position_bcs[site.landmarks.surveyed]
        assert np.isfinite(surveyed).all()
        assert all(np.isfinite(floor.control_points.position_bcs).all() for floor in site.floors)


def test_what_a_killed_command_had_moved_aside_is_moved_back(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "site")
    work = survey.with_name(f".{survey.name}.vislam2tag")
    work.mkdir()
    survey.rename(work / "old")
    assert read_site(survey)[0].floors
    assert not work.exists()


POSE = "1000000000; 0,1; 0,2; 0,3; 0,0; 0,0; 0,0; 1,0\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """One walk on a floor of 40 m x 20 m with a landmark on its wall."""
    walk = tmp_path / "floor_1" / "LG" / "walk"
    walk.mkdir(parents=True)
    (walk / "poses.csv").write_text(POSE * (LEAST_BYTES // len(POSE) + 1))
    (tmp_path / "floor_dimensions.csv").write_text("floor,width,height\n1,40,20\n")
    (tmp_path / "floor_1" / "marker_dict.csv").write_text("id,x,y\n1,0,0\n")
    return tmp_path


def kinds_of(root: Path) -> list[str]:
    wanted = ("landmarks_off_plan", "implausible_extent", "walk_twice", "unrecognised_folder")
    return [finding.kind for finding in open_survey(root).findings if finding.kind in wanted]


@pytest.mark.parametrize(
    ("scale", "kinds"),
    [
        (1.0, []),
        (1e-5, ["implausible_extent"]),
        (1000.0, ["implausible_extent", "landmarks_off_plan"]),
        (1 / 0.3048, ["landmarks_off_plan"]),
    ],
)
def test_landmarks_in_another_unit(root: Path, scale: float, kinds: list[str]) -> None:
    rows = [f"{i},{x * scale},{y * scale}" for i, (x, y) in enumerate([(0, 0), (38, 2), (39, 19), (3, 18)])]
    (root / "floor_1" / "marker_dict.csv").write_text("\n".join(["id,x,y", *rows]) + "\n")
    assert kinds_of(root) == kinds
    said = [finding.message for finding in open_survey(root).findings if finding.kind == "landmarks_off_plan"]
    unit = {1000.0: "mm", 1 / 0.3048: "ft"}.get(scale, "")
    assert all(f"all would be on it in {unit}: " in message for message in said)


@pytest.mark.parametrize(("x", "off"), [(40 + BESIDE_M - 0.1, False), (40 + BESIDE_M + 0.1, True), (-9.0, True)])
def test_landmarks_off_the_plan(root: Path, x: float, off: bool) -> None:
    (root / "floor_1" / "marker_dict.csv").write_text(f"id,x,y\n1,0,0\n2,{x},5\n3,,\n")
    assert kinds_of(root) == ["landmarks_off_plan"] * off
    (root / "corrections.toml").write_text('[[landmark_units]]\nfloor = 1\nunit = "ft"\n')
    assert kinds_of(root) == [], "a corrected table is not judged by what the file says"


def test_a_walk_that_is_there_twice(root: Path) -> None:
    copy = root / "floor_1" / "LG" / "walk (1)"
    copy.mkdir()
    (copy / "poses.csv").write_bytes((root / "floor_1/LG/walk/poses.csv").read_bytes())
    assert kinds_of(root) == ["walk_twice"]
    (copy / "poses.csv").write_text((root / "floor_1/LG/walk/poses.csv").read_text().replace("0,1", "0,4"))
    assert kinds_of(root) == [], "of the same size, but another walk"


def test_walks_in_a_folder_that_is_no_floor(root: Path) -> None:
    (root / "Annex" / "LG" / "walk").mkdir(parents=True)
    assert kinds_of(root) == []
    (root / "Annex" / "LG" / "walk" / "poses.csv").write_text(POSE)
    assert kinds_of(root) == ["unrecognised_folder"]


def test_exchanged_axes_are_named_and_a_correction_is_checked_too(root: Path) -> None:
    places = [(0, 2), (38, 2), (39, 19), (30, 18)]
    rows = "\n".join(f"{i},{y},{x}" for i, (x, y) in enumerate(places))
    (root / "floor_1" / "marker_dict.csv").write_text(f"id,x,y\n{rows}\n")
    (finding,) = (each for each in open_survey(root).findings if each.kind == "landmarks_off_plan")
    assert "all would be on it with x and y exchanged" in finding.message
    corrections = root / "corrections.toml"
    corrections.write_text("[[turn_landmarks]]\nfloor = 1\nmirrored = true\nturn_deg = -90.0\n")
    assert kinds_of(root) == []
    corrections.write_text("[[turn_landmarks]]\nfloor = 1\nmirrored = true\nshift_m = [40.0, 0.0]\n")
    assert kinds_of(root) == ["landmarks_off_plan"]
