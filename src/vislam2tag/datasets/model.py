"""The data set as a value: its manifest, its tables (lazy, because they may be larger than memory) and its splits.

Tables are read one session at a time, so memory does not grow with the number of sessions.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, Literal, NamedTuple

import numpy as np
import polars as pl
from polars._typing import PolarsDataType
from pydantic import Field

from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Frames, Tabular, TabularResult
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.notebook import Drawable
from vislam2tag.datasets.description import Funding, Person, Related
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, MEASURED, READINGS, SESSIONS
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.model import ControlPoints, Floor

FORMAT_VERSION = 1


class Storey(NamedTuple):
    """A floor of a building: name of the building (empty if there is only one) and number of the floor."""

    building: str
    floor: int


class RoomInfo(Record):
    """A room or corridor with a name."""

    name: str
    boxes_m: tuple[tuple[float, float, float, float], ...]
    """Rectangles that cover it: x0, y0, x1, y1, BCS metres."""

    def contains(self, points_m: FloatArray) -> BoolArray:
        """Whether the room contains each point (n, 2), BCS metres."""
        low, high = np.array(self.boxes_m).reshape(-1, 2, 2).transpose(1, 0, 2)
        within: BoolArray = (points_m[:, None] >= low) & (points_m[:, None] < high)
        inside: BoolArray = np.any(np.all(within, axis=2), axis=1)
        return inside


class FloorInfo(Record):
    """One floor. Positions on it are in its BCS."""

    building: str = ""
    number: int
    name: str = ""
    elevation_m: float | None = None
    width_m: float | None = None
    height_m: float | None = None
    plan: str | None = None
    """Image in the data set's folder that covers exactly width x height."""
    lower_left_m: tuple[float, float] = (0.0, 0.0)
    """Lower left corner of the plan, BCS."""
    georeference: Georeference | None = None
    rooms: tuple[RoomInfo, ...] = ()
    """Rooms with a name, by their walkable space."""


class Grouping(Record):
    """How readings of one technology become fingerprints."""

    technology: str
    by: Literal["scan", "window"]
    window_s: float | None = None
    """Length of a window, seconds; None for scans. If scans include BLE: that of the BLE readings around a scan."""


class DatasetSource(Record):
    """Source of a data set: a survey labelled by this program, or files of another format."""

    kind: str
    """``process`` or the name of an import format."""
    name: str
    """Name of the folder or file."""
    version: str
    """Version of this program."""
    settings: dict[str, object] = {}
    inputs: dict[str, str] = {}
    """SHA-256 of each input, or of everything that a session's result depends on."""


class TableAccount(Record):
    """One file of the data set."""

    file: str
    rows: int
    size_bytes: int
    sha256: str


class DatasetInfo(Record):
    """The manifest (``dataset.json``), written last."""

    format_version: int = FORMAT_VERSION
    name: str
    title: str = ""
    description: str = ""
    licence: str | None = None
    """SPDX identifier."""
    creators: tuple[Person, ...] = ()
    keywords: tuple[str, ...] = ()
    version: str | None = None
    """The data set's own version."""
    published: dt.date | None = None
    publisher: str | None = None
    doi: str | None = None
    contact: str | None = None
    """E-mail address or URL."""
    funding: tuple[Funding, ...] = ()
    related: tuple[Related, ...] = ()
    bssid_key: str | None = None
    """Name of the key that identifiers of access points were hashed with (:mod:`.privacy`); None: not hashed."""
    frame: str = "BCS of each floor, metres"
    clock: Literal["boot", "unix", "none"] = "boot"
    """Origin of ``time_ns``: the phone's start, 1970, or none if there are no times."""
    floors: tuple[FloorInfo, ...]
    groupings: tuple[Grouping, ...] = ()
    sources: tuple[DatasetSource, ...] = ()
    findings: tuple[Finding, ...] = ()
    """Findings about the input data."""
    made_by: str = ""
    """The command of this program that wrote it; empty if unknown."""
    tables: dict[str, TableAccount] = Field(default_factory=dict)
    splits: dict[str, TableAccount] = Field(default_factory=dict)


TRAIN, TEST = "train", "test"
"""Names of the parts of a split."""


class Fold(Record):
    """One way to train and test: the groups of the test set; all other groups are the training set."""

    name: str
    test: tuple[str, ...]


class SplitInfo(Record):
    """Parameters and folds of a split (``splits/NAME.json``)."""

    name: str
    kind: str
    """``random``, ``device``, ``trajectory``, ``day``, ``block``, ``floor`` or ``official``."""
    parameters: dict[str, float | int | str] = {}
    folds: tuple[Fold, ...]


@dataclass(frozen=True, repr=False)
class Split(TabularResult):
    """A split: the group of every fingerprint and IMU window, and the test groups of each fold.

    ``groups`` has columns ``id`` (``scan_id`` or ``window_id``) and ``group`` (text; null: in neither part).
    """

    main_table: ClassVar[str] = "groups"

    info: SplitInfo
    groups: pl.DataFrame

    def fold(self, name: str) -> Fold:
        """Return the fold of this name; raises KeyError if there is none."""
        for fold in self.info.folds:
            if fold.name == name:
                return fold
        raise KeyError(name)

    def train_test_ids(self, fold: Fold) -> tuple[pl.Series, pl.Series]:
        """Return the ids of the training set and of the test set."""
        grouped = self.groups.filter(pl.col("group").is_not_null())
        tests = pl.col("group").is_in(fold.test)
        return grouped.filter(~tests)["id"], grouped.filter(tests)["id"]

    def _facts(self) -> dict[str, object]:
        return {"name": self.info.name, "kind": self.info.kind, "folds": len(self.info.folds)}

    def _frames(self) -> Frames:
        return {"groups": lambda: self.groups}


@dataclass(frozen=True, repr=False)
class Dataset(Drawable, Tabular):
    """A data set. ``tables`` are lazy Polars frames by the names of :mod:`vislam2tag.datasets.schema`, each with
    exactly that schema. ``to_frame("readings")`` and ``to_pandas("readings")`` load one."""

    main_table: ClassVar[str] = FINGERPRINTS

    info: DatasetInfo
    tables: Mapping[str, pl.LazyFrame]
    splits: Mapping[str, Split] = field(default_factory=dict)
    files: Mapping[str, AnyPath] = field(default_factory=dict)
    """Further files (plans) by their path in the folder; the values are their present paths."""

    def _facts(self) -> dict[str, object]:
        return {
            "name": self.info.title or self.info.name,
            "floors": len(self.info.floors),
            "tables": ", ".join(sorted(self.tables)),
            "splits": ", ".join(sorted(self.splits)) or "none",
        }

    def _frames(self) -> Frames:
        return {name: partial(_collected, table) for name, table in self.tables.items()}

    @property
    def fingerprints(self) -> pl.LazyFrame:
        """One row for each scan (or window)."""
        return self.tables[FINGERPRINTS]

    @property
    def labelled(self) -> int:
        """Number of fingerprints with a position."""
        return int(self.fingerprints.select(pl.col("x").count()).collect(engine="streaming").item())

    @property
    def measured(self) -> bool:
        """Whether there is any measurement: a reading, a range, or a row of magnetic or inertial data."""
        return any(table in self.tables and self._has_rows(table) for table in MEASURED)

    def _has_rows(self, table: str) -> bool:
        return self.tables[table].head(1).collect(engine="streaming").height > 0

    @property
    def readings(self) -> pl.LazyFrame:
        """One row for each access point heard in a scan."""
        return self.tables[READINGS]

    @property
    def access_points(self) -> pl.LazyFrame:
        """One row for each transmitter."""
        return self.tables[ACCESS_POINTS]

    @property
    def sessions(self) -> pl.LazyFrame:
        """One row for each walk."""
        return self.tables[SESSIONS]

    def site_floor(self, storey: Storey) -> Floor:
        """Return a floor for figures, with its plan if there is one; the manifest need not contain the floor."""
        points = ControlPoints((), np.zeros((0, 2)))
        for floor in self.info.floors:
            if (floor.building, floor.number) == storey:
                plan = path_or_none(self.files.get(floor.plan)) if floor.plan else None
                name = floor.name or f"floor {floor.number}"
                extent = floor.width_m, floor.height_m, floor.elevation_m, plan
                return Floor(floor.number, name, *extent, points, floor.lower_left_m, georeference=floor.georeference)
        return Floor(storey.floor, f"floor {storey.floor}", None, None, None, None, points)


def _collected(table: pl.LazyFrame) -> pl.DataFrame:
    return table.collect(engine="streaming")


_PARTS = 16
"""Number of tables that are added up at once."""


@dataclass
class RunningTotal:
    """A table summed by its keys, part by part; its size grows with the keys, not with the sessions."""

    keys: Sequence[str]
    totals: Sequence[pl.Expr] = ()
    """How the other columns of rows with the same keys are combined; none: there are no others."""
    schema: Mapping[str, PolarsDataType] = field(default_factory=dict)
    """Schema of the empty table."""
    _parts: list[pl.DataFrame] = field(default_factory=list)

    def add(self, part: pl.DataFrame) -> None:
        """Add the rows of one part."""
        self._parts.append(part)
        if len(self._parts) == _PARTS:
            self._parts = [self.table]

    @property
    def table(self) -> pl.DataFrame:
        """The sums so far, in no particular order."""
        if not self._parts:
            return pl.DataFrame(schema=dict(self.schema))
        return pl.concat(self._parts).group_by(self.keys).agg(*self.totals)


@dataclass(frozen=True)
class SessionTables:
    """The fingerprints of one session and their readings, in memory."""

    session: str
    fingerprints: pl.DataFrame
    readings: pl.DataFrame


def each_session(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> Iterator[SessionTables]:
    """Yield the tables session by session, in the order of their names; only one is in memory at a time."""
    sessions = fingerprints.select("session").unique().collect(engine="streaming")["session"].sort()
    for session in sessions:
        yield one_session(fingerprints, readings, session)


def one_session(fingerprints: pl.LazyFrame, readings: pl.LazyFrame, session: str) -> SessionTables:
    """Read the tables of one session.

    Readings are first selected by the range of the session's scan ids, which share their beginning, so that Parquet
    statistics avoid reading the other sessions.
    """
    own = fingerprints.filter(pl.col("session") == session).collect()
    ids = own["scan_id"]
    heard = readings.filter(pl.col("scan_id").is_between(pl.lit(ids.min()), pl.lit(ids.max())))
    return SessionTables(session, own, heard.join(own.lazy().select("scan_id"), on="scan_id", how="semi").collect())


def readings_by_session(
    fingerprints: pl.LazyFrame, readings: pl.LazyFrame, work: Callable[[pl.LazyFrame], pl.LazyFrame]
) -> pl.LazyFrame:
    """Apply ``work`` lazily to the readings of each session, one session after the other.

    For work that needs whole scans, such as grouping, which would need all readings in memory at once.
    """
    parts = [work(own) for _, own in session_readings(fingerprints, readings)]
    return pl.concat(parts) if parts else work(readings)


def session_readings(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> Iterator[tuple[str, pl.LazyFrame]]:
    """Yield each session's name and, lazily, its readings, in the order of the names."""
    ids = pl.col("scan_id")
    ranges = fingerprints.group_by("session").agg(first=ids.min(), last=ids.max()).collect(engine="streaming")
    for session, first, last in ranges.sort("session").iter_rows():
        own = fingerprints.filter(pl.col("session") == session).select("scan_id")
        near = readings.filter(ids.is_between(pl.lit(first), pl.lit(last)))
        yield session, near.join(own, on="scan_id", how="semi", maintain_order="left")
