"""One simulated session before it is written: everything the phone logged, and the walk that was true."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.core.arrays import IntArray
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor, TrackerLog, TrueWalk
from vislam2tag.simulation.sensors.beacons import BleLog
from vislam2tag.simulation.sensors.fixes import SimulatedFixes
from vislam2tag.simulation.sensors.imu import ImuLog
from vislam2tag.simulation.sensors.radio import WifiLog
from vislam2tag.simulation.sensors.ranges import RangeLog
from vislam2tag.simulation.sensors.station import SimulatedStationTrack


@dataclass(frozen=True)
class DecimalMarks:
    """Decimal mark of the pose files and of the sensor file: ``.`` or ``,``."""

    poses: str = "."
    sensors: str = "."


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
    """None where the phone logs no BLE."""
    ranges: RangeLog | None = None
    """None where the phone measures no ranges to access points."""
    fixes: SimulatedFixes | None = None
    """None where the phone has a tracker."""
    station: SimulatedStationTrack | None = None
    station_offset_ns: int = 0
