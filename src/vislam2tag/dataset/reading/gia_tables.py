"""The annotated tables of giaIndoorLoc's layout, read into the columns that ``process`` writes.

The published files lead text fields with a blank; ours do not. Both are read.
"""

from __future__ import annotations

import codecs
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.table_files import read_csv
from vislam2tag.labeling.schemas import SCHEMAS
from vislam2tag.survey.model import SessionKey

WIFI_COLUMNS = ("id", "time", "type", "ssid", "mac", "rss", "x_coord", "y_coord")
_VALUES = ("v1", "v2", "v3", "v4", "v5", "v6")
# A name may hold commas, in quotes or not: the fields before it are found from the start, those after it from the end.
_WIFI_LINE = "^" + ",".join(f"(?<{name}>{'.*' if name == 'ssid' else '[^,]*'})" for name in WIFI_COLUMNS) + "$"
SENSOR_COLUMNS = ("time", "type", *_VALUES, "x_coord", "y_coord")


def wifi_rows(file: Path, key: SessionKey) -> pl.DataFrame:
    """Read an annotated Wi-Fi table; an unlabelled row has the likeliest cause.

    Raises DatasetError, naming file and line, where it has other columns or a number is none.
    """
    texts = _texts(file)
    numbers = {
        "scan": pl.col("id").cast(pl.Int32, strict=False),
        "time_ns": pl.col("time")
        .cast(pl.Int64, strict=False)
        .fill_null(pl.col("time").cast(pl.Float64, strict=False).round().cast(pl.Int64, strict=False)),
        "rssi_dbm": pl.col("rss").cast(pl.Float32, strict=False),
        "x": pl.col("x_coord").cast(pl.Float64, strict=False),
        "y": pl.col("y_coord").cast(pl.Float64, strict=False),
    }
    rows = texts.with_columns(**numbers).with_row_index("row", offset=1)
    _refuse_no_numbers(file, rows)
    named = rows.with_columns(bssid=pl.col("mac"), ssid=pl.col("ssid").fill_null(""), frequency_mhz=pl.lit(None))
    return _labelled(named, "wifi", "bssid", key)


def sensor_rows(file: Path, key: SessionKey) -> pl.DataFrame:
    """Read an annotated table of sensor readings; raises DatasetError where it has other columns or no numbers."""
    kinds = {"time": pl.Int64(), "type": pl.String(), **dict.fromkeys((*_VALUES, "x_coord", "y_coord"), pl.Float64())}
    try:
        table = read_csv(file, schema_overrides=kinds)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{file}: cannot be read ({first_line(error)})") from error
    missing = [name for name in SENSOR_COLUMNS if name not in table.columns]
    if missing:
        raise DatasetError(f"{file}: line 1 has no column {missing[0]}; expected {','.join(SENSOR_COLUMNS)}")
    rows = table.with_row_index("row", offset=1).with_columns(
        time_ns=pl.col("time"), sensor=pl.col("type").str.strip_chars(), x=pl.col("x_coord"), y=pl.col("y_coord")
    )
    return _labelled(rows, "sensors", "sensor", key)


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


def _texts(file: Path) -> pl.DataFrame:
    """Read all columns as text, without the blank that leads them in the published files."""
    try:
        text = file.read_bytes().removeprefix(codecs.BOM_UTF8).decode("utf-8", errors="replace")
    except OSError as error:
        raise DatasetError(f"{file}: cannot be read ({error.strerror})") from error
    lines = [line.removesuffix("\r") for line in text.removesuffix("\n").split("\n")]
    if [name.strip() for name in lines[0].split(",")] != list(WIFI_COLUMNS):
        raise DatasetError(f"{file}: line 1: expected {','.join(WIFI_COLUMNS)}")
    fields = pl.Series("line", lines[1:], dtype=pl.String).str.extract_groups(_WIFI_LINE).struct.unnest()
    others = [name for name in WIFI_COLUMNS if name != "ssid"]
    stripped = fields.with_columns(_name(), pl.col(others).str.strip_chars())
    return stripped.with_columns(pl.when(pl.col(name) != "").then(name).alias(name) for name in others)


def _name() -> pl.Expr:
    """Take a network's name out of its quotes, and away the blank that leads it where one leads the type, too."""
    ssid = pl.col("ssid")
    inside = ssid.str.strip_prefix('"').str.strip_suffix('"').str.replace_all('""', '"', literal=True)
    bare = pl.when(ssid.str.contains(r'^".*"$')).then(inside).otherwise(ssid)
    return pl.when(pl.col("type").str.starts_with(" ")).then(bare.str.strip_prefix(" ")).otherwise(bare).alias("ssid")


def _refuse_no_numbers(file: Path, rows: pl.DataFrame) -> None:
    """Raise DatasetError at the first line whose id, time or address is missing, or whose number is none."""
    bad = pl.any_horizontal(pl.col("scan", "time_ns", "mac").is_null())
    for number, text in (("rssi_dbm", "rss"), ("x", "x_coord"), ("y", "y_coord")):
        bad |= pl.col(number).is_null() & pl.col(text).is_not_null()
    wrong = rows.filter(bad)
    if wrong.height:
        raise DatasetError(
            f"{file}: line {wrong['row'][0] + 1}: expected {','.join(WIFI_COLUMNS)} with numbers for id, time, rss and "
            "coordinates"
        )


def _status(rows: pl.DataFrame, source: str) -> pl.Expr:
    """``ok``, ``duplicate`` where an earlier row of the ``source`` has the time, or where in the walk the row lies."""
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
