"""Small walks and buildings with known properties, for the sensors' tests."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor, TrueWalk

RATE_HZ = 200.0
START_NS = 5_000_000_000_000
NO_INTS = np.empty(0, dtype=np.int64)


def make_floor(number: int = 0, walls: FloatArray | None = None, elevation_m: float = 0.0) -> SimulatedFloor:
    return SimulatedFloor(
        number=number,
        name=f"Floor {number}",
        width_m=40.0,
        height_m=20.0,
        elevation_m=elevation_m,
        walls=np.empty((0, 2, 2)) if walls is None else walls,
        nodes=np.array([[1.0, 5.0], [20.0, 5.0], [20.0, 15.0], [39.0, 5.0]]),
        edges=np.array([[0, 1], [1, 2], [1, 3]]),
        landmark_ids=("9", "10"),
        landmark_position=np.array([[1.0, 6.0, 1.4], [39.0, 4.0, 1.4]]),
        landmark_heading_rad=np.zeros(2),
        control_points=np.array([[10.0, 5.0]]),
    )


def make_test_building(*floors: SimulatedFloor, positions: FloatArray, ap_floor: list[int]) -> SimulatedBuilding:
    count = len(positions)
    return SimulatedBuilding(
        floors=floors,
        ap_floor=np.array(ap_floor),
        ap_position=positions,
        ap_bssid=tuple(f"02:00:00:00:00:{i:02x}" for i in range(count)),
        ap_ssid=tuple("abc"[i % 3] for i in range(count)),
        ap_frequency_mhz=np.array([(2412.0, 2462.0, 5180.0)[i % 3] for i in range(count)]),
        ap_power_dbm=np.full(count, -40.0),
    )


def make_test_walk(duration_s: float = 20.0, speed: float = 1.0, still: bool = False, floor: int = 0) -> TrueWalk:
    """Straight along x at y = 5, bobbing at 2 Hz, the phone turning and nodding; or standing still, tilted."""
    seconds = np.arange(round(duration_s * RATE_HZ) + 1) / RATE_HZ
    moving = 0.0 if still else 1.0
    x = 1.0 + moving * speed * seconds
    z = 1.4 + moving * 0.02 * np.sin(2 * np.pi * 2.0 * seconds)
    yaw = 0.4 + moving * (0.8 * np.sin(0.7 * seconds) + 0.3 * seconds)
    pitch = 1.0 + moving * 0.1 * np.sin(2 * np.pi * 1.0 * seconds)
    orientation = Rotation.from_euler("zx", np.column_stack((yaw, pitch))).as_quat()
    return TrueWalk(
        floor=floor,
        rate_hz=RATE_HZ,
        time_ns=START_NS + (seconds * 1e9).astype(np.int64),
        position=np.column_stack((x, np.full_like(x, 5.0), z)),
        orientation=orientation,
        speed=np.full_like(x, moving * speed),
        presses_ns=START_NS + np.arange(1, 5) * 3_000_000_000,
        pressed_point=np.zeros(4, dtype=np.int64),
        landmarks_passed=NO_INTS,
        blocked_ns=np.empty((0, 2), dtype=np.int64),
    )
