"""The session: one walk's recordings on one clock, each row knowing the line it came from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import polars as pl

from vislam2tag.common.documentation import page_of
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.tabular import Frames, TabularResult, column_frame, listed_frame
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.site.georeference import from_wgs84
from vislam2tag.site.model import Floor, SessionKey
from vislam2tag.site.site_table import site_finding


@dataclass(frozen=True)
class GeographicFixes:
    """Positions that are placed on the floor once its georeference is known.

    ``time_ns`` (k,) increasing strictly; ``position`` (k, 2) longitude and latitude, degrees; ``floor`` (k,) as the
    log numbers them; ``name`` (k,). ``file`` is where they are.
    """

    file: str
    time_ns: IntArray
    position: FloatArray
    floor: IntArray
    name: tuple[str, ...]

    def on(self, floor: Floor) -> tuple[FixLog | None, list[Finding]]:
        """Place those of one floor; None, with the reason, where it has no georeference."""
        if floor.georeference is None:
            message = (
                f"its positions are in degrees, but floor {floor.number} has no georeference: add [georeference] to "
                f"site.toml ({page_of('how-to/site')})"
            )
            return None, [site_finding("fixes_without_georeference", self.file, message, Severity.ERROR)]
        here = self.floor == floor.number
        names = tuple(name for name, taken in zip(self.name, here.tolist(), strict=True) if taken)
        fixes = FixLog(self.time_ns[here], from_wgs84(self.position[here], floor.georeference), names)
        return fixes, [] if len(names) > 1 else [too_few_fixes(self.file, f"POSI rows of floor {floor.number}")]


def too_few_fixes(file: str, what: str) -> Finding:
    """Report a session of whose places fewer than two are known; ``what`` is how its file says one."""
    message = f"the walk has fewer than two known positions ({what}), so it cannot be placed"
    return site_finding("too_few_fixes", file, message, Severity.ERROR)


@dataclass(frozen=True)
class FileRecord:
    """Account of one raw file: ``lines = rows + unreadable``."""

    name: str
    """File name inside the session folder."""
    role: str
    """poses, landmarks, wifi, sensors, presses, or the stem of another table."""
    size_bytes: int
    sha256: str
    lines: int
    rows: int

    @classmethod
    def of(cls, name: str, role: str, data: bytes, lines: int, rows: int) -> FileRecord:
        """The account of a file with this content."""
        return cls(name, role, len(data), hashlib.sha256(data).hexdigest(), lines, rows)


@dataclass(frozen=True)
class Recording:
    """What a recorder says of its own work (the phone app's format only)."""

    ended: str
    """``stopped``, or what else ended it (docs/reference/phone-format.md); empty where it is not known."""
    events: dict[str, int]
    """Events that the recorder logged, by name."""
    note: str = ""
    """The collector's."""
    unix_ahead_ns: int | None = None
    """How far Unix time is ahead of the session's clock; None if unknown."""

    @property
    def scans_refused(self) -> int:
        """Scans that the platform refused, or that failed."""
        return self.events.get("scan_refused", 0) + self.events.get("scan_failed", 0)


@dataclass(frozen=True)
class Attachment:
    """How surely a companion's table is placed on the walk: sigma of its clock, seconds, and how far from the camera
    its device was carried, metres.
    """

    clock_sigma_s: float
    lever_arm_m: float


@dataclass(frozen=True, repr=False)
class Session(TabularResult):
    """One walk, read whole; raw values, nothing corrected, nothing dropped.

    ``tables`` contains every time-stamped table by name (``wifi``, ``sensors``, ...), rows in file order. Each has
    ``row`` (int64, 1-based line of the raw file), ``time_ns`` (int64) and ``repeated`` (bool: a reading that an earlier
    row already gave), then its own columns:

    * wifi: ``scan`` int32, ``bssid``, ``ssid`` text, ``rssi_dbm``, ``frequency_mhz`` float32 (null: unknown)
    * sensors: ``sensor`` text, ``v1`` .. ``v6`` float64
    * ble, where it was logged: ``address``, ``name``, ``uuid`` text, ``major``, ``minor`` int32 (null: no beacon),
      ``rssi_dbm`` float32
    * rtt, where ranges to access points were measured: ``bssid`` text, ``responder`` bool, ``range_m``,
      ``range_sigma_m``, ``rssi_dbm`` float32, ``attempted``, ``successful`` int32
    """

    main_table: ClassVar[str] = "poses"

    key: SessionKey
    camera: CameraTrack
    landmarks: LandmarkLog
    presses_ns: IntArray
    """Times of control-point presses, boot-clock nanoseconds."""
    tables: dict[str, pl.DataFrame]
    files: tuple[FileRecord, ...]
    findings: tuple[Finding, ...]
    excluded_ns: tuple[tuple[int, int], ...] = ()
    """Time spans (start included, end excluded; boot-clock ns) that ``corrections.toml`` leaves out."""
    recording: Recording | None = None
    """None where the recorder said nothing of itself."""
    geographic_fixes: GeographicFixes | None = None
    """Known positions of a walk without poses, in degrees; None where the log gives metres, or none."""
    attached: Mapping[str, Attachment] = field(default_factory=dict)
    """The tables that a companion recorded, by name."""
    columns: str = ""
    """The content of a ``columns.toml`` that names the columns as they were read; empty for formats without names."""

    def _facts(self) -> dict[str, object]:
        tables = {name: table.height for name, table in self.tables.items()}
        return {
            "session": self.key,
            "poses": len(self.camera.time_ns),
            "sightings": len(self.landmarks.frame),
            **tables,
            "findings": len(self.findings),
        }

    def _frames(self) -> Frames:
        return {
            "poses": self._pose_frame,
            "sightings": self._sighting_frame,
            **{name: partial(_unchanged, table) for name, table in self.tables.items()},
            "findings": partial(listed_frame, self.findings),
        }

    def _pose_frame(self) -> pl.DataFrame:
        """Poses of the camera in the tracker's frame, metres; all of them, whatever their status."""
        camera = self.camera
        return column_frame({"time_ns": camera.time_ns, **_pose_columns(camera.position_acs, camera.orientation_acs)})

    def _sighting_frame(self) -> pl.DataFrame:
        """Sightings of landmarks: their poses in the tracker's frame, metres."""
        log = self.landmarks
        columns = _pose_columns(log.position_acs, log.orientation_acs)
        ids = [log.ids[number] for number in log.landmark.tolist()]
        return column_frame({"time_ns": self.camera.time_ns[log.frame], "id": ids, **columns})


def _pose_columns(position: FloatArray, orientation: FloatArray) -> dict[str, FloatArray]:
    names = ("tx", "ty", "tz"), ("qx", "qy", "qz", "qw")
    return dict(zip((*names[0], *names[1]), (*position.T, *orientation.T), strict=True))


def _unchanged(table: pl.DataFrame) -> pl.DataFrame:
    return table
