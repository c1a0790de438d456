"""Recordings of scanner apps."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray

TIME_S = 500 + np.arange(40) / 10
POSITION = np.column_stack((np.linspace(0, 3, 40), 0.05 * np.sin(TIME_S), -np.linspace(0, 1, 40)))
TURN = Rotation.from_euler("yx", np.column_stack((np.linspace(0, 1.2, 40), 0.1 * np.cos(TIME_S))))
HALF_TURN = Rotation.from_quat((1, 0, 0, 0))
Z_UP = Rotation.from_euler("x", 90, degrees=True)
"""From a frame with y up to one with z up."""


def _lines(path: Path, rows: list[list[str]], separator: str, header: str = "") -> None:
    path.write_text(header + "".join(separator.join(row) + "\n" for row in rows), encoding="utf-8")


def _numbers(values: FloatArray) -> list[str]:
    return [f"{value:.9f}" for value in values.tolist()]


def stray_scanner(folder: Path) -> None:
    quaternion = (TURN * HALF_TURN).as_quat()
    rows = [
        [f"{t:.6f}", f"{i:06d}", *_numbers(POSITION[i]), *_numbers(quaternion[i])]
        for i, t in enumerate(TIME_S.tolist())
    ]
    _lines(folder / "odometry.csv", rows, ", ", "timestamp, frame, x, y, z, qx, qy, qz, qw\n")


def stray_scanner_with_lens(folder: Path) -> None:
    quaternion = (TURN * HALF_TURN).as_quat()
    rows = [
        [f"{t:.6f}", f"{i:06d}", *_numbers(POSITION[i]), *_numbers(quaternion[i]), "800", "800", "480", "360"]
        for i, t in enumerate(TIME_S.tolist())
    ]
    header = "timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy\n"
    _lines(folder / "odometry.csv", rows, ", ", header)


def ios_logger(folder: Path) -> None:
    quaternion = TURN.as_quat()[:, (3, 0, 1, 2)]
    rows = [[f"{t:.6f}", *_numbers(POSITION[i]), *_numbers(quaternion[i])] for i, t in enumerate(TIME_S.tolist())]
    _lines(folder / "ARposes.txt", rows, ",")


def arkit_data_logger(folder: Path) -> None:
    rows = [
        [str(round(t * 1e9)), *_numbers(np.column_stack((TURN[i].as_matrix(), POSITION[i])).ravel())]
        for i, t in enumerate(TIME_S.tolist())
    ]
    _lines(folder / "ARKit_camera_pose.txt", rows, " ", "# Created at Sunday\n")


def scanner_3d_app(folder: Path) -> None:
    for i, t in enumerate(TIME_S.tolist()):
        pose = np.vstack((np.column_stack((TURN[i].as_matrix(), POSITION[i])), (0, 0, 0, 1)))
        values = {
            "time": t,
            "cameraPoseARFrame": pose.ravel().tolist(),
            "intrinsics": [800, 0, 480, 0, 800, 360, 0, 0, 1],
        }
        (folder / f"frame_{i:05d}.json").write_text(json.dumps(values), encoding="utf-8")


def polycam(folder: Path) -> None:
    cameras = folder / "keyframes" / "cameras"
    cameras.mkdir(parents=True)
    for i, t in enumerate(TIME_S.tolist()):
        matrix = np.column_stack((TURN[i].as_matrix(), POSITION[i]))
        values = {f"t_{row}{column}": matrix[row, column] for row in range(3) for column in range(4)}
        lens = {"fx": 800.0, "fy": 800.0, "cx": 480.0, "cy": 360.0}
        record = {"timestamp": round(t * 1e6), **values, **lens}
        (cameras / f"{round(t * 1e6)}.json").write_text(json.dumps(record), encoding="utf-8")


def tum(folder: Path) -> None:
    quaternion = (TURN * HALF_TURN).as_quat()
    rows = [[f"{t:.6f}", *_numbers(POSITION[i]), *_numbers(quaternion[i])] for i, t in enumerate(TIME_S.tolist())]
    _lines(folder / "poses.tum", rows, " ", "# timestamp tx ty tz qx qy qz qw\n")
    (folder / "poses.toml").write_text('camera = "y-down"\nframe = "y-up"\n', encoding="utf-8")


def euroc(folder: Path) -> None:
    position, quaternion = Z_UP.apply(POSITION), (Z_UP * TURN).as_quat()[:, (3, 0, 1, 2)]
    rows = [
        [str(round(t * 1e9)), *_numbers(position[i]), *_numbers(quaternion[i])] for i, t in enumerate(TIME_S.tolist())
    ]
    _lines(folder / "poses_euroc.csv", rows, ",", "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w, q_x, q_y, q_z\n")
    (folder / "poses.toml").write_text('camera = "y-up"\nframe = "z-up"\n', encoding="utf-8")


def mcap(folder: Path) -> None:
    """Foxglove's PoseInFrame in JSON, of a robot's camera."""
    position, quaternion = Z_UP.apply(POSITION), (Z_UP * TURN * HALF_TURN).as_quat()
    with (folder / "poses.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.PoseInFrame", "jsonschema", b"{}")
        channel = writer.register_channel("/camera/pose", "json", schema)
        for i, t in enumerate(TIME_S.tolist()):
            time_ns = round(t * 1e9)
            pose = {
                "position": dict(zip("xyz", position[i].tolist(), strict=True)),
                "orientation": dict(zip("xyzw", quaternion[i].tolist(), strict=True)),
            }
            stamp = {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}
            message = {"timestamp": stamp, "frame_id": "map", "pose": pose}
            writer.add_message(channel, time_ns, json.dumps(message).encode(), time_ns)
        writer.finish()
    (folder / "poses.toml").write_text('camera = "y-down"\nframe = "z-up"\n', encoding="utf-8")


APPS: Mapping[str, tuple[str, Callable[[Path], None]]] = {
    "Stray Scanner": ("stray-scanner", stray_scanner),
    "Stray Scanner, lens of each frame": ("stray-scanner", stray_scanner_with_lens),
    "ios_logger": ("ios-logger", ios_logger),
    "ARKit Data Logger": ("arkit-data-logger", arkit_data_logger),
    "3D Scanner App": ("scanner-3d-app", scanner_3d_app),
    "Polycam": ("polycam", polycam),
    "TUM": ("tum", tum),
    "EuRoC": ("tum", euroc),
    "MCAP": ("mcap", mcap),
}
"""By name, the format that recognises it and its writer."""
