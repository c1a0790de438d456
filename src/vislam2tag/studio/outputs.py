"""Labels in output folders of ``process``: read when asked for, and kept in memory while they are as they were."""

from __future__ import annotations

import hashlib
import os
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.dataset.label_comparison import settings_of_output
from vislam2tag.dataset.labelled import LabelledSession
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.schemas import SCHEMAS, TRAJECTORY
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.studio.tracks import TABLE_COLUMNS, Track, track_of

LABELS, BEFORE = "labels", "before"
KEPT_BYTES = 400_000_000
"""Of tracks in memory."""
_SCAN_COLUMNS = ("scan", "time_ns", "x", "y", "floor", "status")


@dataclass
class _Kept:
    """What was read of a file, by its folder and session, while the file is as it was; the oldest goes."""

    most_bytes: int
    _items: OrderedDict[tuple[Path, str], tuple[int, Track]] = field(default_factory=OrderedDict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def get(self, key: tuple[Path, str], stamp: int) -> Track | None:
        with self._lock:
            found = self._items.get(key)
            if found is None or found[0] != stamp:
                return None
            self._items.move_to_end(key)
            return found[1]

    def put(self, key: tuple[Path, str], stamp: int, track: Track) -> None:
        with self._lock:
            self._items[key] = stamp, track
            while sum(kept.size_bytes for _, kept in self._items.values()) > self.most_bytes and len(self._items) > 1:
                self._items.popitem(last=False)


_tracks = _Kept(KEPT_BYTES)


@dataclass
class Output:
    """The labels in one folder; ``slugs`` tells under which names a session may lie in it."""

    name: str
    root: Path
    _results: dict[str, tuple[int, SessionResult]] = field(default_factory=dict)

    def stamp(self) -> str:
        """What changes whenever labels do; empty where there are none."""
        try:
            with os.scandir(self.root / RESULTS) as entries:
                found = sorted((entry.name, entry.stat().st_mtime_ns) for entry in entries)
        except OSError:
            return ""
        return hashlib.sha256(repr(found).encode()).hexdigest()[:16]

    def strategy(self) -> str:
        """The strategy that labelled; empty where that is not told."""
        return str(self.settings().get("strategy", ""))

    def settings(self) -> dict[str, object]:
        """Settings that labels follow from; none where they are not told."""
        return settings_of_output(self.root)

    def result(self, slugs: Sequence[str]) -> SessionResult | None:
        """The result under the first of these names that there is one of."""
        for slug in slugs:
            stamp = _stamp(self.root / RESULTS / f"{slug}.json")
            kept = self._results.get(slug)
            if kept is not None and kept[0] == stamp:
                return kept[1]
            result = OutputFolder(self.root).result(slug) if stamp else None
            if result is not None:
                self._results[slug] = stamp, result
                return result
        return None

    def track(self, result: SessionResult) -> Track | None:
        """The frames of a session; None where it has none, or while they are written."""
        stamp = _stamp(self.root / TRAJECTORY / f"{result.slug}.parquet")
        key = (self.root, result.slug)
        track = _tracks.get(key, stamp)
        if track is None and stamp:
            try:
                table = LabelledSession(self.root, result.slug).table(TRAJECTORY, TABLE_COLUMNS)
            except DatasetError:
                return None
            track = track_of(table, start_ns_of(result, table))
            _tracks.put(key, stamp, track)
        return track

    def scans(self, result: SessionResult) -> pl.DataFrame:
        """Wi-Fi scans (t, x, y, floor, access_points, status) of a session that have a position."""
        session = LabelledSession(self.root, result.slug)
        if not session.has("wifi"):
            return pl.DataFrame(schema=SCHEMAS["wifi"]).select(_SCAN_COLUMNS)
        try:
            rows = session.table("wifi", _SCAN_COLUMNS, pl.col("x").is_not_null())
        except DatasetError:
            rows = pl.DataFrame(schema=SCHEMAS["wifi"]).select(_SCAN_COLUMNS)
        return (
            rows.group_by("scan", maintain_order=True)
            .agg(pl.col("time_ns").min(), pl.col("x", "y").mean(), pl.col("floor", "status").first(), pl.len())
            .drop("scan")
        )


def start_ns_of(result: SessionResult, table: pl.DataFrame) -> int:
    """Time of the walk's first frame, from which corrections count.

    The result's is the first that is not left out: where the walk begins with frames that are invalid, a correction may
    leave them out, and the table's first frame counts.
    """
    first = int(table["time_ns"][0]) if len(table) else 0
    return min(first, result.start_ns) if result.start_ns is not None else first


def _stamp(path: Path) -> int:
    """When a file was written; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
