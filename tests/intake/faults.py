"""Faults put into the files of a generated survey, each with the kinds of findings, or the error, that name it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray

POSE = slice(-7, None)
"""Columns of a pose in poses.csv and initPoses.csv, the last ones: tx, ty, tz, qx, qy, qz, qw."""
Poses = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Fault:
    """``put`` changes a session's folder; ``kinds`` are findings that name it, ``error`` is in the session's error."""

    put: Callable[[Path], None]
    kinds: frozenset[str] = frozenset()
    error: str = ""


def change_poses(folder: Path, file: str, change: Poses) -> None:
    """Change all poses (n, 7) of a file of the published layout."""
    path = folder / file
    lines = [line.split(";") for line in path.read_text(encoding="utf-8").splitlines()]
    whole = [fields for fields in lines if len(fields) == len(lines[0])]
    comma = any("," in field for field in whole[0])
    poses = np.array([[float(field.replace(",", ".")) for field in fields[POSE]] for fields in whole])
    rows = []
    for fields, pose in zip(whole, change(poses).tolist(), strict=True):
        numbers = "; ".join(f"{value:.6f}" for value in pose)
        rows.append(
            "; ".join([*(field.strip() for field in fields[:-7]), numbers.replace(".", ",") if comma else numbers])
        )
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def inverted(poses: FloatArray) -> FloatArray:
    """World to camera."""
    turn = Rotation.from_quat(poses[:, 3:]).inv()
    return np.column_stack((-turn.apply(poses[:, :3]), turn.as_quat()))


def exchanged(poses: FloatArray) -> FloatArray:
    """y and z exchanged, a reflection of the frame and of the camera."""
    return np.column_stack((poses[:, (0, 2, 1)], -poses[:, (3, 5, 4)], poses[:, 6]))


def left_handed(poses: FloatArray) -> FloatArray:
    """As Unity has them."""
    return poses * (1, 1, -1, -1, -1, 1, 1)


def z_up(poses: FloatArray) -> FloatArray:
    """Of a tracker whose z axis points up, right-handed."""
    quarter = Rotation.from_rotvec((np.pi / 2, 0, 0))
    return np.column_stack((quarter.apply(poses[:, :3]), (quarter * Rotation.from_quat(poses[:, 3:])).as_quat()))


def in_millimetres(poses: FloatArray) -> FloatArray:
    """Lengths in another unit."""
    return np.column_stack((1000 * poses[:, :3], poses[:, 3:]))


def _both(change: Poses) -> Callable[[Path], None]:
    def put(folder: Path) -> None:
        change_poses(folder, "poses.csv", change)
        change_poses(folder, "initPoses.csv", change)

    return put


def _camera(change: Poses) -> Callable[[Path], None]:
    return lambda folder: change_poses(folder, "poses.csv", change)


def change_fields(file: str, column: int, change: Callable[[str], str]) -> Callable[[Path], None]:
    """Change a column of a file of the published layout, counted from either end."""

    def put(folder: Path) -> None:
        lines = []
        for line in (folder / file).read_text(encoding="utf-8").splitlines():
            fields = line.split("; ")
            fields[column] = change(fields[column])
            lines.append("; ".join(fields))
        (folder / file).write_text("\n".join(lines) + "\n", encoding="utf-8")

    return put


def in_unit(ns_per_unit: int) -> Callable[[Path], None]:
    """All times in another unit than nanoseconds (Wi-Fi: microseconds)."""

    def put(folder: Path) -> None:
        for file, column in (("poses.csv", 0), ("initPoses.csv", 1), ("sensors.csv", 0)):
            change_fields(file, column, lambda time: str(int(time) // ns_per_unit))(folder)
        change_fields("wifi.csv", 1, lambda time: str(int(time) * 1000 // ns_per_unit))(folder)

    return put


def _empty(folder: Path) -> None:
    (folder / "poses.csv").write_bytes(b"")


def _damaged(folder: Path) -> None:
    (folder / "poses.csv").write_bytes(b"\0" * (folder / "poses.csv").stat().st_size)


def _planned(folder: Path) -> None:
    """The floor's table says where sheets are planned, and they hang elsewhere."""
    floor = folder.parents[1]
    header, *rows = (floor / "marker_dict.csv").read_text(encoding="utf-8").splitlines()
    at = [(name, f"{float(x) + 1.5:.4f}", y) for name, x, y in (row.split(",") for row in rows)]
    table = [header, *(",".join(row) for row in at)]
    states = ["id,state,source,x,y", *(f"{name},planned,plan,{x},{y}" for name, x, y in at)]
    (floor / "marker_dict.csv").write_text("\n".join(table) + "\n", encoding="utf-8")
    (floor / "landmark_states.csv").write_text("\n".join(states) + "\n", encoding="utf-8")


FAULTS = {
    "empty poses": Fault(_empty, error="no usable camera frame"),
    "damaged poses": Fault(_damaged, error="no usable camera frame"),
    "inverted poses": Fault(_camera(inverted), error="map the world to the camera"),
    "inverted poses and landmarks": Fault(_both(inverted), error="map the world to the camera"),
    "inverted landmarks": Fault(
        lambda at: change_poses(at, "initPoses.csv", inverted), error="when they are first seen"
    ),
    "y and z exchanged": Fault(_both(exchanged), error="y and z are exchanged"),
    "z up": Fault(_both(z_up), error="the z axis points up"),
    "left-handed": Fault(_both(left_handed), error="left-handed"),
    "millimetres": Fault(_both(in_millimetres), error="lengths are in millimetres"),
    "signs lost": Fault(change_fields("wifi.csv", -1, lambda level: level.lstrip("-")), frozenset({"lost_sign"})),
    "masked addresses": Fault(
        change_fields("wifi.csv", -2, lambda _: "02:00:00:00:00:00"), frozenset({"masked_addresses"})
    ),
    "ids shifted by one": Fault(
        change_fields("initPoses.csv", 0, lambda name: str(int(name) + 1)), frozenset({"shifted_ids"})
    ),
    "ids of another kind": Fault(
        change_fields("initPoses.csv", 0, lambda name: f"tag_{name}"), frozenset({"other_ids"})
    ),
    "planned positions": Fault(_planned, frozenset({"planned_landmarks"})),
    "times in ms": Fault(in_unit(10**6), kinds=frozenset({"time_unit"})),
    "times in us": Fault(in_unit(10**3), kinds=frozenset({"time_unit"})),
}
"""By name."""
