"""Sizes of paper and of the images on them.

Which landmarks are asked for: typed ids, files of landmarks, sites; and what clashes.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.site.site import write_survey
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.preparation.sheets.settings import SHEET_SIZES, sheet_size
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest, parse_ids, requested_sheets
from vislam2tag.site.model import landmark_id


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
    with pytest.raises(UsageError, match=r"'B5' is not a paper size; available are: A4, Letter, A3, A2, A1, A0"):
        sheet_size("B5")


def landmark_file(folder: Path, text: str) -> Path:
    path = folder / "landmarks.csv"
    path.write_text(text)
    return path


def test_ids_and_ranges_between_commas() -> None:
    assert parse_ids("1-4,lobby, A-12 ,007") == ("1", "2", "3", "4", "lobby", "A-12", "7")
    assert parse_ids("5-5,") == ("5",)
    assert len(parse_ids("1-1000")) == 1000


@given(first=st.integers(0, 10**6), count=st.integers(1, 50))
def test_a_range_is_its_numbers(first: int, count: int) -> None:
    assert parse_ids(f"{first}-{first + count - 1}") == tuple(map(str, range(first, first + count)))


@given(ids=st.lists(st.from_regex(r"[a-zäA-Z_.]{1,6}", fullmatch=True), unique=True, min_size=1))
def test_typed_ids_are_those_of_the_logs(ids: list[str]) -> None:
    assert parse_ids(",".join(ids)) == tuple(map(landmark_id, ids))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "--ids names no landmark"),
        (" , ,", "--ids names no landmark"),
        ("7,1-3,2", "--ids: '2' and '2' are the same id, 2; name each once"),
        ("7,07", "--ids: '7' and '07' are the same id, 7"),
        ("lobby,lobby", "are the same id, lobby"),
        ("9-3", "--ids 9-3: the range ends before it starts"),
        ("1-5000", "--ids 1-5000: more than 1000 ids, which is too many for a phone's database"),
        ("a;b", "--ids: 'a;b' is not a valid id"),
    ],
)
def test_ids_that_cannot_be_meant_are_told(text: str, message: str) -> None:
    with pytest.raises(UsageError) as told:
        parse_ids(text)
    assert message in str(told.value)


def test_a_file_says_floor_place_height_paper_and_width(tmp_path: Path) -> None:
    path = landmark_file(
        tmp_path,
        "id,floor,x,y,z,heading_rad,sheet,width_m\n07,1,2.5,3,1.5,0,A3,0.25\nlobby,-1,,,,,,\n7,2,1,1,,0,letter,\n",
    )
    first, lobby, second = requested_sheets(path, None)[0]
    assert first == SheetRequest("7", "", 1, "", (2.5, 3.0), 1.5, SHEET_SIZES["A3"], 0.25, source="landmarks.csv:2")
    assert lobby == SheetRequest("lobby", floor=-1, source="landmarks.csv:3")
    assert (second.landmark, second.floor, second.sheet, second.width_m) == ("7", 2, SHEET_SIZES["Letter"], None)


def test_a_file_of_ids_alone_will_do(tmp_path: Path) -> None:
    requests, findings = requested_sheets(landmark_file(tmp_path, "marker\n3\n1\n"), None)
    assert [one.landmark for one in requests] == ["3", "1"]
    assert requests[0].floor is None
    assert findings == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,floor\n7,1\n07,1\n", "landmarks.csv:2 and landmarks.csv:3 have the same id, 7, on one floor; rename one"),
        ("id\n7\n \x01\n", "landmarks.csv:3: '\x01' is not a valid id"),
        ("id,sheet\n7,B5\n", "landmarks.csv:2: 'B5' is not a paper size; available are: A4, Letter"),
        ("id,width_m\n7,0\n", "landmarks.csv:2: width_m 0 must be above 0 (metres)"),
        ("id,width_m\n7,wide\n", "landmarks.csv:2: could not convert"),
        ("id,floor\n7,ground\n", "landmarks.csv:2: floor, x, y and z must be numbers or empty"),
        ("7,1.5,2.5\n8,3,4\n", "the first line must name the columns"),
        ("", "the first line must name the columns"),
        ("id,x,y\n", "contains no landmark"),
    ],
)
def test_files_that_cannot_be_used_are_told_with_their_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError) as told:
        requested_sheets(landmark_file(tmp_path, text), None)
    assert message in str(told.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        SurveyError, match=r"cannot be opened .No such file or directory.; expected a site or a landmark"
    ):
        requested_sheets(tmp_path / "gone.csv", None)


def test_a_site_gives_its_landmarks_with_their_floors(tmp_path: Path) -> None:
    root = write_survey(
        tmp_path / "survey",
        {
            "floor_dimensions.csv": "id,width,height,name\n1,60,32.5,Ground\n4,40,20,\n",
            "floor_1/marker_dict.csv": "id,x,y,z,sheet,width_m\n10,1.5,2.5,1.6,A3,\n7,,,,,0.15\n",
        },
    )
    requests, findings = requested_sheets(root, None)
    assert [(one.floor, one.floor_name, one.landmark) for one in requests] == [
        (1, "Ground", "10"),
        (1, "Ground", "7"),
        (4, "Floor 4", "10"),
        (4, "Floor 4", "7"),
    ]
    assert (requests[0].position_m, requests[0].height_m, requests[0].sheet) == ((1.5, 2.5), 1.6, SHEET_SIZES["A3"])
    assert (requests[1].position_m, requests[1].height_m, requests[1].width_m) == (None, None, 0.15)
    assert findings == ()


def test_a_sites_building_is_told_and_its_odd_rows_are(tmp_path: Path) -> None:
    root = write_survey(
        tmp_path / "survey",
        {
            "site.toml": 'name = "Main building"\n[[floors]]\nnumber = 1\nname = "Ground"\n',
            "floor_1/marker_dict.csv": "id,x,y\n7,1,1\n07,2,2\n",
            "floor_4/marker_dict.csv": None,
        },
    )
    requests, findings = requested_sheets(root, None)
    assert [(one.building, one.floor_name, one.landmark) for one in requests if one.floor == 1] == [
        ("Main building", "Ground", "7")
    ]
    assert "duplicate_landmarks" in [finding.kind for finding in findings]


def test_ids_pick_from_a_site_and_must_be_there(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey")
    assert [(one.floor, one.landmark) for one in requested_sheets(root, "7")[0]] == [(1, "7"), (4, "7")]
    with pytest.raises(UsageError, match="has no landmark 8, 9; omit SITE"):
        requested_sheets(root, "7-9")


def test_a_site_without_landmarks_and_nothing_at_all(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey", {"floor_1/marker_dict.csv": None, "floor_4/marker_dict.csv": "id,x,y\n"})
    with pytest.raises(
        SurveyError,
        match=r"contains no landmark; plan landmarks with vislam2tag plan SITE --out plan --write, add rows to",
    ):
        requested_sheets(root, None)
    with pytest.raises(UsageError, match="no landmarks are given"):
        requested_sheets(None, None)
