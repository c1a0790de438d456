"""Simulated phones, the input of their users, and sessions: everything that a phone logs on a true walk.

Phones differ in radio, locale and clock. Users press a button at control points. Without a tracker they sometimes enter
their position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.simulation.imu import ImuLog
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor, TrackerLog, TrueWalk, position_at
from vislam2tag.simulation.radio import BleLog, PhoneReceiver, RangeLog, WifiLog
from vislam2tag.simulation.settings import Locale, stream
from vislam2tag.simulation.station import TimedPoints


@dataclass(frozen=True)
class DecimalMarks:
    """Decimal mark of the pose files and of the sensor file: ``.`` or ``,``."""

    poses: str = "."
    sensors: str = "."


@dataclass(frozen=True)
class PressTiming:
    """How one person presses: ``lead_s`` before the exact moment on average, with normal scatter ``scatter_s``."""

    lead_s: float = 0.1
    scatter_s: float = 0.35


def simulate_presses(walk: TrueWalk, hand: PressTiming, rng: np.random.Generator) -> IntArray:
    """Return the times (p,) of the presses, boot-clock ns, in order and inside the walk."""
    error_s = rng.normal(-hand.lead_s, hand.scatter_s, len(walk.presses_ns))
    pressed = walk.presses_ns + (error_s * 1e9).astype(np.int64)
    return np.asarray(np.sort(np.clip(pressed, walk.time_ns[0], walk.time_ns[-1])))


DEVICE_NAMES = ("LG", "OnePlus", "Galaxy", "S20")
"""The phones of the published survey; additional phones are Phone5, Phone6, ..."""
_STATION_CLOCK_ERROR_S = 3.0
_OWN_MARKS = {
    "LG": DecimalMarks(",", ","),
    "OnePlus": DecimalMarks(",", "."),
    "Galaxy": DecimalMarks(".", "."),
    "S20": DecimalMarks(",", ","),
}


@dataclass(frozen=True)
class Device:
    """One phone and the person who carries it."""

    marks: DecimalMarks
    receiver: PhoneReceiver
    hand: PressTiming
    station_clock_ns: int
    """The total station's wall clock minus this phone's clock."""


def device_names(count: int) -> tuple[str, ...]:
    """Return the names of the first ``count`` phones."""
    further = (f"Phone{number}" for number in range(len(DEVICE_NAMES) + 1, count + 1))
    return (*DEVICE_NAMES[:count], *further)


def make_device(name: str, locale: Locale, seed: int) -> Device:
    """Draw a phone's constants; ``LG_ref`` and ``LG_tachy`` are the same phone as ``LG``."""
    family = name.split("_")[0]
    rng = stream(seed, "device", family)
    receiver = PhoneReceiver(offset_db=float(rng.normal(0, 3)), sensitivity_dbm=float(rng.uniform(-94, -90)))
    hand = PressTiming(lead_s=float(rng.normal(0.1, 0.1)), scatter_s=float(rng.uniform(0.3, 0.4)))
    clock_ns = int(rng.uniform(-_STATION_CLOCK_ERROR_S, _STATION_CLOCK_ERROR_S) * 1e9)
    marks = {
        Locale.DE: DecimalMarks(",", ","),
        Locale.EN: DecimalMarks(".", "."),
        Locale.MIXED: _OWN_MARKS.get(family, DecimalMarks(".", ".")),
    }[locale]
    return Device(marks, receiver, hand, clock_ns)


FIX_INTERVAL_S = 20.0
FIX_SIGMA_M = 0.4
"""Error of an entered position, per axis: people are never exactly where they say.

Taps of real walks have errors of 0.4 to 0.6 m (docs/results/how-good.md)."""
FIX_DELAY_S = 0.1
"""Delay between reaching a place and entering it."""


def simulate_fixes(walk: TrueWalk, rng: np.random.Generator) -> TimedPoints:
    """Enter the walker's position at the start, every :data:`FIX_INTERVAL_S` and near the end."""
    first, last = int(walk.time_ns[0]) + 200_000_000, int(walk.time_ns[-1]) - 200_000_000
    count = max(round((last - first) * 1e-9 / FIX_INTERVAL_S), 1)
    time_ns = np.linspace(first, last, count + 1).astype(np.int64)
    place = position_at(walk, time_ns - int(FIX_DELAY_S * 1e9))[:, :2]
    return TimedPoints(time_ns, place + rng.normal(0, FIX_SIGMA_M, place.shape))


@dataclass(frozen=True)
class SimulatedSession:
    """The logs of one walk with one device; ``station_offset_ns`` is station wall clock (Unix ns) minus boot clock."""

    building: SimulatedBuilding
    floor: SimulatedFloor
    walk: TrueWalk
    tracker: TrackerLog
    wifi: WifiLog
    imu: ImuLog
    presses_ns: IntArray
    marks: DecimalMarks
    ble: BleLog | None = None
    """None if the phone logs no BLE."""
    ranges: RangeLog | None = None
    """None if the phone measures no ranges to access points."""
    fixes: TimedPoints | None = None
    """Positions in the BCS that the walker enters; None if the phone has a tracker."""
    station: TimedPoints | None = None
    station_offset_ns: int = 0
