"""Points in Leica GSI-8 and GSI-16, and in LandXML, as tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.common.visible_text import excerpt
from vislam2tag.intake.cells import length_unit
from vislam2tag.intake.foreign_table import Line, decoded
from vislam2tag.preparation.registration.foreign_files import xml_root
from vislam2tag.preparation.registration.text_table import TextTable, numbered_lines

_HEADER = ("point", "E", "N", "H", "code")
_BLOCK = re.compile(r"\*?\d\d[\d.]{4}[+-](?:.{8}|.{16})(?: |$)")
_WORD = {
    8: re.compile(r"(\d\d)[\d.]{3}([\d.])([+-])(.{8})(?: |$)"),
    16: re.compile(r"(\d\d)[\d.]{3}([\d.])([+-])(.{16})(?: |$)"),
}
_GSI_UNITS = {"0": ("m", 3), "1": ("ft", 3), "6": ("m", 4), "7": ("ft", 4), "8": ("m", 5)}
"""By the sixth character of a word: unit and digits after the decimal mark."""
_POINT, _CODE, _EAST, _NORTH, _HEIGHT = "11", "71", "81", "82", "83"
_SETUP, _CODE_BLOCK, _MEASURED = {"84", "85"}, "41", {"21", "22", "31", "32", "33"}
_Words = dict[str, tuple[str, str, str]]
"""Unit, sign and data of each word of a block by its two digits."""
_POINT_ELEMENTS = ("cgpoint", "targetpoint")
"""Of LandXML; the second counts if there are none of the first."""


def instrument_table(path: Path, raw: bytes) -> TextTable | None:
    """The points of a GSI or LandXML file as a table with header; None for a file of another kind.

    Raises SurveyError if the file is one of these and contains no points.
    """
    if xml_root(raw) == b"landxml":
        return _landxml(path, raw)
    lines = numbered_lines(decoded(raw)[0])
    return _gsi(path, lines) if lines and _BLOCK.match(lines[0][1]) else None


def _gsi(path: Path, lines: list[tuple[int, str]]) -> TextTable:
    blocks = [(number, _words(line)) for number, line in lines]
    points = [(number, _gsi_point(words)) for number, words in blocks if {_EAST, _NORTH} <= words.keys()]
    if not points:
        measured = next((number for number, words in blocks if _MEASURED & words.keys()), None)
        found = f"line {lines[0][0]} is '{excerpt(lines[0][1])}'"
        if measured is not None:
            found = f"line {measured} has only angles and distances"
        raise SurveyError(
            f"{path}: the GSI file has no coordinates ({found}); expected blocks with the words 81 (east), 82 (north) "
            "and 83 (height). Export the points again, with a GSI format that contains coordinates"
        )
    return TextTable(path.name, ((lines[0][0], _HEADER), *points), ";", ".", tuple(_gsi_findings(path.name, blocks)))


def _words(line: str) -> _Words:
    text = line.lstrip()
    words = _WORD[16 if text.startswith("*") else 8].finditer(text.removeprefix("*"))
    return {word[1]: (word[2], word[3], word[4]) for word in words}


def _gsi_point(words: _Words) -> tuple[str, ...]:
    name, code = (words[word][2].strip().lstrip("0") if word in words else "" for word in (_POINT, _CODE))
    if _POINT in words:
        name = name or "0"
    return name, *(_gsi_length(words[word]) if word in words else "" for word in (_EAST, _NORTH, _HEIGHT)), code


def _gsi_length(word: tuple[str, str, str]) -> str:
    """A number with its unit; what is not a length stays as it is, and is not a number."""
    unit, sign, data = word
    if unit not in _GSI_UNITS or not data.isdecimal():
        return f"{sign}{data} in unit {unit}"
    name, digits = _GSI_UNITS[unit]
    whole = data.zfill(digits + 1)
    return f"{sign}{whole[:-digits]}.{whole[-digits:]} {name}"


def _gsi_findings(file: str, blocks: list[tuple[int, _Words]]) -> list[Finding]:
    others = [(number, words) for number, words in blocks if not {_EAST, _NORTH} <= words.keys()]
    setups = [number for number, words in others if words.keys() >= _SETUP]
    rest = [number for number, words in others if number not in setups and _CODE_BLOCK not in words]
    without = "blocks without coordinates (words 81 and 82) are skipped: export these points with their coordinates"
    feet = [number for number, words in blocks if _EAST in words and words[_EAST][0] in ("1", "7")]
    return [
        *at_lines_if(
            "assumed_columns",
            file,
            setups,
            "blocks of a station's set-up are not points and are skipped",
            Severity.INFO,
        ),
        *at_lines_if("malformed_lines", file, rest, without),
        *at_lines_if("assumed_columns", file, feet, "feet were read as international feet (0.3048 m)", Severity.INFO),
    ]


def _landxml(path: Path, raw: bytes) -> TextTable:
    units, found = _landxml_points(path, raw)
    unit, findings = units[0] if units else "m", []
    if length_unit(unit) is None:
        raise SurveyError(
            f"{path}: its linearUnit '{excerpt(unit)}' is not known; expected meter, foot or USSurveyFoot"
        )
    if length_unit(unit) != 1.0 or not units:
        message = (
            f"coordinates were read in {unit} ({length_unit(unit):.7g} m): correct Units in the file if this is wrong"
        )
        findings = [Finding.at_lines("assumed_columns", path.name, [1], message, Severity.INFO)]
    rows = next((rows for rows in (_landxml_rows(found, kind, unit) for kind in _POINT_ELEMENTS) if rows), [])
    if not rows:
        raise SurveyError(
            f"{path}: the LandXML file has no points; expected elements CgPoint with northing, easting and elevation. "
            "Export it again with points"
        )
    return TextTable(path.name, ((rows[0][0], _HEADER), *rows), ";", ".", tuple(findings))


@dataclass
class _Element:
    kind: str
    line: int
    attributes: dict[str, str]
    text: str = ""


def _landxml_points(path: Path, raw: bytes) -> tuple[list[str], list[_Element]]:
    """Parse the linear units and the elements of points; entities are not expanded, because a DTD is refused."""
    parser = expat.ParserCreate(namespace_separator=" ")
    units: list[str] = []
    found: list[_Element] = []
    opened: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        opened.append(tag.rpartition(" ")[2].lower())
        if opened[-1] in _POINT_ELEMENTS:
            found.append(_Element(opened[-1], parser.CurrentLineNumber, attributes))
        elif opened[-1] in ("metric", "imperial"):
            units.append(attributes.get("linearUnit", "meter"))

    def characters(text: str) -> None:
        if opened[-1] in _POINT_ELEMENTS:
            found[-1].text += text

    def refuse_doctype(*_: object) -> None:
        raise SurveyError(
            f"{path}: line {parser.CurrentLineNumber}: a document type (DTD) is not accepted in LandXML; remove it "
            "or export the file again"
        )

    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: opened.pop()
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        raise SurveyError(
            f"{path}: line {error.lineno}: the LandXML is damaged ({expat.ErrorString(error.code)}); export it again"
        ) from error
    except (LookupError, ValueError) as error:
        raise SurveyError(
            f"{path}: the encoding of the LandXML is not known; expected UTF-8. Export it again"
        ) from error
    return units, found


def _landxml_rows(found: list[_Element], kind: str, unit: str) -> list[Line]:
    """Rows of one kind of element that has coordinates, in the order N, E, H; references to points have none."""
    rows: list[Line] = []
    for one in found:
        north, east, height, *_ = (*(f"{number} {unit}" for number in one.text.split()[:3]), "", "", "")
        if one.kind == kind and not (north == "" and "pntRef" in one.attributes):
            names = (one.attributes.get("name", ""), one.attributes.get("pntRef", ""), one.attributes.get("oID", ""))
            rows.append(
                (one.line, (next(filter(None, names), ""), east, north, height, one.attributes.get("code", "")))
            )
    return rows
