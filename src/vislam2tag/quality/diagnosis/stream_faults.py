"""Faults of streams, seen without geometry: clocks, repeated scans, sessions in another device's folder.

The clock of the inertial sensors may be off that of the poses by any amount: both see the same turns. The lag of pose
stamps, at most half a second, is another thing (:func:`vislam2tag.core.clocks.estimate_pose_lag`).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime

import numpy as np
import polars as pl

from vislam2tag.common.findings import FaultKind, counted
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.clocks import best_shift, comparable, resampled
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.core.transforms import turns_rad
from vislam2tag.quality.diagnosis.evidence import listed
from vislam2tag.quality.diagnosis.record import Fault, proposed
from vislam2tag.quality.diagnosis.wifi_clock import ClockOffset
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import readings_of, repeated_scans
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.model import SessionKey

LEAST_CORRELATION = 0.7
"""Below this the two do not describe the same motion: they are of one phone."""
FEWEST_SAMPLES = 200
FASTEST_RAD_PER_S = 20.0


def sensor_clock_offset_s(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """What to add to the sensors' times (a session's table), seconds; None if the turns do not show it."""
    usable = camera.usable
    time_ns, orientation = camera.time_ns[usable], camera.orientation_acs[usable]
    gyro_ns, turning = readings_of(sensors, "GYRO", ("v1", "v2", "v3"))
    if min(len(time_ns), len(gyro_ns)) < FEWEST_SAMPLES or not comparable(time_ns, gyro_ns):
        return None
    frame_speed = turns_rad(orientation) / np.maximum(np.diff(time_ns) * 1e-9, 1e-6)
    seen = resampled(time_ns[1:], _capped(frame_speed))
    felt = resampled(gyro_ns, _capped(np.linalg.norm(turning, axis=1)))
    found = best_shift(seen, felt)
    if not found.is_clear(LEAST_CORRELATION):
        return None
    return found.shift_s + float(time_ns[1] - gyro_ns[0]) * 1e-9


def _capped(speed: FloatArray) -> FloatArray:
    return np.clip(np.nan_to_num(speed), 0.0, FASTEST_RAD_PER_S)


_EPOCH = datetime(1970, 1, 1)


@dataclass(frozen=True)
class StreamSigns:
    """``switched_on_s``: when the phone was started, Unix seconds of its own wall clock, None if the session's name is
    not a time. ``scans`` and how many of them repeat the one before. ``sensor_offset_s``: what to add to the times of
    the inertial sensors so that they turn as the poses do. ``wifi``: the same for the scans, so that they agree with
    those of other walks there (:mod:`vislam2tag.quality.diagnosis.wifi_clock`), None if that cannot be determined.
    """

    switched_on_s: float | None
    scans: int
    repeated: int
    sensor_offset_s: float | None = None
    wifi: ClockOffset | None = None


def stream_signs(session: Session) -> StreamSigns:
    """Look for signs in a session's tables."""
    usable_ns = session.camera.time_ns[session.camera.usable]
    start = session_start(session.key.session)
    switched_on_s = None
    if start is not None and len(usable_ns):
        switched_on_s = (start - _EPOCH).total_seconds() - float(usable_ns[0]) * 1e-9
    wifi = session.tables["wifi"]
    offset_s = sensor_clock_offset_s(session.camera, session.tables["sensors"])
    return StreamSigns(switched_on_s, wifi["scan"].n_unique(), len(repeated_scans(wifi)), offset_s)


SAME_START_S = 120.0
"""Walks of one phone that was not restarted between them agree on when it was started within this."""
OTHER_START_S = 600.0
"""Phones that were started this far apart are distinguished."""
LEAST_OFFSET_S = 0.7
"""Sensors whose clock is off by more than poses are ever stamped late; less is a lag."""
SAME_OFFSET_S = 0.3
"""Walks of one device whose offsets are this alike need one entry."""
SAME_WIFI_S = 2.0
"""... and those of their scans: levels determine them less sharply."""
LEAST_GAIN = 9.0
"""Scans are off by as much as the sensors where that lowers their squared error, in variances, by more than this."""
REPEATED_SHARE, FEWEST_REPEATED = 0.1, 3
"""Repeated scans are a fault from this share on, and so many of them."""


def stream_faults(signs: Mapping[SessionKey, StreamSigns], known: Sequence[Fault] = ()) -> list[Fault]:
    """Name the faults that the streams of all sessions show.

    Scans of a walk that was on another floor than its folder says were compared with those of the wrong one.
    """
    elsewhere = {key for fault in known if fault.kind is FaultKind.WRONG_FLOOR for key in fault.sessions}
    signs = {key: replace(one, wifi=None) if str(key) in elsewhere else one for key, one in signs.items()}
    return [*_repeated_scans(signs), *_other_devices(signs), *_clocks(signs)]


def _repeated_scans(signs: Mapping[SessionKey, StreamSigns]) -> list[Fault]:
    found = []
    for device in sorted({key.device for key in signs}):
        own = {key: one for key, one in signs.items() if key.device == device}
        bad = {key: one for key, one in own.items() if one.repeated >= max(FEWEST_REPEATED, REPEATED_SHARE * one.scans)}
        if not bad:
            continue
        repeated, scans = sum(one.repeated for one in bad.values()), sum(one.scans for one in bad.values())
        found.append(
            Fault(
                kind=FaultKind.REPEATED_SCANS,
                sessions=[str(key) for key in sorted(bad)],
                summary=f"device {device} reported old Wi-Fi scans again as new ones; they are not used. Disable "
                "'Wi-Fi scan throttling' in its developer options",
                evidence=f"{repeated} of {scans} scans in {len(bad)} of its {counted(len(own), 'walk')} repeat the "
                "preceding scan exactly, with all access points and levels",
            )
        )
    return found


def _other_devices(signs: Mapping[SessionKey, StreamSigns]) -> list[Fault]:
    """Walks whose phone was started when another device was, and not when the others of their folder were."""
    started = defaultdict(list)
    for key, one in signs.items():
        if one.switched_on_s is not None:
            started[key.device].append((key, one.switched_on_s))
    found = []
    for device, walks in sorted(started.items()):
        for key, at_s in walks:
            own = [abs(at_s - other_s) for other, other_s in walks if other != key]
            if not own or min(own) < OTHER_START_S:
                continue
            alike = [
                (other, float(np.median([abs(at_s - other_s) for _, other_s in theirs])))
                for other, theirs in sorted(started.items())
                if other != device and min(abs(at_s - other_s) for _, other_s in theirs) < SAME_START_S
            ]
            if len(alike) == 1:
                found.append(_other_device(key, alike[0][0], min(own), alike[0][1]))
    return found


def _other_device(key: SessionKey, other: str, own_s: float, alike_s: float) -> Fault:
    return Fault(
        kind=FaultKind.OTHER_DEVICE,
        floor=key.floor,
        sessions=[str(key)],
        summary=f"session {key} was recorded by {listed([other])}",
        evidence=f"its phone had been started within {alike_s:.0f} s of that of {other}, but {own_s / 3600:.1f} h "
        f"from those of the other walks of {key.device}",
        corrections=[proposed("set_device", **asdict(key), to=other)],
    )


def _clocks(signs: Mapping[SessionKey, StreamSigns]) -> list[Fault]:
    """Streams on another clock than the poses; the poses' own is off where all others are off by as much."""
    sensors = {key: one.sensor_offset_s for key, one in signs.items() if one.sensor_offset_s is not None}
    wifi = {key: one.wifi for key, one in signs.items() if one.wifi is not None}
    camera = {
        key: -sensors[key]
        for key in sensors.keys() & wifi.keys()
        if abs(sensors[key]) > LEAST_OFFSET_S and _as_much_off(wifi[key], sensors[key])
    }
    found = []
    scans = {key: at.offset_s if at.sure else 0.0 for key, at in wifi.items()}
    for table, offsets in (("camera", camera), ("sensors", sensors), ("wifi", scans)):
        known = offsets if table == "camera" else {key: at for key, at in offsets.items() if key not in camera}
        found += _clocks_of(table, known)
    return found


def _as_much_off(wifi: ClockOffset, offset_s: float) -> bool:
    """Whether scans are rather off by this than not at all."""
    gain_s2 = wifi.offset_s**2 - (wifi.offset_s - offset_s) ** 2
    return gain_s2 > LEAST_GAIN * wifi.sigma_s**2


def _clocks_of(table: str, offsets: Mapping[SessionKey, float]) -> list[Fault]:
    """Offsets of one stream: of single walks, or of all walks of a device alike."""
    found = []
    for device in sorted({key.device for key in offsets}):
        own = {key: offset_s for key, offset_s in sorted(offsets.items()) if key.device == device}
        off = {key: offset_s for key, offset_s in own.items() if abs(offset_s) > LEAST_OFFSET_S}
        middle_s = float(np.median(list(off.values()))) if off else 0.0
        same_s = SAME_OFFSET_S if table == "sensors" else SAME_WIFI_S
        if len(off) == len(own) > 1 and all(abs(offset_s - middle_s) < same_s for offset_s in off.values()):
            found.append(_clock(table, f"device {device}", {"device": device}, list(off), middle_s))
        else:
            for key, offset_s in off.items():
                found.append(_clock(table, f"session {key}", asdict(key), [key], offset_s))
    return found


_CLOCKS = {
    "sensors": ("the sensors", "its poses", "the gyroscope agrees with the camera at this offset and at no other"),
    "wifi": ("the Wi-Fi scans", "its poses", "the scans agree with those of other walks at these places"),
    "camera": (
        "the poses",
        "its sensors and scans",
        "the camera turns as the gyroscope does, and the scans agree with those of other walks at these places",
    ),
}
"""Of each stream: whose clock is off, against which, and what shows it."""


def _clock(table: str, whose: str, selectors: dict[str, object], keys: list[SessionKey], offset_s: float) -> Fault:
    size, way = abs(offset_s), "behind" if offset_s > 0 else "ahead of"
    stream, against, told = _CLOCKS[table]
    return Fault(
        kind=FaultKind.CLOCK,
        sessions=[str(key) for key in keys],
        summary=f"the clock of {stream} of {whose} is {size:.1f} s {way} that of {against}",
        evidence=f"shifted by {offset_s:+.2f} s, {told}",
        corrections=[proposed("shift_clock", **selectors, table=table, offset_s=round(offset_s, 2))],
    )
