from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.point_file import read_points

TABLE = "Point,E,N\n7,1,2\n"
FOREIGN = {
    "a.jxl": (b'<?xml version="1.0"?>\n<JOBFile jobName="x"/>', "a Trimble JobXML file"),
    "b.dc": (b"00NMSC V10-70       01-Jan-26\n", "a Trimble DC file"),
    "c.job": (b"\x05\x00\x00\x01", "a Trimble job file"),
    "d.sdr": (b"00NMSDR33 V04-04.02\r\n", "a Sokkia SDR file"),
    "e.gt7": (b"GTS-700 v3.0\nJOB T1,\n", "a Topcon GTS file"),
    "f.gt7": (b"JOB    T1,\r\nINST  x\r\nUNITS   M,D\r\nSTN  1,1.5,\r\n", "a Topcon GTS file"),
    "g.dbx": (b"\x01\x02\x00\x07", "a Leica database file"),
    "h.idx": (b"HEADER\n VERSION 1.20\n", "a Leica IDEX file"),
    "i.rw5": (b"JB,NMtest,DT01-01-2026\n", "a Carlson raw file"),
    "j.crd": (b"\x00\x00\x10\x00", "a Carlson coordinate file"),
    "k.raw": (b"CO,Nikon RAW data format V2.00\n", "a Nikon raw file"),
    "l.txt": (b"\xef\xbb\xbf  0\r\nSECTION\r\n", "a DXF drawing"),
    "m.ods": (b"PK\x03\x04" + bytes(26) + b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet", "an OpenDocument"),
    "n.xlsx": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel 97-2003 workbook"),
    "o.csv": (b"%PDF-1.7\n", "a PDF document"),
    "p.zip": (b"PK\x03\x04\x14\x00", "a ZIP archive"),
    "q.shp": (b"\x00\x00\x27\x0a\x00", "a shapefile"),
    "r.kml": (b'<!-- <LandXML> -->\n<kml xmlns="x"/>', "a KML file"),
    "s.json": (b'{"type": "FeatureCollection", "features": []}', "a GeoJSON file"),
    "t.csv": (b"<!DOCTYPE html>\n<html>", "a web page"),
    "u.are": (b"50=JOB\r\n5=A1\r\n37=5000.0\r\n", "a Geodimeter file"),
    "v.bin": (b"ab\x00cd", "a binary file"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_other_formats_are_named_with_the_export_to_use(tmp_path: Path, name: str) -> None:
    content, expected = FOREIGN[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SurveyError, match=rf"{name}: this is {expected}.*LandXML\. (Export|Save|Unpack) ") as raised:
        read_points(tmp_path / name)
    assert not any(each in str(raised.value) for each in "<\x00\n")


@pytest.mark.parametrize("name", ["a.job", "b.dc", "c.crd", "d.xlsx"])
def test_the_content_decides_and_not_the_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(TABLE)
    assert [row.point for row in read_points(tmp_path / name)[0]] == ["7"]
