"""Rows of a survey's site files, as people save them.

Tables as spreadsheets write them say the same as ours, and what was guessed is told.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from tests.site.site import write_survey
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.model import Survey
from vislam2tag.site.site_table import LANDMARKS, LineCounts, finite_or_none, is_file, number_or_none, read_site_table


def test_rows_keep_their_lines_and_fields_lose_their_blanks(tmp_path: Path) -> None:
    (tmp_path / "floor_1").mkdir()
    path = tmp_path / "floor_1" / "landmarks.csv"
    path.write_bytes('\ufeffID, X ,Y\r\n\r\na, 1.5,"2,5"\r\nb\r\n'.encode())
    table = read_site_table(tmp_path, path)
    assert table.header == ("id", "x", "y")
    assert table.rows == ((3, ("a", "1.5", "2,5")), (4, ("b",)))
    assert [table.cell(fields, "y") for _, fields in table.rows] == ["2,5", ""]
    assert table.cell(table.rows[0][1], "z") == ""
    assert table.place(3) == "floor_1/landmarks.csv:3"


def test_without_a_header_the_first_line_is_a_row(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1,2\n3,4\n")
    table = read_site_table(tmp_path, tmp_path / "a.csv", has_header=False)
    assert (table.header, table.rows) == ((), ((1, ("1", "2")), (2, ("3", "4"))))


@pytest.mark.parametrize(("text", "number"), [("", None), ("-1.5", -1.5), ("1e3", 1000.0)])
def test_optional_numbers(text: str, number: float | None) -> None:
    assert (number_or_none(text), finite_or_none(text)) == (number, number)


@pytest.mark.parametrize("text", ["1_000", "one", "1,5", "nan", "inf"])
def test_what_is_no_finite_number(text: str) -> None:
    with pytest.raises(ValueError, match=r"number|finite|float"):
        finite_or_none(text)


def test_lines_of_a_kind_are_one_finding_in_the_order_of_the_messages() -> None:
    counts = LineCounts("a.csv")
    counts.add("malformed_lines", 2)
    counts.add("duplicate_floor", 5)
    counts.add("malformed_lines", 7)
    found = counts.findings({"duplicate_floor": "is twice", "malformed_lines": "is odd", "empty_file": "is not"})
    assert [(one.kind, one.lines, one.count, one.message) for one in found] == [
        ("duplicate_floor", (5,), 1, "is twice"),
        ("malformed_lines", (2, 7), 2, "is odd"),
    ]


def test_a_file_is_there_or_not_or_cannot_be_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    assert is_file(tmp_path / "file")
    assert not is_file(tmp_path)
    assert not is_file(tmp_path / "absent")
    assert not is_file(tmp_path / "file" / "below")

    def refused(*_: object, **__: object) -> os.stat_result:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "stat", refused)
    with pytest.raises(PermissionError):
        is_file(tmp_path / "file")


PLAIN = "id,x,y,z,sigma_m\n10,1.5,2.5,1.25,0.04\n7,30,4,,\n"
TABLES: dict[str, tuple[str | bytes, str | None]] = {
    "semicolons and decimal commas": (
        "id;x;y;z;sigma_m\n10;1,5;2,5;1,25;0,04\n7;30;4;;\n",
        "fields are separated by ;",
    ),
    "tabs": (PLAIN.replace(",", "\t"), "fields are separated by tabs"),
    "byte order mark and quotes": (
        b'\xef\xbb\xbf"id","x","y","z","sigma_m"\r\n"10","1,5","2,5","1,25","0,04"\r\n"7","30","4","",""\r\n',
        "numbers have a decimal comma",
    ),
    "Excel's first line": ("sep=;\nid;x;y;z;sigma_m\n10;1.5;2.5;1.25;.04\n7;30;4\n", "fields are separated by ;"),
    "UTF-16": (PLAIN.replace("id,", "Höhe über,").encode("utf-16"), None),
    "Windows": ("id,x,y,Höhe,sigma\n10,1.5,2.5,1.25,0.04\n7,30,4,,\n".encode("cp1252"), "Höhe was read as z; sigma"),
    "German names, id last": (
        "Rechtswert;Hochwert;Höhe [m];Genauigkeit;Marke\n1,5;2,5;1,25;0,04;10\n30;4;;;7\n",
        "Rechtswert was read as x; Hochwert was read as y; Höhe [m] was read as z; Genauigkeit was read as "
        "sigma_m; Marke was read as id",
    ),
    "a description first": (
        "Beschreibung;Hochwert;Rechtswert;Höhe;Genauigkeit;Nummer\nTür;2,5;1,5;1,25;0,04;10\nTür;4;30;;;7\n",
        "Nummer was read as id",
    ),
    "English names": (
        "Northing,Easting,Marker ID,Elevation,accuracy\n2.5,1.5,10,1.25,0.04\n4,30,7,,\n",
        "Northing was read as y",
    ),
    "centimetres": (
        "id,x [cm],y (cm),z_cm,sigma_cm\n10,150,250,125,4\n7,3000,400,,\n",
        "x [cm] was read as x (a unit is 0.01 m)",
    ),
    "feet": (
        "name,x_ft,Y [ft],height (feet),sigma_m\n10,4.9212598425,8.2020997375,4.1010498688,0.04\n"
        "7,98.4251968504,13.1233595801,,\n",
        "x_ft was read as x (a unit is 0.3048 m); Y [ft] was read as y",
    ),
}


def check(survey: Survey, told: str | None, file: str = "floor_1/marker_dict.csv") -> None:
    here = survey.site.landmarks.on_floor(1)
    assert here.ids == ("10", "7")
    np.testing.assert_allclose(here.position_bcs, [[1.5, 2.5], [30.0, 4.0]], rtol=1e-9)
    np.testing.assert_allclose(here.z_m, [1.25, np.nan], rtol=1e-9)
    np.testing.assert_allclose(here.covariance_bcs[:, 0, 0], [0.04**2, 0.02**2], rtol=1e-9)
    found = [finding for finding in survey.findings if finding.kind == "assumed_columns"]
    assert [(finding.file, finding.count) for finding in found] == ([] if told is None else [(file, 2)])
    assert told is None or told in found[0].message


@pytest.mark.parametrize("name", TABLES)
def test_landmarks_as_people_have_them(tmp_path: Path, name: str) -> None:
    text, told = TABLES[name]
    check(open_survey(write_survey(tmp_path, {"floor_1/marker_dict.csv": text})), told)


def test_landmarks_in_a_spreadsheet(tmp_path: Path) -> None:
    root = write_survey(tmp_path, {"floor_1/marker_dict.csv": None, "floor_1/refmarker.csv": None})
    book = openpyxl.Workbook()
    assert book.active is not None
    for row in (("Marker", "x [m]", "y", "z", "sigma_m"), (10, 1.5, 2.5, 1.25, 0.04), (None,), (7.0, 30, 4)):
        book.active.append(row)
    book.create_sheet("notes").append(("nothing",))
    book.save(root / "floor_1" / "marker_dict.xlsx")
    points = openpyxl.Workbook()
    assert points.active is not None
    points.active.append((1, 2))
    points.active.append((3.5, 4))
    points.save(root / "floor_1" / "refmarker.xlsx")
    survey = open_survey(root)
    check(survey, "of 2 sheets the first, Sheet, was read", "floor_1/marker_dict.xlsx")
    assert survey.site.landmarks.on_floor(1).source[1] == "floor_1/marker_dict.xlsx:4"
    np.testing.assert_array_equal(survey.site.floor(1).control_points.position_bcs, [[1.0, 2.0], [3.5, 4.0]])


def test_a_spreadsheet_that_is_none_is_a_finding(tmp_path: Path) -> None:
    changes: dict[str, str | bytes | None] = {
        "floor_1/marker_dict.csv": None,
        "floor_1/marker_dict.xlsx": b"PK\x03\x04",
    }
    survey = open_survey(write_survey(tmp_path, changes))
    (found,) = survey.findings
    assert (found.kind, found.file) == ("unreadable_file", "floor_1/marker_dict.xlsx")
    assert "it is not a readable XLSX file" in found.message


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("1;2\n3,5;4\n", "fields are separated by ;; numbers have a decimal comma"),
        ("Punkt;Hochwert;Rechtswert\nA;2;1\nB;4;3,5\n", "Hochwert was read as y; Rechtswert was read as x"),
        ("x [ft],y [ft]\n3.280839895,6.56167979\n11.482939633,13.123359580\n", "(a unit is 0.3048 m)"),
    ],
)
def test_control_points_as_people_have_them(tmp_path: Path, text: str, told: str) -> None:
    survey = open_survey(write_survey(tmp_path, {"floor_1/refmarker.csv": text}))
    np.testing.assert_allclose(survey.site.floor(1).control_points.position_bcs, [[1.0, 2.0], [3.5, 4.0]], rtol=1e-9)
    (found,) = survey.findings
    assert (found.kind, found.file) == ("assumed_columns", "floor_1/refmarker.csv")
    assert told in found.message


def test_extents_as_people_have_them(tmp_path: Path) -> None:
    text = "Floor;Width [ft];Height [ft];Name\n1;196,8503937;106,6272966;Ground\n4;131,2335958;65,6167979;Top\n"
    survey = open_survey(write_survey(tmp_path, {"floor_dimensions.csv": text}))
    assert [floor.name for floor in survey.site.floors] == ["Ground", "Top"]
    assert [floor.width_m for floor in survey.site.floors] == pytest.approx([60, 40])


def test_marks_of_both_kinds_are_not_guessed_at(tmp_path: Path) -> None:
    text = "id;x;y\n10;1,5;2.5\n7;30;4\n"
    survey = open_survey(write_survey(tmp_path, {"floor_1/marker_dict.csv": text}))
    assert survey.site.landmarks.on_floor(1).ids == ("7",)
    assert ("malformed_lines", (2,)) in [(finding.kind, finding.lines) for finding in survey.findings]


def test_decimal_commas_between_commas_are_not_columns(tmp_path: Path) -> None:
    path = tmp_path / "marker_dict.csv"
    path.write_text("id,x,y\n1,12,5,7,25\n2,3,4\n3,1.5,2.5,near the door\n", encoding="utf-8")
    table = read_site_table(tmp_path, path, columns=LANDMARKS)
    assert [line for line, _ in table.rows] == [3, 4]
    assert [(one.kind, one.lines) for one in table.findings] == [("malformed_lines", (2,))]
    assert "decimal commas" in table.findings[0].message
