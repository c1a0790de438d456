"""Scans from CSV and JSON lines: the same scans from both, bad lines counted, blocks that change nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import DatasetError
from vislam2tag.positioning import scan_file
from vislam2tag.positioning.scan_file import ABSURD, MALFORMED, BadLines, is_scan_file, scan_blocks

HEAD = "scan_id,bssid,rssi_dbm\n"


def read(path: Path) -> tuple[dict[str, dict[str, float]], dict[str, tuple[int, tuple[int, ...]]]]:
    """All scans of a file, and of each kind of bad lines how many and which."""
    bad = BadLines(path.name)
    scans = {}
    for block in scan_blocks(path, bad, str.lower):
        for index, scan in enumerate(block.ids.tolist()):
            dense = block.scans.dense()[index]
            names = block.scans.access_points
            scans[scan] = {name: float(level) for name, level in zip(names, dense, strict=True) if np.isfinite(level)}
    return scans, {finding.kind: (finding.count, finding.lines) for finding in bad.findings()}


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_csv_and_json_lines_say_the_same(tmp_path: Path) -> None:
    readings = [("b", "AP1", -50.0), ("b", "ap2", -60.5), ("a", "AP1", -70.0)]
    table = "\ufeffrssi_dbm, scan_id ,note,bssid\n" + "".join(
        f'{level}, {scan} ,"x, y",{ap}\n' for scan, ap, level in readings
    )
    lines = "".join(
        json.dumps({"bssid": ap, "scan_id": scan, "rssi_dbm": level, "more": None}) + "\n\n"
        for scan, ap, level in readings
    )
    expected = {"b": {"ap1": -50.0, "ap2": -60.5}, "a": {"ap1": -70.0}}
    assert read(written(tmp_path / "scans.csv", table)) == (expected, {})
    assert read(written(tmp_path / "scans.JSONL", lines)) == (expected, {})
    assert list(read(tmp_path / "scans.csv")[0]) == ["b", "a"]
    (tmp_path / "utf16.csv").write_text(table.removeprefix("\ufeff"), encoding="utf-16")
    assert is_scan_file(tmp_path / "utf16.csv")
    assert read(tmp_path / "utf16.csv") == (expected, {})


def test_bad_lines_of_csv_are_counted_and_their_scans_stay(tmp_path: Path) -> None:
    text = HEAD + "a,x,-50\na,x\n\n,x,-50\nb,x,loud\nb,,-50\nb,x,nan\nc,x,100\nc,y,0\nc,z,-inf\nc,z,-250\nd,x,-50,9\n"
    scans, bad = read(written(tmp_path / "scans.csv", text))
    assert scans == {"a": {"x": -50.0}, "b": {}, "c": {}}
    assert bad == {MALFORMED: (6, (3, 5, 6, 8, 11)), "masked_addresses": (1, (7,)), ABSURD: (3, (9, 10, 12))}


def test_levels_with_their_unit_are_read(tmp_path: Path) -> None:
    text = HEAD + "a,x,-50 dBm\na,y,-60dBm\nb,x,\u221270\n"
    assert read(written(tmp_path / "scans.csv", text)) == ({"a": {"x": -50.0, "y": -60.0}, "b": {"x": -70.0}}, {})


@pytest.mark.parametrize(
    ("levels", "kind"),
    [((80, 75, -50), "lost_sign"), ((12, 40, 55), "levels_not_dbm"), ((0.2, 0.15, 0.6), "levels_not_dbm")],
)
def test_levels_that_are_not_dbm_are_not_used(tmp_path: Path, levels: tuple[float, ...], kind: str) -> None:
    text = HEAD + "".join(f"a,{name},{level}\n" for name, level in zip("xyz", levels, strict=True))
    scans, bad = read(written(tmp_path / "scans.csv", text))
    assert scans == {"a": {"z": -50.0} if -50 in levels else {}}
    assert bad == {kind: (2, (2, 3)) if -50 in levels else (3, (2, 3, 4))}


@pytest.mark.parametrize("name", ["scans.csv", "scans.jsonl"])
def test_exchanged_columns_are_refused(tmp_path: Path, name: str) -> None:
    rows = [("net", f"02-1A-00-00-00-{number:02X}") for number in range(4)]
    table = "scan_id,bssid,ssid,rssi_dbm\n" + "".join(f"a,{bssid},{ssid},-50\n" for bssid, ssid in rows)
    lines = "".join(
        json.dumps({"scan_id": "a", "bssid": bssid, "ssid": ssid, "rssi_dbm": -50}) + "\n" for bssid, ssid in rows
    )
    with pytest.raises(DatasetError, match="the columns bssid and ssid are exchanged"):
        read(written(tmp_path / name, lines if name.endswith("l") else table))
    right = table.replace("bssid,ssid", "ssid,bssid")
    assert read(written(tmp_path / "right.csv", right))[1] == {}


def test_network_names_for_a_model_of_addresses_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "scans.csv", HEAD + "a,eduroam,-50\nb,guest net,-60\n")
    known = [f"02:ca:07:12:27:{number:02x}" for number in range(14)]
    with pytest.raises(DatasetError, match="such as 'eduroam', not addresses such as 02:ca:07:12:27:00: use"):
        list(scan_blocks(path, BadLines(path.name), str, known))
    assert list(scan_blocks(path, BadLines(path.name), str, ["eduroam", "guest net"]))


def test_bad_lines_of_json_are_counted(tmp_path: Path) -> None:
    lines = [
        '{"scan_id": 7, "bssid": "x", "rssi_dbm": -50}',
        '{"scan_id": 7, "bssid": "x"',
        "[1]",
        '{"scan_id": 7, "bssid": ["x"], "rssi_dbm": -50}',
        '{"scan_id": 7, "bssid": "x", "rssi_dbm": true}',
        '{"scan_id": null, "bssid": "x", "rssi_dbm": -50}',
        '{"scan_id": 7, "bssid": "y", "rssi_dbm": 1e999}',
        "[" * 100_000,
    ]
    scans, bad = read(written(tmp_path / "scans.jsonl", "\n".join(lines)))
    assert scans == {"7": {"x": -50.0}}
    assert bad == {MALFORMED: (6, (2, 3, 5, 6, 7)), "masked_addresses": (1, (4,))}


def test_broken_bytes_cost_only_their_line(tmp_path: Path) -> None:
    (tmp_path / "scans.csv").write_bytes(HEAD.encode() + b"a,x,-50\na,\xff\xfe,-60\nb,\x00,-5\xff\nb,x,-70\n")
    scans, bad = read(tmp_path / "scans.csv")
    assert scans["a"]["x"] == -50.0
    assert scans["b"] == {"x": -70.0}
    assert bad == {MALFORMED: (1, (4,))}
    huge = HEAD + 'a,x,-50\nb,"' + "y" * 200_000 + '",-50\nc,x,-60\n'
    scans, bad = read(written(tmp_path / "huge.csv", huge))
    assert (scans["a"], scans["c"]) == ({"x": -50.0}, {"x": -60.0})
    assert sum(count for count, _ in bad.values()) == 1


@given(st.lists(st.integers(1, 3), min_size=1, max_size=12))
def test_blocks_change_nothing(tmp_path_factory: pytest.TempPathFactory, sizes: list[int]) -> None:
    text = HEAD + "".join(f"s{scan},ap{ap},-{40 + ap}\n" for scan, size in enumerate(sizes) for ap in range(size))
    path = written(tmp_path_factory.mktemp("blocks") / "scans.csv", text)
    whole = read(path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scan_file, "SCANS_AT_ONCE", 3)
        assert read(path) == whole
        blocks = list(scan_blocks(path, BadLines("x"), str))
    assert [len(block.ids) for block in blocks] == [min(3, len(sizes) - first) for first in range(0, len(sizes), 3)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: no column scan_id; the first line must name scan_id, bssid, rssi_dbm"),
        ("x" * 200_000, "line 1: no column scan_id"),
        ("scan_id,bssid,loudness\na,x,-50\n", "line 1: no column rssi_dbm"),
        (
            HEAD + "a,x,-50\nb,x,-50\na,y,-50\n",
            "line 4: scan a appears again after another scan; the readings of a scan must",
        ),
    ],
)
def test_files_that_are_no_scans_are_told(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(DatasetError, match=message):
        read(written(tmp_path / "scans.csv", text))


def test_other_known_names_are_read_if_there_are_no_times(tmp_path: Path) -> None:
    path = written(tmp_path / "scans.csv", "scan,MAC,rss\na,X,-50\nb,Y,-60\n")
    assert is_scan_file(path)
    assert read(path) == ({"a": {"x": -50.0}, "b": {"y": -60.0}}, {})
    assert not is_scan_file(written(tmp_path / "timed.csv", "scan,time,MAC,rss\na,1700000000,X,-50\n"))


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.csv", tmp_path):
        with pytest.raises(DatasetError, match="cannot be read"):
            read(path)


def test_no_line_is_no_scan(tmp_path: Path) -> None:
    assert read(written(tmp_path / "scans.csv", HEAD)) == ({}, {})
    assert read(written(tmp_path / "scans.jsonl", "")) == ({}, {})


def test_walks_and_times_are_read_and_walks_stay_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scan_file, "SCANS_AT_ONCE", 2)
    walks = ["w"] * 3 + ["v", "", ""]
    table = "scan_id,bssid,rssi_dbm,time_ns,session\n" + "".join(
        f"{number},x,-50,{number * 10},{walk}\n" for number, walk in enumerate(walks)
    )
    lines = "".join(
        json.dumps({"scan_id": number, "bssid": "x", "rssi_dbm": -50, "time_ns": number * 10, "session": walk}) + "\n"
        for number, walk in enumerate(walks)
    )
    for path in (written(tmp_path / "a.csv", table), written(tmp_path / "a.jsonl", lines)):
        blocks = list(scan_blocks(path, BadLines(path.name), str))
        assert [block.scans.session.tolist() for block in blocks] == [["w"] * 3, ["v", ""], [""]]
        assert [block.scans.time_ns.tolist() for block in blocks] == [[0, 10, 20], [30, 0], [0]]


def test_scans_whose_time_is_none_stand_alone(tmp_path: Path) -> None:
    text = "scan_id,bssid,rssi_dbm,time_ns,session\na,x,-50,soon,w\nb,x,-50,,w\nc,x,-50,1e9,w\nd,x,-50,-5,w\n"
    bad = BadLines("scans.csv")
    (block,) = scan_blocks(written(tmp_path / "scans.csv", text), bad, str)
    assert block.scans.session.tolist() == ["", "", "", "w"]
    assert {finding.kind: finding.lines for finding in bad.findings()} == {scan_file.UNTIMED: (2, 4)}
