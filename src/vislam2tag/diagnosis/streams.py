"""What a session's streams tell without its geometry: their clocks, their repetitions, the device that they are of."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from vislam2tag.diagnosis.clock_offset import sensor_clock_offset_s
from vislam2tag.diagnosis.wifi_clock import ClockOffset
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import repeated_scans
from vislam2tag.survey.corrections.file import session_start

_EPOCH = datetime(1970, 1, 1)


@dataclass(frozen=True)
class StreamSigns:
    """``switched_on_s``: when the phone was started, Unix seconds of its own wall clock, None where the session's name
    is no time; ``scans`` and how many of them repeat the one before; ``sensor_offset_s``: what to add to the times of
    the inertial sensors so that they turn as the poses do, ``wifi`` to those of the scans so that they hear what others
    heard there (:mod:`vislam2tag.diagnosis.wifi_clock`), None where that cannot be told.
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
