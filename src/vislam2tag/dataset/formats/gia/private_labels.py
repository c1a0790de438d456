"""Privacy of labelled readings that become no data set (``transmitters.privacy`` is for those that do)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.dataset.fingerprinting.labelled import LabelledSession
from vislam2tag.dataset.transmitters.access_points import NOMAP
from vislam2tag.dataset.transmitters.privacy import NOMAP_LEFT_OUT, Privacy, hashed


@dataclass(frozen=True)
class PrivateLabels:
    """What is left out or hidden of a survey's Wi-Fi readings."""

    privacy: Privacy
    unwanted: frozenset[str]
    """Access points of networks that opted out; one of their names in one session is enough."""
    readings: int
    """Readings of them."""

    @classmethod
    def of(cls, sessions: Iterable[LabelledSession], privacy: Privacy) -> PrivateLabels:
        """Look for networks that opted out."""
        if privacy.include_nomap:
            return cls(privacy, frozenset(), 0)
        counts: dict[str, int] = {}
        unwanted: set[str] = set()
        for session in sessions:
            heard = session.table("wifi", ("bssid", "ssid"))
            found = heard.group_by("bssid").agg(count=pl.len(), nomap=pl.col("ssid").str.contains(NOMAP).any())
            for bssid, count, nomap in found.rows():
                counts[bssid] = counts.get(bssid, 0) + count
                if nomap:
                    unwanted.add(bssid)
        return cls(privacy, frozenset(unwanted), sum(counts[bssid] for bssid in unwanted))

    @property
    def hides(self) -> bool:
        """Whether any reading may differ from what was recorded."""
        return bool(self.unwanted) or self.privacy.hash_key is not None or not self.privacy.keep_ssids

    @property
    def findings(self) -> tuple[Finding, ...]:
        """How much is left out."""
        if not self.unwanted:
            return ()
        message = (
            f"readings of {len(self.unwanted)} networks are left out: their names end in _nomap, by which owners ask "
            "to be in no map"
        )
        return (Finding(kind=NOMAP_LEFT_OUT, file="", count=self.readings, message=message, severity=Severity.INFO),)

    def hidden(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Leave out and hide in a table with ``bssid`` and ``ssid``."""
        rows = rows.filter(~pl.col("bssid").is_in(list(self.unwanted)))
        key = self.privacy.hash_key
        if key is not None:
            codes = {bssid: hashed(bssid, key) for bssid in rows["bssid"].unique()}
            rows = rows.with_columns(pl.col("bssid").replace_strict(codes, return_dtype=pl.String))
        return rows if self.privacy.keep_ssids else rows.with_columns(ssid=pl.lit(""))


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
