"""Small made-up walks along a corridor, each showing one defect of the published program."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from data_sets import Walk

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.similarity import as_complex, as_points
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.evaluation.truth import Truth

CAMERA_HEIGHT_M = 1.4
SIGHT_M = 3.0
"""Landmarks are logged from this distance along the corridor on."""
TURN = np.exp(0.7j)
"""Heading of the tracker's frame against the corridor."""


def crafted_walks() -> Iterator[Walk]:
    """Make one walk for each defect."""
    yield bent_track()
    yield there_and_back()
    yield lost_on_approach()


def bent_track() -> Walk:
    """Four landmarks 0.3 m to either side of the line walked; the track bends by 0.5 m and swaps their sides.

    The covariance between logged and surveyed positions has a negative determinant: it is reflected.
    """
    x = np.arange(0.0, 40.0, 0.04)
    stations = {"1": (5.0, 0.3), "2": (15.0, -0.3), "3": (25.0, 0.3), "4": (35.0, -0.3)}
    logged = {name: np.tile([at, side + _bend(at)], (len(x), 1)) for name, (at, side) in stations.items()}
    return _walk("bent_track", x, stations, logged, sideways=_bend(x), rate_hz=30.0)


def _bend(x: FloatArray | float) -> FloatArray:
    return np.asarray(-0.5 * np.sin(np.pi * np.asarray(x) / 10))


def there_and_back() -> Walk:
    """Two poses a second: landmark 2 is near for one frame only on the way there, for two on the way back."""
    x = np.concatenate((np.arange(0.0, 39.0, 0.8), np.arange(38.9, 0.0, -0.7)))
    stations = {"1": (4.9, 0.3), "2": (15.2, 0.85), "3": (25.1, -0.3), "4": (35.0, 0.3)}
    logged = {name: np.tile(station, (len(x), 1)) for name, station in stations.items()}
    # The tracker's scale is 5 % short from landmark 2 on, until it is back there.
    late = np.arange(len(x)) >= np.flatnonzero(x > 15.2)[0]
    late[np.flatnonzero(x > 15.2)[-1] :] = False
    for position in logged.values():
        position[late, 0] += 0.05 * (15.2 - position[late, 0])
    forward = np.where(late, 0.05 * (15.2 - x), 0.0)
    return _walk("there_and_back", x, stations, logged, forward=forward, rate_hz=2.0)


def lost_on_approach() -> Walk:
    """The tracker corrects landmark 2 by 0.8 m at the last frame before it loses tracking, still nearing it."""
    x = np.arange(0.0, 40.0, 0.04)
    stations = {"1": (5.0, 0.3), "2": (15.0, -0.3), "3": (25.0, 0.3), "4": (35.0, -0.3)}
    logged = {name: np.tile(station, (len(x), 1)) for name, station in stations.items()}
    lost = (x > 14.6) & (x < 17.5)
    logged["2"][: np.flatnonzero(lost)[0] - 1, 1] += 0.8
    return _walk("lost_on_approach", x, stations, logged, lost=lost, rate_hz=30.0)


def _walk(
    name: str,
    x: FloatArray,
    stations: dict[str, tuple[float, float]],
    logged: dict[str, FloatArray],
    *,
    rate_hz: float,
    forward: FloatArray | float = 0.0,
    sideways: FloatArray | float = 0.0,
    lost: BoolArray | None = None,
) -> Walk:
    """Walk along y = 0 through ``x`` (n,), with the tracker's error at each frame; ``logged`` (n, 2) in BCS."""
    n = len(x)
    time_ns = 10**12 + np.arange(n, dtype=np.int64) * round(1e9 / rate_hz)
    believed = np.column_stack((x + forward, np.broadcast_to(sideways, n)))
    camera = CameraTrack(time_ns, _to_acs(believed), _upright(n), np.zeros(n, dtype=np.int8))
    gone = np.zeros(n, dtype=bool) if lost is None else lost
    truth = Truth(time_ns, np.column_stack((x, np.zeros(n))))
    return Walk(name, camera, _log(camera, x, logged, gone), _landmarks(stations), truth)


def _log(camera: CameraTrack, x: FloatArray, logged: dict[str, FloatArray], lost: BoolArray) -> LandmarkLog:
    """Log each landmark from its first sighting on, with the camera's position where tracking is lost."""
    known = [np.arange(np.argmax(np.abs(x - position[:, 0]) < SIGHT_M), len(x)) for position in logged.values()]
    frame = np.concatenate(known)
    position = np.concatenate([_to_acs(p)[rows] for p, rows in zip(logged.values(), known, strict=True)])
    return LandmarkLog(
        ids=tuple(logged),
        landmark=np.repeat(np.arange(len(logged)), [len(rows) for rows in known]),
        frame=frame,
        position_acs=np.where(lost[frame, None], camera.position_acs[frame], position),
        orientation_acs=_upright(len(frame)),
        lost=lost[frame],
    )


def _to_acs(plane: FloatArray) -> FloatArray:
    turned = as_points(as_complex(plane) * TURN)
    return np.column_stack((turned[:, 0], np.full(len(plane), CAMERA_HEIGHT_M), -turned[:, 1]))


def _upright(n: int) -> FloatArray:
    return np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))


def _landmarks(stations: dict[str, tuple[float, float]]) -> Landmarks:
    unknown = np.full(len(stations), np.nan)
    return Landmarks(
        ids=tuple(stations),
        floor=np.zeros(len(stations), dtype=np.int64),
        position_bcs=np.array(list(stations.values())),
        covariance_bcs=np.tile(np.eye(2) * 0.02**2, (len(stations), 1, 1)),
        z_m=unknown,
        heading_rad=unknown,
        heading_sigma_rad=unknown,
    )
