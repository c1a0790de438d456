"""The tables of a labelled session: columns, types and units (docs/reference/output.md), made, written, read back.

Their rows are labelled as in the paper (section IV-B, last paragraph). What is too uncertain to count as labelled keeps
its position and its sigma, and says so by its status: text in the tables, codes in arrays.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_parquet
from vislam2tag.common.given_tables import GivenTable, frame_of
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray
from vislam2tag.core.interpolation import Labels, label_by_interpolation, label_by_next_frame
from vislam2tag.core.status import STATUS_LABELS, Status, has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.new_frame import changed_table
from vislam2tag.labeling.settings import LabelRule, LabelSettings, ProcessSettings
from vislam2tag.sessions.given_times import given_times
from vislam2tag.sessions.model import Attachment
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.model import SessionKey

TRAJECTORY = "trajectory"
_TEXT, _I32, _I64, _F32, _F64 = pl.String(), pl.Int32(), pl.Int64(), pl.Float32(), pl.Float64()
KEY: dict[str, pl.DataType] = {"floor": _I32, "device": _TEXT, "session": _TEXT}
_LABEL: dict[str, pl.DataType] = {"x": _F64, "y": _F64, "z": _F64, "sigma": _F64, "status": _TEXT}
SCHEMAS: dict[str, dict[str, pl.DataType]] = {
    TRAJECTORY: {
        **KEY,
        "time_ns": _I64,
        **dict.fromkeys(("x", "y", "z", "qx", "qy", "qz", "qw", "sigma", "cov_xx", "cov_xy", "cov_yy"), _F64),
        "status": _TEXT,
    },
    "wifi": {
        **KEY,
        "row": _I64,
        "scan": _I32,
        "time_ns": _I64,
        "bssid": _TEXT,
        "ssid": _TEXT,
        "rssi_dbm": _F32,
        "frequency_mhz": _F32,
        **_LABEL,
    },
    "sensors": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "sensor": _TEXT,
        **dict.fromkeys(("v1", "v2", "v3", "v4", "v5", "v6"), _F64),
        **_LABEL,
    },
    "ble": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "address": _TEXT,
        "name": _TEXT,
        "uuid": _TEXT,
        "major": _I32,
        "minor": _I32,
        "rssi_dbm": _F32,
        **_LABEL,
    },
    "rtt": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "bssid": _TEXT,
        "responder": pl.Boolean(),
        "range_m": _F32,
        "range_sigma_m": _F32,
        "rssi_dbm": _F32,
        "attempted": _I32,
        "successful": _I32,
        **_LABEL,
    },
}
"""Columns of the tables that sessions have, in order."""
OPTIONAL = ("ble", "rtt")
"""Tables that only those sessions have that logged them."""
UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "sigma": "m",
    "cov_xx": "m^2",
    "cov_xy": "m^2",
    "cov_yy": "m^2",
    **dict.fromkeys(("qx", "qy", "qz", "qw"), "unit quaternion, camera to BCS"),
    "time_ns": "ns since boot of the phone",
    "rssi_dbm": "dBm",
    "frequency_mhz": "MHz",
    "range_m": "m, from the phone to the access point",
    "range_sigma_m": "m, one standard deviation within the burst",
    **dict.fromkeys(("v1", "v2", "v3", "v4", "v5", "v6"), "as Android reports them for the sensor"),
}


STATUS_TYPE = pl.Enum(STATUS_LABELS)
"""Its physical values are the status codes."""
_LABELS = pl.Series(STATUS_LABELS, dtype=pl.String)


def status_text(status: StatusArray) -> pl.Series:
    """Turn status codes (n,) into the text column ``status``."""
    return _LABELS[status].rename("status")


def status_codes(table: pl.DataFrame) -> StatusArray:
    """Status code (n,) of each row of a labelled table, an array of its own."""
    return table["status"].cast(STATUS_TYPE).to_physical().to_numpy().astype(np.int8)


def label_readings(
    table: GivenTable,
    trajectory: Trajectory,
    settings: LabelSettings,
    excluded_ns: Sequence[tuple[int, int]] = (),
    attached: Attachment | None = None,
) -> pl.DataFrame:
    """Add ``x``, ``y``, ``z`` (BCS, metres), ``sigma`` (metres) and ``status`` to a table of readings.

    ``table`` (Polars, pandas or Arrow) has ``time_ns``, and may have ``repeated`` (see
    :class:`~vislam2tag.sessions.model.Session`); rows and their order stay. Raises UsageError without times.
    A reading is ``uncertain`` where its own sigma exceeds the settings' limit. A repeated reading is
    ``duplicate`` and has no position: the first one counts. Readings in an excluded span (start included, end not;
    boot-clock ns) are ``invalid`` and have none either. Readings of a device that was ``attached`` are less sure: by
    the way walked within its clock's sigma, and by how far from the camera it was carried. If the trajectory has
    floors, ``floor`` is added, too.
    """
    table = _readings(table)
    labels = _labels(table, trajectory, settings)
    if attached is not None:
        labels = _less_sure(labels, table["time_ns"].to_numpy(), trajectory, settings.max_gap_s, attached)
    repeated = table["repeated"].to_numpy()
    excluded = _within(table["time_ns"].to_numpy(), excluded_ns)
    position = labels.position_bcs
    position[repeated | excluded] = np.nan
    status = with_uncertain(labels.status, labels.sigma_m, settings.max_sigma_m)
    status[excluded] = Status.INVALID
    status[repeated] = Status.DUPLICATE
    floor = [pl.Series("floor", labels.floor, dtype=pl.Int32)] if len(labels.floor) else []
    return table[[name for name in table.columns if name != "repeated"]].with_columns(
        *floor,
        *(pl.Series(name, values, nan_to_null=True) for name, values in zip("xyz", position.T, strict=True)),
        pl.Series("sigma", labels.sigma_m, nan_to_null=True),
        status_text(status),
    )


def _readings(table: GivenTable) -> pl.DataFrame:
    """A table of readings with ``time_ns``, integers, and ``repeated``."""
    rows = frame_of(table, "table")
    if rows.schema.get("time_ns") != pl.Int64 or rows["time_ns"].has_nulls():
        times = given_times(rows, "table")
        if row := int(times.ns.is_null().arg_max() or 0) + times.ns.is_null().any():
            raise UsageError(f"table, column {times.column}, row {row}: the time is missing; leave the row out")
        rows = rows.with_columns(times.ns)
    if "repeated" not in rows.columns:
        return rows.with_columns(repeated=pl.lit(value=False))
    return rows.with_columns(pl.col("repeated").cast(pl.Boolean).fill_null(value=False))


def walked_within_sigma(
    time_ns: IntArray, trajectory: Trajectory, max_gap_s: float, clock_sigma_s: float
) -> FloatArray:
    """(n,) metres walked while a clock's sigma passes: what a reading's position is off by if its time is.

    ``time_ns`` (n,) on the trajectory's clock; 0 where the way is not known.
    """
    sigma_ns = round(clock_sigma_s * 1e9)
    ends = [label_by_interpolation(time_ns + way * sigma_ns, trajectory, max_gap_s) for way in (-1, 1)]
    way = (ends[1].position_bcs - ends[0].position_bcs)[:, :2]
    return np.asarray(np.nan_to_num(np.linalg.norm(way, axis=1) / 2))


def _less_sure(
    labels: Labels, time_ns: IntArray, trajectory: Trajectory, max_gap_s: float, attached: Attachment
) -> Labels:
    walked_m = walked_within_sigma(time_ns, trajectory, max_gap_s, attached.clock_sigma_s)
    return replace(labels, sigma_m=np.sqrt(labels.sigma_m**2 + walked_m**2 + attached.lever_arm_m**2 / 2))


def with_uncertain(status: StatusArray, sigma_m: FloatArray, max_sigma_m: float) -> StatusArray:
    """Turn ``ok`` into ``uncertain`` where sigma (n,) exceeds ``max_sigma_m``, metres; an unknown sigma (NaN) never."""
    above = (status == Status.OK) & (sigma_m > max_sigma_m)
    marked: StatusArray = np.where(above, np.int8(Status.UNCERTAIN), status).astype(np.int8)
    return marked


def mark_uncertain(trajectory: Trajectory, max_sigma_m: float) -> Trajectory:
    """Mark the frames whose sigma exceeds ``max_sigma_m``, metres (``inf``: none); nothing else changes."""
    return replace(trajectory, status=with_uncertain(trajectory.status, trajectory.sigma_m, max_sigma_m))


def _within(time_ns: IntArray, spans_ns: Sequence[tuple[int, int]]) -> BoolArray:
    """Mask (r,) of the times in one of the spans."""
    inside = np.zeros(len(time_ns), dtype=bool)
    for start_ns, end_ns in spans_ns:
        inside |= (time_ns >= start_ns) & (time_ns < end_ns)
    return inside


def _labels(table: pl.DataFrame, trajectory: Trajectory, settings: LabelSettings) -> Labels:
    time_ns = table["time_ns"].to_numpy()
    if settings.rule is LabelRule.NEXT_FRAME:
        return label_by_next_frame(time_ns, trajectory)
    return label_by_interpolation(time_ns, trajectory, settings.max_gap_s)


@dataclass(frozen=True)
class LabelledWalk:
    """A mapped session whose readings have labels; make it by :meth:`of`.

    ``mapped`` is what the strategy made of it, and ``trajectory`` marks its uncertain frames; ``readings`` has each
    time-stamped table with one row for each raw row that parsed, in file order. All are in the frame that the session
    was mapped in. ``settings`` are those that hold for it.
    """

    key: SessionKey
    mapped: Trajectory
    trajectory: Trajectory
    readings: dict[str, pl.DataFrame]
    settings: LabelSettings
    needs: str
    """What the strategy says that a walk must have had to be mapped."""

    @classmethod
    def of(cls, prepared: PreparedSession, settings: ProcessSettings) -> LabelledWalk:
        """Map a session that was prepared, and label its readings by its trajectory."""
        session = prepared.session
        strategy = strategy_named(settings.strategy, settings.mapping)
        mapped = strategy.map(session.camera, session.landmarks, prepared.landmarks)
        labels = settings.labels.for_session(without_poses=session.camera.without_poses)
        # Readings come first: between a sure and an uncertain frame each one's own sigma decides.
        readings = {
            name: _keyed(
                session.key,
                name,
                label_readings(table, mapped, labels, session.excluded_ns, session.attached.get(name)),
            )
            for name, table in session.tables.items()
        }
        return cls(session.key, mapped, mark_uncertain(mapped, labels.max_sigma_m), readings, labels, strategy.needs)

    def tables(self, frames: Mapping[int, FrameChange]) -> dict[str, pl.DataFrame]:
        """All tables by name, each row in the frame of its own floor; ``frames`` is empty where all share one."""
        tables = {TRAJECTORY: trajectory_table(self.key, self.trajectory), **self.readings}
        if not frames:
            return tables
        return {name: changed_table(table.lazy(), frames).collect() for name, table in tables.items()}


def trajectory_table(key: SessionKey, trajectory: Trajectory) -> pl.DataFrame:
    """One row for each frame, in file order; null where a value is not known. Each row has its frame's floor."""
    mapped = has_position(trajectory.status)[:, None]
    position = np.where(mapped, trajectory.position_bcs, np.nan)
    orientation = np.where(mapped, trajectory.orientation_bcs, np.nan)
    covariance = trajectory.covariance_bcs
    columns = {
        **dict(zip(("x", "y", "z"), position.T, strict=True)),
        **dict(zip(("qx", "qy", "qz", "qw"), orientation.T, strict=True)),
        "sigma": trajectory.sigma_m,
        "cov_xx": covariance[:, 0, 0],
        "cov_xy": covariance[:, 0, 1],
        "cov_yy": covariance[:, 1, 1],
    }
    floor = [pl.Series("floor", trajectory.floor)] if len(trajectory.floor) else []
    frame = pl.DataFrame(
        [
            *floor,
            pl.Series("time_ns", trajectory.time_ns),
            *(pl.Series(name, values, nan_to_null=True, dtype=pl.Float64) for name, values in columns.items()),
            status_text(trajectory.status),
        ]
    )
    return _keyed(key, TRAJECTORY, frame)


def trajectory_of(table: pl.DataFrame) -> Trajectory:
    """Turn a written trajectory table back into arrays (segments and visits are not in it)."""

    def columns(*names: str) -> FloatArray:
        return table.select(names).cast(pl.Float64).fill_null(float("nan")).to_numpy()

    return Trajectory(
        time_ns=table["time_ns"].to_numpy(),
        position_bcs=columns("x", "y", "z"),
        orientation_bcs=columns("qx", "qy", "qz", "qw"),
        covariance_bcs=columns("cov_xx", "cov_xy", "cov_yy")[:, (0, 1, 1, 2)].reshape(-1, 2, 2),
        status=status_codes(table),
        floor=table["floor"].cast(pl.Int64).to_numpy(),
    )


def write_table(table: pl.DataFrame, name: str, strategy: str, folder: Folder, file: str) -> None:
    """Write one Parquet file with metadata that names frame, units, stage and version."""
    metadata = {
        "frame": "BCS of the floor",
        "units": {column: UNITS[column] for column in table.columns if column in UNITS},
        "stage": f"{name}, labelled by {strategy}",
        "version": __version__,
    }
    text = json.dumps(metadata, sort_keys=True)
    write_parquet(table, folder, file, compression="snappy", metadata={"vislam2tag": text})


def _keyed(key: SessionKey, name: str, frame: pl.DataFrame) -> pl.DataFrame:
    """Put floor (the session's own where rows have none), device and session in front, and the columns into order."""
    firsts = [
        (pl.col(column) if column in frame.columns else pl.lit(getattr(key, column))).cast(kind).alias(column)
        for column, kind in KEY.items()
    ]
    others = [column for column in SCHEMAS.get(name, frame.schema) if column not in KEY]
    return frame.select(*firsts, *others)
