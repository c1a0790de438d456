from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.preparation.registration.point_columns import parse_columns
from vislam2tag.preparation.registration.point_file import read_points


def rows_of(tmp_path: Path, text: str, columns: str | None = None) -> tuple[list[Measurement], list[str]]:
    path = tmp_path / "S1.csv"
    path.write_text(text)
    rows, findings = read_points(path, None if columns is None else parse_columns(columns))
    return rows, [finding.kind for finding in findings]


def coordinates(row: Measurement) -> tuple[str, float, float]:
    return row.point, row.place.real, row.place.imag


@pytest.mark.parametrize(
    "header",
    [
        "Point,East,North,Height",
        "PtID,E [m],N [m],H [m]",
        "Punktnummer,Rechtswert,Hochwert,Höhe",
        "Pkt-Nr.,Ostwert (m),Nordwert (m),Z",
        "name,easting,northing,elevation",
    ],
)
def test_headers_in_both_languages(tmp_path: Path, header: str) -> None:
    rows, findings = rows_of(tmp_path, f"{header}\n7,1.5,2.5,3.5\n")
    assert [coordinates(row) for row in rows] == [("7", 1.5, 2.5)]
    assert rows[0].height_m == 3.5
    assert findings == []


def test_columns_in_any_order_with_code_and_station(tmp_path: Path) -> None:
    (row,), _ = rows_of(tmp_path, "Standpunkt;Hochwert;Code;Punkt;Rechtswert\nA;2,5;LM;007;1,50\n")
    assert (coordinates(row), row.code, row.station) == (("7", 1.5, 2.5), "LM", "A")
    assert (row.source, row.decimals) == ("S1.csv:2", 2)


def test_surveyors_y_before_x_is_east_and_told(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "Punkt;Y;X\n7;1;2\n")
    assert coordinates(row) == ("7", 1, 2)
    (other,), _ = rows_of(tmp_path, "name;X;Y\n7;1;2\n")
    assert coordinates(other) == ("7", 1, 2)
    (late,), _ = rows_of(tmp_path, "name;H;Y;X\n7;9;1;2\n")
    assert (coordinates(late), late.height_m) == (("7", 1, 2), 9)
    assert findings == ["assumed_columns"]


def test_without_a_header_custom_counts_and_is_told(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "7 1.5 2.5 3.5 LM\n")
    assert (coordinates(row), row.height_m, row.code) == (("7", 1.5, 2.5), 3.5, "LM")
    assert findings == ["assumed_columns"]


def test_given_columns_outdo_header_and_custom(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "7,1,2,3\n", "point,N,E,H")
    assert (coordinates(row), findings) == (("7", 2, 1), [])
    (row,), _ = rows_of(tmp_path, "a,b,c,d\nx,7,1,2\n", "-,point,N,E")
    assert coordinates(row) == ("7", 2, 1)


def test_lines_before_the_header_are_passed_over(tmp_path: Path) -> None:
    rows, _ = rows_of(tmp_path, "Job;Mall;floor 3\nDate;2026-01-01\nPunkt;Y;X;H\n7;1;2;3\n")
    assert [coordinates(row) for row in rows] == [("7", 1, 2)]


def test_bad_lines_are_counted_by_number(tmp_path: Path) -> None:
    path = tmp_path / "S1.csv"
    path.write_text("Point,E,N\n7,1,2\n8,one,2\n,1,2\n9,1\n10,1e12,0\n11,3,4\n")
    rows, findings = read_points(path)
    assert [row.point for row in rows] == ["7", "11"]
    assert {finding.kind: finding.lines for finding in findings} == {
        "malformed_lines": (3, 4, 5),
        "non_finite_values": (6,),
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Point,E,H\n7,1,2\n", r"S1\.csv:1: the header has no column for N .* --columns"),
        ("Point,E,N\n", r"S1\.csv: no line is a point"),
        ("only words here\nand here too\n", r"S1\.csv:1: the header has no column for point and E and N"),
    ],
)
def test_files_that_are_no_table_of_points(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        rows_of(tmp_path, text)


def test_points_with_decimal_commas_between_commas_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "control.csv"
    path.write_text("point,E,N\nK1,0,5,1,5\n")
    with pytest.raises(SurveyError, match=r"control\.csv:2: 5 values under 3 columns"):
        read_points(path)


POINTS = [("A1", 1000 + 5000j), ("A2", 1020 + 5000j), ("7", 1005.5 + 5004.25j)]


@pytest.mark.parametrize(
    "text",
    [
        "Punkt;Rechts;Hoch\nA1;1'000.000;5'000.000\nA2;1\u2019020.000;5\u00a0000.000\n7;1\u202f005.500;5\u2009004.250\n",
        'Point,E,N\nA1,"1,000.000","5,000.000"\nA2,"1,020.000","5,000.000"\n7,"1,005.500","5,004.250"\n',
        "Pkt;Y;X\nA1;1.000,000;5.000,000\nA2;1.020,000;5.000,000\n7;1.005,500;5.004,250\n",
        "Point ID,Easting,Northing\n-,m,m\nA1,1000.000 m,5000.000 m\nA2,1020m,5000m\n7,1005500 mm,500425 cm\n",
        "Pt;Est;Nord\n;[mm];[mm]\nA1;1000000;5000000\nA2;1020000;5000000\n7;1005500;5004250\n",
        "Point E_mm N_cm\nA1 1000000 500000\nA2 1020000 500000\n7 1005500 500425\n",
        "Point ID  Easting [m]  Northing [m]\nA1  1000  5000\nA2  1020  5000\n7  1005.5  5004.25\n",
        "A1 1000 m 5000 m\nA2 1020 m 5000 m\n7 1005.5 m 5004.25 m\n",
        "Matricule;X;Y;Z\nA1;1000,000;5000,000;1,0\nA2;1020,000;5000,000;1,0\n7;1005,500;5004,250;1,0\n",
        "N.;Est;Nord;Quota s.l.m.\nA1;1000;5000;1\nA2;1020;5000;1\n7;1005.5;5004.25;1\n",
        "# Point,Northing,Easting\nA1,5000,1000\nA2,5000,1020\n7,5004.25,1005.5\n",
        "0 A1 X 1000.000 Y 5000.000 Z 1.0\n1 A2 X 1020.000 Y 5000.000\n2 7 X 1005.500 Y 5004.250 Z 1.0\n",
        "A1: E=1000,000, N=5000,000\nA2: E=1020,000, N=5000,000\n7: E=1005,500, N=5004,250\n",
        "Punkt: A1 Hochwert: 5000 m; Rechtswert: 1000 m\nPunkt: A2 Hochwert: 5000 m; Rechtswert: 1020 m\n"
        "Punkt: 7 Hochwert: 5004.25 m; Rechtswert: 1005.5 m\n",
        "Nr;R;H\r\rA1;1000;5000\rA2;1020;5000\r7;1005.5;5004.25\r",
    ],
)
def test_numbers_units_and_labels_are_read_in_every_clear_style(tmp_path: Path, text: str) -> None:
    rows, findings = rows_of(tmp_path, text)
    assert [row.point for row in rows] == [name for name, _ in POINTS]
    assert [row.place for row in rows] == pytest.approx([place for _, place in POINTS])
    assert "malformed_lines" not in findings


def test_feet_of_a_header_are_converted_and_reported(tmp_path: Path) -> None:
    path = tmp_path / "S1.csv"
    path.write_text("Point,E (ft),N [ftUS],H_ft\n7,100,3937,10\n8,110,3947,10\n")
    (row, _), findings = read_points(path)
    assert [row.place, row.height_m] == pytest.approx([30.48 + 1200j, 3.048])
    assert row.decimals == 3
    assert ["one unit is 0.3048 m" in each.message for each in findings] == [True, False]
    assert "N [ftUS]: converted to metres, one unit is 0.3048006 m" in findings[1].message


@pytest.mark.parametrize(
    "text",
    ["A1 2 600 000.12 1 200 000.5\nA2 2 600 020.12 1 200 000.5\n", "Point,E,N,H\nA1,1,000.500,5,000.25,100\n"],
)
def test_groups_of_digits_that_separate_fields_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(
        SurveyError, match=r"S1\.csv:\d: \d values under \d columns; with commas or blanks between groups"
    ):
        rows_of(tmp_path, text)


def test_rows_are_quoted_without_markup_and_control_characters(tmp_path: Path) -> None:
    path = tmp_path / "S1.csv"
    path.write_text("Point,E,N\n7,1,2\n8,<b>one</b>\x1b[2J,12 gon\n")
    _, (finding,) = read_points(path)
    assert finding.lines == (3,)
    assert "rows such as '8, one \\u001b[2J,12 gon' are skipped" in finding.message
