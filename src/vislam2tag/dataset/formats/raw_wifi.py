"""A raw Wi-Fi file with readings left out or hidden, otherwise as it was recorded."""

from __future__ import annotations

import polars as pl


def hidden_wifi_file(data: bytes, rows: pl.DataFrame) -> bytes:
    """Keep the lines of these rows, with the bssid and ssid that they have now.

    ``rows``: ``row`` (line, from 1), ``bssid``, ``ssid``. Lines that could not be read have no row: they go, since
    nobody knows what they tell.
    """
    lines = data.split(b"\n")
    kept = [_line(lines[row - 1], bssid, ssid) for row, bssid, ssid in rows.sort("row").iter_rows()]
    return b"".join(line + b"\n" for line in kept)


def _line(line: bytes, bssid: str, ssid: str) -> bytes:
    """Replace the fields of ``scan; t; WLAN; ssid; bssid; rss``: three from the start, two from the end."""
    scan, time, kind, rest = line.split(b";", 3)
    old_ssid, old_bssid, level = rest.rsplit(b";", 2)
    return b";".join((scan, time, kind, _replaced(old_ssid, ssid), _replaced(old_bssid, bssid), level))


def _replaced(field: bytes, text: str) -> bytes:
    """Put a text into a field, which keeps its leading blank; a text that is as it was keeps its bytes."""
    blank = b" " if field.startswith(b" ") else b""
    old = field.removeprefix(blank).decode("utf-8", errors="replace")
    return field if old.strip() == text.strip() else blank + text.encode()
