"""Trace files of the Indoor Location Competition 2.0 and their traps."""

from __future__ import annotations

import re

import pytest

from vislam2tag.sessions.tables.ilc20_trace import Ilc20Trace, parse_trace

T = 1574149352000
MS = 1_000_000


def trace(*records: str, end: str = "\n") -> Ilc20Trace:
    site = "#\tSiteID:5d\tSiteName:杭州\tFloorId:5e\tFloorName:F4\n"
    head = f"#\tstartTime:{T}\n{site}#\tBrand:OPPO\tModel:PBCM10\n"
    return parse_trace((head + "\n".join(records) + end).encode(), "a.txt")


def wifi(at_ms: int, seen_ms: int | str, bssid: str = "04:40:a9:a1:6b:73", rssi: str = "-43", ssid: str = "JOY") -> str:
    seen = seen_ms if isinstance(seen_ms, str) else T + seen_ms
    return f"{T + at_ms}\tTYPE_WIFI\t{ssid}\t{bssid}\t{rssi}\t2437\t{seen}"


def waypoint(at_ms: int, x: float, y: float) -> str:
    return f"{T + at_ms}\tTYPE_WAYPOINT\t{x}\t{y}"


def kinds(found: Ilc20Trace) -> dict[str, tuple[int, ...]]:
    return {finding.kind: finding.lines for finding in found.findings}


def test_records_of_each_type() -> None:
    found = trace(
        waypoint(0, 1.5, 2.5), wifi(900, 300), f"{T + 950}\tTYPE_ACCELEROMETER\t1\t2\t3\t3", waypoint(1000, 3, 4)
    )
    assert found.header == {"SiteName": "杭州", "FloorName": "F4", "Brand": "OPPO", "Model": "PBCM10"}
    assert found.taps.time_ns.tolist() == [T * MS, (T + 1000) * MS]
    assert found.taps.position_bcs.tolist() == [[1.5, 2.5], [3, 4]]
    row = found.wifi.row(0, named=True)
    assert (row["bssid"], row["ssid"], row["rssi_dbm"], row["frequency_mhz"]) == ("04:40:a9:a1:6b:73", "JOY", -43, 2437)
    assert found.sensors.select("time_ns", "sensor", "v1", "v2", "v3", "v4", "repeated").rows() == [
        ((T + 950) * MS, "ACC", 1.0, 2.0, 3.0, 0.0, False)
    ]
    assert (found.first_ns, found.last_ns) == (T * MS, (T + 1000) * MS)
    assert not found.findings


def test_a_result_has_the_time_when_it_was_received_not_logged() -> None:
    found = trace(wifi(9000, 2500), wifi(9000, 8999, bssid="04:40:a9:a1:6b:74"))
    assert found.wifi["time_ns"].to_list() == [(T + 2500) * MS, (T + 8999) * MS]
    assert found.wifi["scan"].to_list() == [1, 1]


@pytest.mark.parametrize("seen", ["0", str(T + 9500), str(T - 700_000), ""])
def test_a_lastseen_on_another_clock_is_a_finding(seen: str) -> None:
    found = trace(waypoint(0, 1, 2), wifi(9000, seen))
    assert found.wifi["time_ns"].to_list() == [(T + 9000) * MS]
    assert kinds(found) == {"unusable_lastseen": (5,)}


def test_a_reading_that_several_scans_report_counts_once_though_its_time_jitters() -> None:
    found = trace(wifi(2000, 1500), wifi(4000, 1501), wifi(6000, 1499), wifi(8000, 7000))
    assert found.wifi.sort("time_ns")["repeated"].to_list() == [False, True, True, False]
    assert found.wifi["scan"].to_list() == [1, 2, 3, 4]


@pytest.mark.parametrize("before", ["", "x\ty\n"])
def test_records_that_a_missing_newline_joined_are_taken_apart(before: str) -> None:
    records = (f"{T + 5}\tTYPE_GYROSCOPE\t1\t2\t3\t3", wifi(900, 300), waypoint(1000, 3, 4), wifi(2000, 1900))
    apart = trace(*records)
    joined = trace(before + records[0] + records[1], records[2] + records[3])
    assert joined.wifi.drop("row").equals(apart.wifi.drop("row"))
    assert joined.taps.position_bcs.tolist() == apart.taps.position_bcs.tolist()
    first = 5 if before else 4
    assert kinds(joined)["joined_records"] == (first, first + 1)
    assert kinds(joined).get("malformed_lines") == ((4,) if before else None)


def test_names_may_hold_anything_but_a_tab() -> None:
    names = ['"quoted', "思达数学", "", "#hash", "a;b,c", "\ufffd"]
    found = trace(*(wifi(900 + n, 300, bssid=f"04:40:a9:a1:6b:0{n}", ssid=name) for n, name in enumerate(names)))
    assert found.wifi["ssid"].to_list() == names
    assert not found.findings


def test_lines_that_are_no_records_are_counted() -> None:
    found = trace(
        "",
        wifi(900, 300, rssi="loud"),
        f"{T}\tTYPE_WAYPOINT\t1\n",
        "one two",
        "x\tTYPE_WIFI",
        f"{T}\tTYPE_UNHEARD_OF\t1",
        wifi(901, 300),
    )
    assert kinds(found) == {"malformed_lines": (5, 6, 8, 9)}
    assert found.wifi.height == 1


def test_a_cut_last_line_and_windows_lines() -> None:
    text = "\r\n".join((waypoint(0, 1, 2), wifi(900, 300), f"{T + 1000}\tTYPE_WAYPO"))
    found = parse_trace(text.encode(), "a.txt")
    assert found.wifi["time_ns"].to_list() == [(T + 300) * MS]
    assert not kinds(found)  # a type that is not known, not a broken record
    assert kinds(trace(waypoint(0, 1, 2), f"{T + 1000}\tTYPE_WAYPOINT\t1.2", end="")) == {"partial_last_line": (5,)}


def test_an_advertisement_that_is_logged_twice_counts_once_with_its_beacons_name() -> None:
    mac, uuid = "DC:0D:30:4E:B8:72", "FDA50693-A4E2-4FB1-AFCF-C6EB07647825"
    found = trace(
        f"{T + 5}\tTYPE_BLUE\t\t{mac}\t-81",
        f"{T + 6}\tTYPE_BEACON\t{uuid}\t10065\t26049\t-58\t-81\t11.9\t{mac}\t{T + 6}",
        f"{T + 7}\tTYPE_BLUE\tTV\t00:00:00:00:00:01\t-60",
        f"{T + 500}\tTYPE_BLUE\t\t{mac}\t-82",
    )
    assert found.ble.select("address", "name", "uuid", "major", "minor", "rssi_dbm", "repeated").rows() == [
        (mac.lower(), "", uuid.lower(), 10065, 26049, -81.0, False),
        ("00:00:00:00:00:01", "TV", None, None, None, -60.0, False),
        (mac.lower(), "", uuid.lower(), 10065, 26049, -82.0, False),
    ]


def test_a_level_that_no_radio_measures_is_null() -> None:
    assert trace(wifi(900, 300, rssi="127")).wifi["rssi_dbm"].to_list() == [None]


@pytest.mark.parametrize("data", [b"", b"\n", b"\xff\xfe\x00", b"\tTYPE_WIFI", b"1\tTYPE_"])
def test_nothing_breaks_it(data: bytes) -> None:
    found = parse_trace(data, "a.txt")
    assert len(found.taps.time_ns) == found.wifi.height == found.ble.height == 0
    assert re.match(r"\(.*\)", str(found.findings))
