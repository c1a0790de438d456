from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.preparation.registration.point_file import read_points

POINTS = [("A1", 1000 + 5000j, 100.0), ("A2", -1020.5 + 5000j, 100.0), ("7", 1005.25 + 5004.125j, 101.5)]


def read(tmp_path: Path, text: str, encoding: str = "utf-8") -> tuple[list[Measurement], list[Finding]]:
    path = tmp_path / "S1.txt"
    path.write_bytes(text.encode(encoding))
    return read_points(path)


def gsi(unit: str, per_metre: float, width: int, *further: str) -> str:
    """The points in blocks with words of this many characters, in a unit."""

    def word(index: str, value: float) -> str:
        return f"{index}..0{unit}{'-' if value < 0 else '+'}{round(abs(value) * per_metre):0{width}d}"

    lines = [
        " ".join(
            (
                f"11{row:04d}+{name.rjust(width, '0')}",
                *map(word, ("81", "82", "83"), (place.real, place.imag, height)),
                f"71....+{'LM'.rjust(width, '0')}",
            )
        )
        for row, (name, place, height) in enumerate(POINTS, start=1)
    ]
    star = "*" if width == 16 else ""
    return "".join(f"{star}{line} \r\n" for line in (*lines, *further))


@pytest.mark.parametrize(
    ("unit", "per_metre", "width", "decimals"),
    [
        ("0", 1000, 8, 3),
        ("0", 1000, 16, 3),
        ("6", 10_000, 16, 4),
        ("8", 100_000, 16, 5),
        ("1", 1000 / 0.3048, 8, 3),
        ("7", 10_000 / 0.3048, 16, 3),
    ],
)
def test_gsi_is_read_in_all_units(tmp_path: Path, unit: str, per_metre: float, width: int, decimals: int) -> None:
    rows, findings = read(tmp_path, gsi(unit, per_metre, width))
    assert [row.point for row in rows] == [name for name, _, _ in POINTS]
    for row, (_, place, height) in zip(rows, POINTS, strict=True):
        assert abs(row.place - place) < 5e-4
        assert row.height_m == pytest.approx(height, abs=5e-4)
        assert (row.code, row.decimals) == ("LM", decimals)
    assert rows[2].source == "S1.txt:3"
    assert ["international feet" in each.message for each in findings] == [True] * (unit in "17")


def test_other_blocks_of_gsi_are_skipped_and_reported(tmp_path: Path) -> None:
    code = "410001+?......1 42....+00000LM"
    setup = "110001+000000S1 84..10+01000000 85..10+05000000 86..10+00100000 88..10+00001500"
    angles = "110004+000000A8 21.322+17920860 22.322+07567890 31..00+00012345"
    of_no_length = "110005+000000A9 81..02+01000000 82..00+05000000"
    rows, findings = read(tmp_path, gsi("0", 1000, 8, code, setup, angles, of_no_length))
    assert len(rows) == len(POINTS)
    assert [(each.kind, each.lines) for each in findings] == [
        ("assumed_columns", (5,)),
        ("malformed_lines", (6,)),
        ("malformed_lines", (7,)),
    ]


def test_gsi_without_coordinates_is_refused_with_the_export_to_use(tmp_path: Path) -> None:
    text = "410001+?......1\n110001+000000A1 21.322+17920860 22.322+07567890 31..00+00012345 \n"
    with pytest.raises(
        SurveyError, match=r"\(line 2 has only angles and distances\); .* words 81 .* Export the points"
    ):
        read(tmp_path, text)


def landxml(unit: str, metres: float = 1.0, prefix: str = "") -> str:
    system = "Imperial" if unit.lower().endswith("foot") else "Metric"
    points = "\n".join(
        f'<{prefix}CgPoint name="{name}" code="LM">{place.imag / metres:.5f} {place.real / metres:.5f} '
        f"{height / metres:.5f}</{prefix}CgPoint>"
        for name, place, height in POINTS
    )
    return (
        f'<?xml version="1.0"?>\n<!-- <kml> -->\n<{prefix}LandXML xmlns{":" * bool(prefix)}{prefix[:-1]}="urn:any">\n'
        f'<{prefix}Units><{prefix}{system} linearUnit="{unit}"/></{prefix}Units><{prefix}CgPoints><{prefix}CgPoints>\n'
        f'{points}\n<{prefix}CgPoint pntRef="A1"/></{prefix}CgPoints></{prefix}CgPoints></{prefix}LandXML>'
    )


@pytest.mark.parametrize(
    ("unit", "metres", "prefix", "encoding"),
    [
        ("meter", 1.0, "", "utf-8"),
        ("meter", 1.0, "lx:", "utf-16"),
        ("millimeter", 0.001, "", "utf-8-sig"),
        ("foot", 0.3048, "", "utf-8"),
        ("USSurveyFoot", 1200 / 3937, "", "utf-8"),
    ],
)
def test_landxml_is_read_in_all_units(tmp_path: Path, unit: str, metres: float, prefix: str, encoding: str) -> None:
    rows, findings = read(tmp_path, landxml(unit, metres, prefix), encoding)
    assert [(row.point, row.code) for row in rows] == [(name, "LM") for name, _, _ in POINTS]
    for row, (_, place, height) in zip(rows, POINTS, strict=True):
        assert abs(row.place - place) < 1e-4
        assert row.height_m == pytest.approx(height, abs=1e-4)
    assert rows[0].source == "S1.txt:5"
    assert [each.kind for each in findings] == ["assumed_columns"] * (metres != 1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (landxml("meter").replace('"1.0"', '"1.0" encoding="UT6-8"'), "the encoding of the LandXML is not known"),
        (landxml("mile"), "its linearUnit 'mile' is not known; expected meter"),
        (landxml("meter")[:-60], r"line \d+: the LandXML is damaged \([a-z ]+\); export it again"),
        (
            landxml("meter").replace("CgPoint ", "Parcel ").replace("CgPoint>", "Parcel>"),
            "no points; expected elements",
        ),
        (
            landxml("meter").replace("<LandXML", '<!DOCTYPE a [<!ENTITY b "&c;&c;">]>\n<LandXML'),
            r"line 3: a document type \(DTD\) is not accepted",
        ),
    ],
)
def test_landxml_that_cannot_be_read_is_refused_without_its_markup(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message) as raised:
        read(tmp_path, text)
    assert "<" not in str(raised.value)


def test_points_without_coordinates_or_name_in_landxml_are_reported(tmp_path: Path) -> None:
    text = landxml("meter").replace("5000.00000 1000.00000 100.00000", "5000.0").replace('name="7"', 'oID="9"')
    rows, findings = read(tmp_path, text)
    assert [row.point for row in rows] == ["A2", "9"]
    assert [(each.kind, each.lines) for each in findings] == [("malformed_lines", (5,))]
