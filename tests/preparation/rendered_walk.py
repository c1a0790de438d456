"""A walk with a camera through a drawn room whose walls bear tags or sheets: its video, its poses, its truth.

The picture is what a pinhole camera with a rolling shutter sees while it moves: each band of rows at its own moment,
each moment the mean over the exposure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import GreyImage

SIZE_PX, FOCAL_PX = (960, 720), 780.0
LENS_PX = np.array((FOCAL_PX, FOCAL_PX, SIZE_PX[0] / 2, SIZE_PX[1] / 2))
RATE_HZ, SPEED_M_S, HEIGHT_M = 6.0, 1.0, 1.4
READOUT_S, EXPOSURE_S, BANDS, MOMENTS = 0.02, 0.01, 3, 2
ROOM_M = (12.0, 8.0)
_CAMERA = np.diag((1.0, -1.0, -1.0))


@dataclass(frozen=True)
class Poster:
    """A picture on a wall: its centre (x, y) in the BCS at :data:`HEIGHT_M`, and the direction it faces, radians."""

    picture: GreyImage
    centre_m: tuple[float, float]
    faces_rad: float
    paper_m: float
    """Side of the whole square picture."""


@dataclass(frozen=True)
class Walk:
    """``time_s`` (n,); ``position_bcs`` (n, 3) metres; ``heading_rad`` (n,) the direction that the camera looks in."""

    time_s: FloatArray
    position_bcs: FloatArray
    heading_rad: FloatArray

    @classmethod
    def round_the_room(cls, rounds: float = 2.0) -> Walk:
        """Along a rectangle 2 m off the walls, looking ahead, with a sway of hand and step."""
        x, y = ROOM_M[0] - 2, ROOM_M[1] - 2
        corners = np.array(((2, 2), (x, 2), (x, y), (2, y), (2, 2)), np.float64)
        legs = np.hypot(*np.diff(corners, axis=0).T)
        along = np.arange(0, rounds * legs.sum(), SPEED_M_S / RATE_HZ)
        at = np.concatenate(([0.0], np.cumsum(legs)))
        place = np.column_stack([np.interp(along % at[-1], at, corners[:, i]) for i in (0, 1)])
        leg = np.searchsorted(at, along % at[-1], side="right") - 1 + 4 * (along // at[-1])
        turn = np.convolve(np.pad(leg * np.pi / 2, 3, mode="edge"), np.ones(7) / 7, mode="valid")
        time_s = 1000 + along / SPEED_M_S
        sway = 0.03 * np.sin(2 * np.pi * 0.9 * time_s)
        return cls(time_s, np.column_stack((place, HEIGHT_M + sway)), turn + sway)

    def camera(self, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Position (3,) in the BCS and rotation (3, 3), camera (x right, y up, z back) to BCS, at a moment."""
        where = np.array([np.interp(at_s, self.time_s, self.position_bcs[:, i]) for i in range(3)])
        heading = np.interp(at_s, self.time_s, self.heading_rad)
        ahead = np.array((np.cos(heading), np.sin(heading), 0.0))
        up = np.array((0.0, 0.0, 1.0))
        return where, np.column_stack((np.cross(ahead, up), up, -ahead))


def seen(walk: Walk, posters: list[Poster], at_s: float, wall: GreyImage) -> GreyImage:
    """The picture (height, width) that begins at a moment."""
    picture = np.empty_like(wall)
    rows = SIZE_PX[1] // BANDS
    for band in range(BANDS):
        begins = at_s + READOUT_S * band / BANDS
        moments = [begins + EXPOSURE_S * (i / (MOMENTS - 1) - 0.5) for i in range(MOMENTS)]
        exposed = np.mean([_sharp(walk, posters, moment, wall) for moment in moments], axis=0)
        picture[band * rows : (band + 1) * rows] = exposed[band * rows : (band + 1) * rows]
    return picture


def _sharp(walk: Walk, posters: list[Poster], at_s: float, wall: GreyImage) -> GreyImage:
    where, bcs_r_camera = walk.camera(at_s)
    picture = wall.copy()
    for poster in posters:
        out = np.array((np.cos(poster.faces_rad), np.sin(poster.faces_rad), 0.0))
        right = np.array((-np.sin(poster.faces_rad), np.cos(poster.faces_rad), 0.0))  # as one looks at it
        centre, half = np.array((*poster.centre_m, HEIGHT_M)), poster.paper_m / 2
        corners = [
            centre + half * (sx * right + sy * np.array((0, 0, 1))) for sx, sy in ((-1, 1), (1, 1), (1, -1), (-1, -1))
        ]
        in_camera = (np.array(corners) - where) @ bcs_r_camera @ _CAMERA
        if (where - centre) @ out <= 0 or (in_camera[:, 2] < 0.3).any():
            continue
        there = in_camera[:, :2] / in_camera[:, 2:] * FOCAL_PX + LENS_PX[2:]
        if (there.max(axis=0) < 0).any() or (there.min(axis=0) > SIZE_PX).any():
            continue
        side = poster.picture.shape[0]
        here = np.array(((0, 0), (side, 0), (side, side), (0, side)), np.float32)
        shrink = max(1, int(side / max(8.0, np.ptp(there, axis=0).max())))
        small = cv2.resize(poster.picture, (side // shrink, side // shrink), interpolation=cv2.INTER_AREA)
        homography = cv2.getPerspectiveTransform((here / shrink).astype(np.float32), there.astype(np.float32))
        cv2.warpPerspective(small, homography, SIZE_PX, dst=picture, borderMode=cv2.BORDER_TRANSPARENT)
    return picture


def write_video(path: Path, walk: Walk, posters: list[Poster]) -> None:
    rng = np.random.default_rng(1)
    coarse = rng.integers(120, 200, (9, 12)).astype(np.uint8)
    wall = np.asarray(cv2.resize(coarse, SIZE_PX, interpolation=cv2.INTER_CUBIC), np.uint8)
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), RATE_HZ, SIZE_PX, isColor=False)
    assert video.isOpened()
    for at_s in walk.time_s.tolist():
        noisy = seen(walk, posters, at_s, wall) + rng.normal(0, 3, wall.shape)
        video.write(np.clip(noisy, 0, 255).astype(np.uint8))
    video.release()


def tracked(walk: Walk) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) and orientations (n, 4), camera to ACS, as a tracker has them: another origin and direction, and
    drift of half a percent.
    """
    acs_r_bcs = Rotation.from_euler("y", 0.7).as_matrix() @ np.array(((1, 0, 0), (0, 0, 1), (0, -1, 0)), np.float64)
    drift = 1.005
    middles = [walk.camera(float(at)) for at in walk.time_s]
    position = np.array([acs_r_bcs @ (drift * (where - walk.position_bcs[0])) for where, _ in middles])
    turned = Rotation.from_matrix(np.array([acs_r_bcs @ rotation for _, rotation in middles])).as_quat()
    return position, turned


def write_stray_scanner(folder: Path, walk: Walk, posters: list[Poster]) -> None:
    """A folder as Stray Scanner writes it, its accelerations in g."""
    folder.mkdir(parents=True)
    write_video(folder / "rgb.mp4", walk, posters)
    position, orientation = tracked(walk)
    stored = (Rotation.from_quat(orientation) * Rotation.from_quat((1, 0, 0, 0))).as_quat()
    rows = np.column_stack((position, stored))
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for i, (at_s, row) in enumerate(zip(walk.time_s, rows, strict=True)):
        lines.append(f"{at_s:.6f}, {i:06d}, " + ", ".join(f"{number:.8f}" for number in row))
    (folder / "odometry.csv").write_text("\n".join(lines) + "\n")
    f, cx, cy = FOCAL_PX, LENS_PX[2], LENS_PX[3]
    (folder / "camera_matrix.csv").write_text(f"{f}, 0.0, {cx}\n0.0, {f}, {cy}\n0.0, 0.0, 1.0\n")
    phone_q_camera = Rotation.from_euler("z", -90, degrees=True)
    up = (Rotation.from_quat(orientation) * phone_q_camera.inv()).inv().apply((0.0, 1.0, 0.0))
    turning = Rotation.from_quat(orientation)
    rate = (turning[:-1].inv() * turning[1:]).as_rotvec() * RATE_HZ
    rate = phone_q_camera.apply(np.vstack((rate, rate[-1:])))
    imu = ["timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z"]
    for at_s, force, turn in zip(walk.time_s, -up, rate, strict=True):
        imu.append(f"{at_s:.6f}, " + ", ".join(f"{number:.6f}" for number in np.concatenate((force, turn)).tolist()))
    (folder / "imu.csv").write_text("\n".join(imu) + "\n")


def posters_round_the_room(pictures: Mapping[str, GreyImage], paper_m: float) -> dict[str, Poster]:
    """Two posters a wall, facing the room."""
    width, height = ROOM_M
    spots = (
        ((width, 2.2), np.pi), ((width, 5.8), np.pi), ((0.0, 2.2), 0.0), ((0.0, 5.8), 0.0),
        ((2.4, height), -np.pi / 2), ((9.6, height), -np.pi / 2), ((2.4, 0.0), np.pi / 2), ((9.6, 0.0), np.pi / 2),
    )  # fmt: skip
    return {
        name: Poster(picture, centre, faces, paper_m)
        for (name, picture), (centre, faces) in zip(pictures.items(), spots, strict=True)
    }
