"""Files that are not tables of points, recognised by their first bytes, with the export to use instead."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.intake.foreign_table import decoded

_LOOKED_AT = 8192
_XML = re.compile(rb"\s*<[?!A-Za-z]")
_NO_ROOT = re.compile(rb"<!--.*?(-->|\Z)|<\?.*?(\?>|\Z)", re.DOTALL)
_ROOT = re.compile(rb"<(?:[A-Za-z][\w.-]*:)?([A-Za-z][\w.-]*)")
_CSV = "Export the points as a table in CSV"
_OF_ITS_PROGRAM = "Export the points as CSV or XLSX from the program that wrote it"
_SHEET = "Save the sheet as CSV or XLSX"
_UNPACK = "Unpack it and choose the file with the points"
_TRIMBLE = "Export the points in Trimble Access with Export, Comma delimited (*.csv)"
_TOPCON = "Export the coordinates on the instrument or in Topcon MAGNET as CSV (Name, E, N, Z)"
_NIKON = "Export the coordinates on the instrument with Communication, Download, Coordinates"
_CARLSON = "Export the points in Carlson SurvCE or SurvPC with Export ASCII File"
_LEICA = "Export the points on the instrument or in Leica Infinity as GSI, LandXML or ASCII"
_CAD = "Export the points from the CAD program as CSV with number, E and N"
_MAP = "Export the points in QGIS with Save Features As, CSV, in a projected system in metres"


@dataclass(frozen=True)
class _Format:
    """A format, how a file of it begins (or its endings, if its content is binary), and how to export its points."""

    name: str
    starts: bytes
    export: str
    suffixes: tuple[str, ...] = ()


_NEVER = rb"(?!)"
_FORMATS = (
    _Format("a PDF document", rb"%PDF-", _OF_ITS_PROGRAM),
    _Format("an OpenDocument spreadsheet (ODS)", rb"PK\x03\x04[\s\S]{26}mimetypeapplication/vnd\.oasis", _SHEET),
    _Format("an Excel 97-2003 workbook or another old Office document", rb"\xd0\xcf\x11\xe0", _SHEET),
    _Format("a ZIP archive", rb"PK[\x03\x05]", _UNPACK),
    _Format("a compressed file (gzip)", rb"\x1f\x8b", _UNPACK),
    _Format("a Sokkia SDR file", rb"00NMSDR", _TOPCON),
    _Format("a Trimble DC file", rb"00NM", _TRIMBLE),
    _Format("a Trimble job file", _NEVER, _TRIMBLE, (".job", ".dc", ".vce")),
    _Format(
        "a Topcon GTS file",
        rb"GTS-?\d|_'[^\n]{1,30}\(|([A-Z]{2,5}[ \t][^\n]*\n){1,8}?(UNITS[ \t]+[MF],|STN[ \t]+[^,\n]+,)",
        _TOPCON,
    ),
    _Format("a Topcon job file", _NEVER, _TOPCON, (".tlsv", ".mjf", ".gt7")),
    _Format("a Nikon raw file", rb"CO,\s*Nikon", _NIKON),
    _Format("a Carlson raw file (RW5)", rb"JB,NM", _CARLSON),
    _Format(
        "a Carlson coordinate file (CRD)",
        rb"New CRD Format",
        _CARLSON,
        (".crd", ".crdb"),
    ),
    _Format("a Leica IDEX file", rb"HEADER\s+VERSION", _LEICA),
    _Format("a Leica database file", _NEVER, _LEICA, (".dbx", ".xcf", ".x01", ".x02", ".x06", ".x35", ".x36")),
    _Format("a Geodimeter file", rb"\d{1,2}=[^\n]*\n\s*\d{1,2}=", _CSV),
    _Format("a Zeiss M5 or REC file", rb"For[ _](M5|R[45]|REC)", _CSV),
    _Format("a DXF drawing", rb"(999[^\n]*\n[^\n]*\n\s*)*0\s*\n\s*SECTION|AutoCAD Binary DXF", _CAD),
    _Format("a DWG drawing", rb"AC10\d\d\x00", _CAD),
    _Format("an IFC model", rb"ISO-10303-21", _CAD),
    _Format("a shapefile", rb"\x00\x00\x27\x0a", _MAP, (".dbf", ".shx")),
    _Format("a GeoPackage or another SQLite database", rb"SQLite format 3", _MAP),
    _Format("a GeoJSON file", rb"\{[^{}]*\"type\"\s*:\s*\"(Feature|Geometry|Point|Multi)", _MAP),
    _Format("a JSON file", rb"[\[{]\s*([\"\[{\]}]|-?\d)", _CSV),
    _Format("a point cloud", rb"LASF|ASTM-E57|ply\s", _CSV),
    _Format("an RTF document", rb"\{\\rtf", _OF_ITS_PROGRAM),
    _Format("an image", rb"\x89PNG|\xff\xd8\xff|II\*\x00|MM\x00\*|GIF8", _OF_ITS_PROGRAM),
)
_ROOTS = {
    b"jobfile": ("a Trimble JobXML file", _TRIMBLE),
    b"kml": ("a KML file", _MAP),
    b"gpx": ("a GPX file", _MAP),
    b"featurecollection": ("a GML file", _MAP),
    b"html": ("a web page", _OF_ITS_PROGRAM),
    b"svg": ("an SVG drawing", _OF_ITS_PROGRAM),
    b"workbook": ("an Excel 2003 XML workbook", _SHEET),
}
"""Formats in XML by the name of their root element."""


def is_workbook(raw: bytes) -> bool:
    """Whether a file is an Excel workbook (XLSX), whatever its name."""
    return raw.startswith(b"PK\x03\x04") and b"xl/workbook" in raw


def xml_root(raw: bytes) -> bytes | None:
    """Name of the root element of an XML file, without its prefix and in lower case; None for other files."""
    head = _head(raw)
    if not _XML.match(head):
        return None
    root = _ROOT.search(_NO_ROOT.sub(b"", head))
    return root[1].lower() if root else b""


def refuse_foreign_file(path: Path, raw: bytes) -> None:
    """Raise SurveyError for a file that is not text in lines, with its format and the export to use."""
    found = _foreign(path, raw)
    if found is not None:
        name, export = found
        raise SurveyError(f"{path}: this is {name}; expected a table (text or XLSX), Leica GSI or LandXML. {export}")


def _foreign(path: Path, raw: bytes) -> tuple[str, str] | None:
    """Name of the format, and how to export from it; None for text in lines."""
    root, head = xml_root(raw), _head(raw)
    if root is not None:
        return _ROOTS.get(root, ("an XML file of another kind", _OF_ITS_PROGRAM))
    binary = b"\x00" in head
    for one in _FORMATS:
        if re.match(rb"\s*(" + one.starts + rb")", head) or (binary and path.suffix.lower() in one.suffixes):
            return one.name, one.export
    return ("a binary file", _OF_ITS_PROGRAM) if binary else None


def _head(raw: bytes) -> bytes:
    """How a file begins, in UTF-8 and without a byte order mark, if it is text."""
    marked = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    return decoded(raw[:_LOOKED_AT])[0].encode() if marked else raw[:_LOOKED_AT].removeprefix(b"\xef\xbb\xbf")
