"""Logs of the phone app on a simulated walk, as tables and as a script for the app's own core.

docs/reference/phone-tables.md describes the columns, docs/reference/phone-format.md the script.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.simulation.imu import SENSOR_TYPES, ImuLog
from vislam2tag.simulation.model import MapMotion, SimulatedBuilding, TrackerLog
from vislam2tag.simulation.phones import SimulatedSession
from vislam2tag.simulation.radio import BURST, BleLog, RangeLog, WifiLog
from vislam2tag.simulation.raw_files import chosen
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.tracker import set_anchors
from vislam2tag.site.model import SessionKey

DELIVERY_NS = 100_000_000
"""A scan's results are delivered this long after its last reading."""
SLEPT_NS = 23_100_000_000_000
"""Time for which the phones slept since they were started: boot clock minus monotonic clock."""
EXTENT_M = 0.2
"""Side of the landmarks' images."""
VALUES_OF = {"ACC": 3, "GYRO": 3, "GYRO_UN": 6, "MAG": 3, "MAG_UN": 6, "ROT": 4, "GAME_ROT": 4, "PRESSURE": 1}
"""Number of values of each sensor."""
TRACKING, PAUSED = "TRACKING", "PAUSED"
SEEN, KNOWN = "FULL_TRACKING", "LAST_KNOWN_POSE"
BLE_COLUMNS = ("time_ns", "address", "name", "rssi_dbm", "tx_power_dbm", "uuid", "major", "minor")
RTT_COLUMNS = ("time_ns", "bssid", "responder", "range_m", "range_sigma_m", "rssi_dbm", "attempted", "successful")
REASON = "EXCESSIVE_MOTION"
"""Reason of simulated tracking losses."""


@dataclass(frozen=True)
class PhoneLog:
    """Tables by file name without ``.csv``, with rows in file order, and the first and last time of the walk,
    boot-clock ns.
    """

    tables: dict[str, pl.DataFrame]
    start_ns: int
    end_ns: int


def phone_log(session: SimulatedSession, key: SessionKey, seed: int) -> PhoneLog:
    """Make all tables of a session; raises ValueError if traps have changed its tracker's log."""
    tracker = session.tracker
    if tracker.motion is None:
        raise ValueError("sessions in the phone app's format cannot have traps")
    start_ns, end_ns = int(session.walk.time_ns[0]), int(session.walk.time_ns[-1])
    tables = {
        "CameraPose": _camera(tracker, tracker.motion, monotonic=_images_are_monotonic(key.device)),
        "LandmarkPose": _landmarks(tracker, tracker.motion),
        "AnchorPose": _anchors(tracker, tracker.motion, stream(seed, "anchors", key)),
        "Sensors": _sensors(session.imu),
        "WiFi": _wifi(session.wifi, session.building),
        "Ble": _ble(session.ble),
        "Rtt": _ranges(session.ranges, session.building),
        "ControlPoint": _presses(session.presses_ns),
    }
    return PhoneLog({**tables, "Events": _events(tables["CameraPose"], start_ns, end_ns)}, start_ns, end_ns)


def _images_are_monotonic(device: str) -> bool:
    """Whether a phone stamps images on the monotonic clock; the others use the boot clock."""
    return device.startswith("OnePlus")


def as_float32(values: AnyArray | pl.Series) -> pl.Series:
    """Round values (n,) to float32 as the platform does; null if not finite."""
    return pl.Series(values, dtype=pl.Float32, strict=False).fill_nan(None)


def _pose_columns(position: FloatArray, orientation: FloatArray) -> dict[str, pl.Series]:
    """Columns of positions (n, 3) and quaternions (n, 4)."""
    values = np.column_stack((position, orientation))
    names = ("tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw")
    return {name: as_float32(values[:, column]) for column, name in enumerate(names)}


def _words(mask: BoolArray, yes: str, no: str) -> pl.Series:
    """One of two words by a mask (n,)."""
    return chosen((no, yes), mask.astype(np.int64))


def _camera(tracker: TrackerLog, motion: MapMotion, *, monotonic: bool) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "time_ns": tracker.exposure_ns,
            "logged_ns": tracker.time_ns,
            "frame_ns": tracker.exposure_ns - (SLEPT_NS if monotonic else 0),
            "nano_ns": tracker.time_ns - SLEPT_NS,
            "frame_clock": "monotonic" if monotonic else "boot",
            "part": 0,
            "state": _words(motion.lost, PAUSED, TRACKING),
            "failure": _words(motion.lost, REASON, "NONE"),
            **_pose_columns(tracker.position_acs, tracker.orientation_acs),
        }
    )


def _landmarks(tracker: TrackerLog, motion: MapMotion) -> pl.DataFrame:
    """Rows by frame, with landmarks in the order of their first sighting."""
    log = tracker.landmarks
    order = np.lexsort((log.landmark, log.frame))
    extent = as_float32(np.full(len(order), EXTENT_M))
    frame = log.frame[order]
    return pl.DataFrame(
        {
            "time_ns": tracker.exposure_ns[frame],
            "id": chosen(log.ids, log.landmark[order]),
            "state": _words(motion.lost[frame], PAUSED, TRACKING),
            "method": _words(motion.seen[order], SEEN, KNOWN),
            **_pose_columns(log.position_acs[order], log.orientation_acs[order]),
            "extent_x_m": extent,
            "extent_z_m": extent,
        }
    )


def _anchors(tracker: TrackerLog, motion: MapMotion, rng: np.random.Generator) -> pl.DataFrame:
    log = set_anchors(tracker, motion, rng)
    order = np.lexsort((log.anchor, log.frame))
    frame = log.frame[order]
    return pl.DataFrame(
        {
            "time_ns": tracker.exposure_ns[frame],
            "anchor": log.anchor[order],
            "state": _words(motion.lost[frame], PAUSED, TRACKING),
            **_pose_columns(log.position_acs[order], log.orientation_acs[order]),
        }
    )


def _sensors(imu: ImuLog) -> pl.DataFrame:
    count = np.array([VALUES_OF[name] for name in SENSOR_TYPES])[imu.sensor]
    values = {
        f"v{column + 1}": as_float32(np.where(column < count, imu.values[:, column], np.nan))
        for column in range(imu.values.shape[1])
    }
    sensor = chosen(SENSOR_TYPES, imu.sensor)
    return pl.DataFrame({"time_ns": imu.time_ns, "sensor": sensor, **values, "accuracy": 3})


def _wifi(wifi: WifiLog, building: SimulatedBuilding) -> pl.DataFrame:
    mhz = building.ap_frequency_mhz.astype(np.int64)[wifi.access_point]
    wide = mhz > 5000
    scan = np.unique(wifi.scan, return_inverse=True)[1]
    centre = pl.Series(5210 + 80 * ((mhz - 5170) // 80))
    return pl.DataFrame(
        {
            "time_ns": wifi.time_us * 1000,
            "scan": scan,
            "bssid": chosen(building.ap_bssid, wifi.access_point),
            "ssid": chosen(building.ap_ssid, wifi.access_point).replace("", None),
            "rssi_dbm": wifi.rss_dbm,
            "frequency_mhz": mhz,
            "channel_width_mhz": np.where(wide, 80, 20),
            "center_0_mhz": centre.zip_with(pl.Series(wide), pl.Series([None], dtype=pl.Int64)),
            "center_1_mhz": None,
            "received_ns": wifi.scan_end_us * 1000 + DELIVERY_NS,
            "result": "fresh",
            "throttling": "off",
        }
    )


def _ble(ble: BleLog | None) -> pl.DataFrame:
    if ble is None:
        texts = ("address", "name", "uuid")
        return pl.DataFrame(schema={name: pl.String if name in texts else pl.Int64 for name in BLE_COLUMNS})
    building, beacons = ble.beacons.environment.building, ble.beacons
    return pl.DataFrame(
        {
            "time_ns": ble.time_ns,
            "address": chosen(building.ap_bssid, ble.beacon),
            "name": chosen(building.ap_ssid, ble.beacon).replace("", None),
            "rssi_dbm": ble.rss_dbm,
            "tx_power_dbm": None,
            "uuid": beacons.uuid,
            "major": beacons.major[ble.beacon],
            "minor": beacons.minor[ble.beacon],
        }
    )


def _ranges(ranges: RangeLog | None, building: SimulatedBuilding) -> pl.DataFrame:
    if ranges is None:
        return pl.DataFrame(schema=dict.fromkeys(RTT_COLUMNS, pl.Int64))
    return pl.DataFrame(
        {
            "time_ns": ranges.time_ms * 1_000_000,
            "bssid": chosen(building.ap_bssid, ranges.access_point),
            "responder": ranges.responder.astype(np.int64),
            "range_m": as_float32(ranges.range_mm / 1000),
            "range_sigma_m": as_float32(ranges.sigma_mm / 1000),
            "rssi_dbm": ranges.rss_dbm,
            "attempted": BURST,
            "successful": ranges.successful,
        }
    )


def _presses(presses_ns: IntArray) -> pl.DataFrame:
    """The table of the presses (p,), boot-clock ns."""
    return pl.DataFrame({"time_ns": presses_ns, "n": np.arange(len(presses_ns)), "action": "press"})


def _events(camera: pl.DataFrame, start_ns: int, end_ns: int) -> pl.DataFrame:
    rows: list[tuple[int, str, str | None]] = [(start_ns, "started", None), (start_ns, "scan_throttling", "off")]
    lost_ns: int | None = None
    for number, (time_ns, clock, state, failure) in enumerate(
        camera.select("time_ns", "frame_clock", "state", "failure").iter_rows()
    ):
        if number == 0:
            rows.append((time_ns, "frame_clock", clock))
        if state == PAUSED and lost_ns is None:
            lost_ns = time_ns
            rows.append((time_ns, "tracking_lost", failure))
        elif state == TRACKING and lost_ns is not None:
            rows.append((time_ns, "tracking_found", f"{(time_ns - lost_ns) / 1e9:.1f}"))
            lost_ns = None
    rows.append((end_ns, "stopped", None))
    return pl.DataFrame(rows, schema={"time_ns": pl.Int64, "event": pl.String, "detail": pl.String}, orient="row")


def session_name(key: SessionKey) -> str:
    """Name of a session's folder: its start without colons."""
    return key.session.replace(":", "")


def phone_text(log: PhoneLog, key: SessionKey, boot_unix_ns: int) -> dict[str, bytes]:
    """Content of each file of a session, by name; ``boot_unix_ns`` is wall clock (Unix ns) minus boot clock."""
    files = {f"{name}.csv": table.write_csv().encode() for name, table in log.tables.items()}
    return {"session.json": _record(log, key, boot_unix_ns), **files}


def _record(log: PhoneLog, key: SessionKey, boot_unix_ns: int) -> bytes:
    used = set(log.tables["Sensors"]["sensor"].unique().to_list())
    content = {
        "format": "vislam2tag-phone",
        "version": 1,
        "session": session_name(key),
        "site": "simulated",
        "floor": key.floor,
        "device": key.device,
        "note": "",
        "app": {"version": f"simulated {__version__}"},
        "phone": {"manufacturer": "", "model": key.device, "android": "11", "api": 30, "arcore": "1.43.0"},
        "start": _clocks(log.start_ns, boot_unix_ns),
        "end": {"state": "stopped", "detail": "", **_clocks(log.end_ns, boot_unix_ns)},
        "sensors": [
            {"sensor": name, "name": name, "vendor": "simulated", "rate_hz": None}
            for name in SENSOR_TYPES
            if name in used
        ],
        "landmarks": {"loaded": log.tables["LandmarkPose"]["id"].n_unique(), "refused": []},
    }
    return (json.dumps(content, indent=2) + "\n").encode()


def _clocks(boot_ns: int, boot_unix_ns: int) -> dict[str, object]:
    wall_ms = (boot_ns + boot_unix_ns) // 1_000_000
    wall = datetime.fromtimestamp(wall_ms / 1000, UTC).isoformat(timespec="milliseconds")
    return {"wall": wall, "wall_ms": wall_ms, "boot_ns": boot_ns, "nano_ns": boot_ns - SLEPT_NS}


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
        _frame_lines(tables),
        _sensor_lines(tables["Sensors"]),
        _scan_lines(tables["WiFi"]),
        _beacon_lines(tables["Ble"]),
        _range_lines(tables["Rtt"]),
        tables["ControlPoint"].select(now="time_ns", text=_line("press", "time_ns")),
    ]
    calls = pl.concat(blocks).sort("now", maintain_order=True)
    end_ns = max(log.end_ns, int(np.max(calls["now"].to_numpy(), initial=0)))
    return (head + "\n".join(calls["text"]) + f"\nstop\t{end_ns}\n").encode()


def _line(word: str, *columns: str) -> pl.Expr:
    """A line of a call: its word and columns; unknown values are empty."""
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


def _frame_lines(tables: dict[str, pl.DataFrame]) -> pl.DataFrame:
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


def _sensor_lines(sensors: pl.DataFrame) -> pl.DataFrame:
    """Readings arrive when they are made; the line ends after the last value of the sensor."""
    line = _line("sensor", "time_ns", "sensor", "time_ns", "accuracy", *_VALUES).str.strip_chars_end("\t")
    return sensors.select(now="time_ns", text=line)


def _scan_lines(wifi: pl.DataFrame) -> pl.DataFrame:
    columns = ("bssid", "ssid", "rssi_dbm", "frequency_mhz", "channel_width_mhz", "center_0_mhz", "center_1_mhz")
    readings = wifi.with_columns(_escaped("ssid"), timestamp_us=pl.col("time_ns") // 1000)
    lines = readings.select("received_ns", text=_line("reading", "timestamp_us", *columns))
    scans = _joined(lines, "received_ns").rename({"received_ns": "now"})
    opening = pl.concat_str(pl.lit("scan"), pl.col("now").cast(pl.String), pl.lit("updated"), separator="\t")
    return scans.select("now", text=pl.concat_str(opening, "text", separator="\n"))


def _beacon_lines(ble: pl.DataFrame) -> pl.DataFrame:
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


def _range_lines(ranges: pl.DataFrame) -> pl.DataFrame:
    """Ranges as the platform gives them: whole milliseconds and millimetres."""
    whole = ranges.with_columns(
        (pl.col("range_m", "range_sigma_m").cast(pl.Float64) * 1000).round().cast(pl.Int64),
        kind=pl.when(pl.col("responder") == 1).then(pl.lit("responder")).otherwise(pl.lit("other")),
        timestamp_ms=pl.col("time_ns") // 1_000_000,
    )
    measured = ("range_m", "range_sigma_m", "rssi_dbm", "attempted", "successful")
    return whole.select(now="time_ns", text=_line("range", "time_ns", "timestamp_ms", "bssid", "kind", *measured))
