"""The annotated tables of giaIndoorLoc's layout, typed, and with the columns that ``process`` writes.

The published files have a blank before text fields; ours do not. Both can be read. :class:`PrivateLabels` applies
privacy options to labels (``privacy`` does so for data sets).
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.datasets.access_points import NOMAP
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.datasets.privacy import NOMAP_LEFT_OUT, Privacy, hashed
from vislam2tag.labeling.tables import SCHEMAS
from vislam2tag.site.model import SessionKey

WIFI_FILE, SENSORS_FILE = "wifi_annotated.csv", "sensors_annotated.csv"
_TEXT, _F64 = pl.String(), pl.Float64()
_PLACE: Mapping[str, pl.DataType] = {"x_coord": _F64, "y_coord": _F64}
ANNOTATED_FILES: Mapping[str, Mapping[str, pl.DataType]] = {
    WIFI_FILE: {
        "id": pl.Int32(),
        "time": pl.Int64(),
        "type": _TEXT,
        "ssid": _TEXT,
        "mac": _TEXT,
        "rss": pl.Float32(),
        **_PLACE,
    },
    SENSORS_FILE: {"time": pl.Int64(), "type": _TEXT, **{f"v{number}": _F64 for number in range(1, 7)}, **_PLACE},
}
"""Columns of each file, in order, and their types."""
_NAME = "ssid"
"""The only column that may contain commas."""
_NEEDED = {WIFI_FILE: ("id", "time", "mac"), SENSORS_FILE: ("time", "type")}
"""Columns that must not be empty."""


def read_annotated(path: Path) -> pl.DataFrame:
    """Read one of :data:`ANNOTATED_FILES`, recognised by its name; fields are stripped, and empty ones are null.

    Raises DatasetError with file and line if it has other columns or a number is invalid.
    """
    columns = ANNOTATED_FILES[path.name]
    lines = _lines(path, columns)
    # A name may contain commas, in quotes or not: fields before it are counted from the start, fields after it from the
    # end.
    pattern = ",".join(f"(?<{name}>{'.*' if name == _NAME else '[^,]*'})" for name in columns)
    fields = lines.with_columns(pl.col("line").str.extract_groups(f"^{pattern}$")).unnest("line")
    _refuse_other_widths(path, lines, fields, len(columns))
    others = [name for name in columns if name != _NAME]
    texts = fields.with_columns(
        *([_network_name()] if _NAME in columns else []), pl.col(others).str.strip_chars().replace("", None)
    )
    table = texts.with_columns(_typed(name, kind) for name, kind in columns.items())
    _refuse_no_numbers(path, texts, table)
    return table.drop("row")


def wifi_rows(file: Path, key: SessionKey) -> pl.DataFrame:
    """Read an annotated Wi-Fi table into the columns of ``wifi``; an unlabelled row gets the most likely cause.

    Raises DatasetError as :func:`read_annotated` does.
    """
    table = read_annotated(file)
    rows = table.select(
        pl.int_range(1, pl.len() + 1).alias("row"),
        pl.col("ssid").fill_null(""),
        scan="id",
        time_ns="time",
        bssid="mac",
        rssi_dbm="rss",
        frequency_mhz=pl.lit(None),
        x="x_coord",
        y="y_coord",
    )
    return _labelled(rows, "wifi", "bssid", key)


def sensor_rows(file: Path, key: SessionKey) -> pl.DataFrame:
    """Read an annotated table of sensor readings into the columns of ``sensors``; raises as :func:`read_annotated`."""
    rows = read_annotated(file).rename({"time": "time_ns", "type": "sensor", "x_coord": "x", "y_coord": "y"})
    return _labelled(rows.with_row_index("row", offset=1), "sensors", "sensor", key)


def _lines(path: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    """Return ``row`` (number in the file, from 1) and ``line`` of each line after the header that is not empty."""
    try:
        text = read_bytes(path).removeprefix(codecs.BOM_UTF8).decode("utf-8", errors="replace")
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read ({error.strerror})") from error
    header, *rest = text.replace("\r\n", "\n").split("\n")
    if [name.strip() for name in header.split(",")] != list(columns):
        raise DatasetError(f"{path}: line 1: expected {','.join(columns)}, found {header}")
    lines = pl.DataFrame({"line": rest}, schema={"line": pl.String}).with_row_index("row", offset=2)
    return lines.filter(pl.col("line") != "")


def _refuse_other_widths(path: Path, lines: pl.DataFrame, fields: pl.DataFrame, expected: int) -> None:
    """Raise DatasetError at the first line with another number of fields."""
    wrong = lines.filter(fields["time"].is_null())
    if wrong.height:
        row, line = wrong.row(0)
        raise DatasetError(f"{path}: line {row}: expected {expected} fields, found {line.count(',') + 1}")


def _typed(name: str, kind: pl.DataType) -> pl.Expr:
    if name == "time":  # some programs write nanoseconds as 4.1e13
        whole, real = (pl.col(name).cast(one, strict=False) for one in (pl.Int64, pl.Float64))
        return whole.fill_null(real.round().cast(pl.Int64, strict=False))
    return pl.col(name).cast(kind, strict=False)


def _refuse_no_numbers(path: Path, texts: pl.DataFrame, table: pl.DataFrame) -> None:
    """Raise DatasetError at the first line with an empty required field, or an invalid number."""
    columns = ANNOTATED_FILES[path.name]
    lost = (table[name].is_null() & (texts[name].is_not_null() | (name in _NEEDED[path.name])) for name in columns)
    wrong = texts["row"].filter(reduce(or_, lost))
    if len(wrong):
        numbers = ", ".join(name for name, kind in columns.items() if kind.is_numeric())
        raise DatasetError(f"{path}: line {wrong[0]}: expected {','.join(columns)} with numbers for {numbers}")


def _network_name() -> pl.Expr:
    """Remove quotes around a network's name, and its leading blank if the type has one, too."""
    ssid = pl.col("ssid")
    quoted = ssid.str.strip_prefix(" ")
    inside = quoted.str.strip_prefix('"').str.strip_suffix('"').str.replace_all('""', '"', literal=True)
    bare = pl.when(quoted.str.contains(r'^".*"$')).then(inside).otherwise(ssid)
    return pl.when(pl.col("type").str.starts_with(" ")).then(bare.str.strip_prefix(" ")).otherwise(bare).alias("ssid")


def _labelled(rows: pl.DataFrame, table: str, source: str, key: SessionKey) -> pl.DataFrame:
    """Add what all rows of a session share and a status, and put the columns into the order of a written table.

    Rows with the time of an earlier one of the same ``source`` (a column) are ``duplicate``.
    """
    placed = pl.all_horizontal(pl.col("x", "y").is_finite()).fill_null(value=False)
    known = rows.with_columns(pl.when(placed).then(name).alias(name) for name in ("x", "y"))
    own = {"floor": key.floor, "device": key.device, "session": key.session}
    made = known.with_columns(
        _status(known, source),
        **{name: pl.lit(value) for name, value in own.items()},
        **{name: pl.lit(None) for name in ("z", "sigma")},
    )
    return made.select(pl.col(name).cast(kind) for name, kind in SCHEMAS[table].items())


def _status(rows: pl.DataFrame, source: str) -> pl.Expr:
    """``ok``, ``duplicate`` if an earlier row of the ``source`` has the time, or the row's position in the walk."""
    placed = rows.filter(pl.col("x").is_not_null())["time_ns"]
    first, last = placed.min(), placed.max()
    time_ns = pl.col("time_ns")
    return (
        pl.when(pl.struct(source, "time_ns").is_first_distinct().not_())
        .then(pl.lit("duplicate"))
        .when(pl.col("x").is_not_null())
        .then(pl.lit("ok"))
        .when(pl.lit(first, pl.Int64).is_null())
        .then(pl.lit("no_mapping"))
        .when(time_ns < first)
        .then(pl.lit("before_first_landmark"))
        .when(time_ns > last)
        .then(pl.lit("after_last_landmark"))
        .otherwise(pl.lit("gap"))
        .alias("status")
    )


@dataclass(frozen=True)
class PrivateLabels:
    """Readings to remove or hide in a survey's Wi-Fi tables."""

    privacy: Privacy
    unwanted: frozenset[str]
    """Access points of networks that opted out; one such name in one session is enough."""
    readings: int
    """Number of their readings."""

    @classmethod
    def of(cls, sessions: Iterable[LabelledSession], privacy: Privacy) -> PrivateLabels:
        """Find networks that opted out."""
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
        """Number of removed readings."""
        message = (
            f"readings of {len(self.unwanted)} networks are skipped, because their names end in _nomap: their owners "
            "ask not to be mapped"
        )
        return finding_if(self.readings, NOMAP_LEFT_OUT, message)

    def hidden(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Remove and hide in a table with ``bssid`` and ``ssid``."""
        rows = rows.filter(~pl.col("bssid").is_in(list(self.unwanted)))
        key = self.privacy.hash_key
        if key is not None:
            codes = {bssid: hashed(bssid, key) for bssid in rows["bssid"].unique()}
            rows = rows.with_columns(pl.col("bssid").replace_strict(codes, return_dtype=pl.String))
        return rows if self.privacy.keep_ssids else rows.with_columns(ssid=pl.lit(""))


def hidden_wifi_file(data: bytes, rows: pl.DataFrame) -> bytes:
    """Keep the lines of these rows, with their new bssid and ssid.

    ``rows``: ``row`` (line, from 1), ``bssid``, ``ssid``. Lines that could not be read have no row. They are removed,
    because their content is unknown.
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
    """Put a text into a field, which keeps its leading blank; an unchanged text keeps its bytes."""
    blank = b" " if field.startswith(b" ") else b""
    old = field.removeprefix(blank).decode("utf-8", errors="replace")
    return field if old.strip() == text.strip() else blank + text.encode()
