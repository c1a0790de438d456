"""What a phone saw on a simulated walk, as a script for the app's own core.

docs/reference/phone-scripts.md tells more.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.simulation.phone_log import SLEPT_NS, PhoneLog
from vislam2tag.site.model import SessionKey

_POSE = ("tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw")
_VALUES = tuple(f"v{number}" for number in range(1, 7))
_APPLE = 0x004C
_POWER_AT_1_M = 0xC5
"""-59 dBm as a byte."""


def phone_script(log: PhoneLog, key: SessionKey, boot_unix_ns: int) -> bytes:
    """Text of the script that makes the app's core write the tables of a log."""
    start_ns = log.start_ns
    wall_ms = (start_ns + boot_unix_ns) // 1_000_000
    head = (
        f"set\tsite\tsimulated\nset\tfloor\t{key.floor}\nset\tdevice\t{key.device}\nset\tzone\tUTC\n"
        f"set\tapp_version\tsimulated\nset\tmodel\t{key.device}\nset\tandroid\t11\nset\tapi\t30\nset\tarcore\t1.43.0\n"
        f"clock\t{start_ns}\t{start_ns - SLEPT_NS}\t{wall_ms}\nstart\t{start_ns}\nthrottling\t{start_ns}\toff\n"
    )
    tables = log.tables
    blocks = [
        _frames(tables),
        _sensors(tables["Sensors"]),
        _scans(tables["WiFi"]),
        _beacons(tables["Ble"]),
        _ranges(tables["Rtt"]),
        tables["ControlPoint"].select(now="time_ns", text=_line("press", "time_ns")),
    ]
    calls = pl.concat(blocks).sort("now", maintain_order=True)
    end_ns = max(log.end_ns, int(np.max(calls["now"].to_numpy(), initial=0)))
    return (head + "\n".join(calls["text"]) + f"\nstop\t{end_ns}\n").encode()


def _line(word: str, *columns: str) -> pl.Expr:
    """A line of a call: its word and columns, what is not known left empty."""
    fields = [pl.col(name).cast(pl.String).fill_null("") for name in columns]
    return pl.concat_str(pl.lit(word), *fields, separator="\t")


def _escaped(name: str) -> pl.Expr:
    text = pl.col(name)
    for plain, escape in (("\\", "\\\\"), ("\t", "\\t"), ("\n", "\\n"), ("\r", "\\r")):
        text = text.str.replace_all(plain, escape, literal=True)
    return text


def _joined(lines: pl.DataFrame, by: str) -> pl.DataFrame:
    """Lines ``text`` of each value of a column, in their order, as one."""
    return lines.group_by(by, maintain_order=True).agg(pl.col("text").str.join("\n"))


def _frames(tables: dict[str, pl.DataFrame]) -> pl.DataFrame:
    """Each frame's line, followed by those of its images and anchors."""
    images = tables["LandmarkPose"].with_columns(_escaped("id"))
    image = _line("image", "id", "state", "method", *_POSE, "extent_x_m", "extent_z_m")
    anchor = _line("anchor", "anchor", "state", *_POSE)
    parts = [
        _joined(images.select("time_ns", text=image), "time_ns"),
        _joined(tables["AnchorPose"].select("time_ns", text=anchor), "time_ns"),
    ]
    frame = _line("frame", "logged_ns", "frame_ns", "state", "failure", *_POSE)
    frames = tables["CameraPose"].select("time_ns", now="logged_ns", text=frame)
    for part in parts:
        frames = frames.join(part, on="time_ns", how="left", maintain_order="left", suffix="_more").select(
            "time_ns", "now", text=pl.concat_str("text", "text_more", separator="\n", ignore_nulls=True)
        )
    return frames.select("now", "text")


def _sensors(sensors: pl.DataFrame) -> pl.DataFrame:
    """Readings arrive when they are made; values that a sensor does not give end the line earlier."""
    line = _line("sensor", "time_ns", "sensor", "time_ns", "accuracy", *_VALUES).str.strip_chars_end("\t")
    return sensors.select(now="time_ns", text=line)


def _scans(wifi: pl.DataFrame) -> pl.DataFrame:
    columns = ("bssid", "ssid", "rssi_dbm", "frequency_mhz", "channel_width_mhz", "center_0_mhz", "center_1_mhz")
    readings = wifi.with_columns(_escaped("ssid"), timestamp_us=pl.col("time_ns") // 1000)
    lines = readings.select("received_ns", text=_line("reading", "timestamp_us", *columns))
    scans = _joined(lines, "received_ns").rename({"received_ns": "now"})
    opening = pl.concat_str(pl.lit("scan"), pl.col("now").cast(pl.String), pl.lit("updated"), separator="\t")
    return scans.select("now", text=pl.concat_str(opening, "text", separator="\n"))


def _beacons(ble: pl.DataFrame) -> pl.DataFrame:
    """Advertisements with the manufacturer's data of an iBeacon, as the radio gives them."""
    data = [
        f"0215{uuid.replace('-', '')}{major:04x}{minor:04x}{_POWER_AT_1_M:02x}"
        for uuid, major, minor in ble.select("uuid", "major", "minor").iter_rows()
    ]
    escaped = ble.with_columns(
        _escaped("name"), manufacturer=pl.lit(_APPLE), hex=pl.Series("hex", data, dtype=pl.String)
    )
    columns = ("time_ns", "time_ns", "address", "name", "rssi_dbm", "tx_power_dbm", "manufacturer", "hex")
    return escaped.select(now="time_ns", text=_line("ble", *columns))


def _ranges(ranges: pl.DataFrame) -> pl.DataFrame:
    """Ranges as the platform gives them: whole milliseconds and millimetres."""
    whole = ranges.with_columns(
        (pl.col("range_m", "range_sigma_m").cast(pl.Float64) * 1000).round().cast(pl.Int64),
        kind=pl.when(pl.col("responder") == 1).then(pl.lit("responder")).otherwise(pl.lit("other")),
        timestamp_ms=pl.col("time_ns") // 1_000_000,
    )
    measured = ("range_m", "range_sigma_m", "rssi_dbm", "attempted", "successful")
    return whole.select(now="time_ns", text=_line("range", "time_ns", "timestamp_ms", "bssid", "kind", *measured))
