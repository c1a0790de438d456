"""Readings of one sensor, or frames, as arrays, with gaps and faults, interpolated rotations and averages over periods.

They give the phone's orientation in a level frame: z up, free heading (docs/reference/datasets.md). The orientation of
that frame in the building follows from the tracker's orientation and the phone's own. The camera's axes are parallel to
the phone's, but the assignment depends on the recorder (ARCore has poses of the camera and of the sensors). It is
determined from gravity and the turns of a walk, seen from both. A session's frames are as the phone's sensors see them:
on the gyroscope's clock, between the faults of the mapping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.clocks import estimate_pose_lag
from vislam2tag.core.status import Status, has_position
from vislam2tag.core.transforms import multiply
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.labeling.tables import status_codes

FINE, SENSOR_GAP, FLOOR_CHANGE, JUMP = 0, 100, 101, 102
"""Codes of faults; other codes are those of :class:`~vislam2tag.core.status.Status`."""


@dataclass(frozen=True)
class SensorSeries:
    """Readings in time order, with unique times and finite values.

    ``time_ns`` (n,), ``values`` (n, k), ``status`` (n,) codes of Status, ``floor`` (n,).
    """

    time_ns: IntArray
    values: FloatArray
    status: AnyArray
    floor: IntArray

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.time_ns)

    def faults(self, max_gap_s: float) -> IntArray:
        """Return for each pair of neighbouring readings (n - 1,) why no window may contain both, or FINE."""
        first, second = self.status[:-1], self.status[1:]
        cause = np.where(has_position(first), second, first).astype(np.int64)
        cause[has_position(first) & has_position(second)] = FINE
        changed = (cause == FINE) & (np.diff(self.floor) != 0)
        cause[changed] = FLOOR_CHANGE
        silent = (cause == FINE) & (np.diff(self.time_ns) > max_gap_s * 1e9)
        cause[silent] = SENSOR_GAP
        return cause


def sensor_series(sensors: pl.DataFrame, name: str, columns: tuple[str, ...]) -> SensorSeries:
    """Read one sensor from a session's ``sensors`` table; repeated and non-finite readings are skipped."""
    finite = pl.all_horizontal(pl.col(columns).is_finite().fill_null(False))
    not_repeated = pl.col("status") != Status.DUPLICATE.label
    rows = sensors.select("sensor", "time_ns", "status", "floor", *columns)
    rows = in_time_order(rows.filter(pl.col("sensor") == name, not_repeated, finite))
    return SensorSeries(
        rows["time_ns"].to_numpy(),
        rows.select(columns).to_numpy(writable=True).reshape(-1, len(columns)),
        status_codes(rows),
        rows["floor"].cast(pl.Int64).to_numpy(),
    )


def in_time_order(rows: pl.DataFrame) -> pl.DataFrame:
    """Sort rows by ``time_ns``; of rows with one time the first is kept. Logs are nearly always in order."""
    step_ns = rows["time_ns"].diff().min()
    if step_ns is None or step_ns > 0:  # type: ignore[operator]
        return rows
    return rows.unique("time_ns", keep="first", maintain_order=True).sort("time_ns")


def first_fault(time_ns: IntArray, faults: IntArray, start_ns: IntArray, end_ns: IntArray) -> IntArray:
    """Return each window's (w,) first fault, from the reading at or before its start to that at or after its end.

    ``faults`` (n - 1,) of the pairs of readings at ``time_ns`` (n,). A window that is not covered by readings is a
    SENSOR_GAP.
    """
    first = np.searchsorted(time_ns, start_ns, side="right") - 1
    last = np.searchsorted(time_ns, end_ns, side="left")
    found = np.where((first < 0) | (last >= len(time_ns)), SENSOR_GAP, FINE)
    places = np.append(np.flatnonzero(faults != FINE), len(time_ns))
    next_one = places[np.searchsorted(places, first)]
    met = next_one < np.minimum(last, len(faults))
    found[met] = faults[next_one[met]]
    return found


class RotationSeries:
    """Rotations at times (n,), strictly increasing, boot-clock ns."""

    def __init__(self, time_ns: IntArray, rotation: Rotation) -> None:
        quaternion = rotation.as_quat()
        # Neighbours are on one side of the sphere, so that interpolation stays between them.
        flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))
        self._quaternion = quaternion * np.concatenate(([1.0], flips))[:, None]
        self._time_ns = time_ns

    def at(self, time_ns: IntArray) -> Rotation:
        """Interpolate at times (k,); constant before the first and after the last.

        Quaternions are blended and normalised. For the few degrees between neighbouring readings this is as good as
        Slerp (for a tenth of a radian: a few millionths).
        """
        since, at = ((times - self._time_ns[0]) * 1e-9 for times in (self._time_ns, time_ns))
        return Rotation.from_quat(np.column_stack([np.interp(at, since, part) for part in self._quaternion.T]))


def period_means(time_ns: IntArray, values: FloatArray, start_ns: IntArray, samples: int, rate_hz: float) -> FloatArray:
    """Mean of a signal over each of ``samples`` periods from each start: (w, samples, k).

    The signal ``values`` (n, k) is linear between its times (n,), strictly increasing; starts (w,).
    """
    edges_s = (start_ns - time_ns[0])[:, None] * 1e-9 + np.arange(samples + 1) / rate_hz
    return np.diff(_integral(((time_ns - time_ns[0]) * 1e-9), values, edges_s), axis=1) * rate_hz


def _integral(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Integral of the piecewise linear signal from its first time to each time (...,): (..., k)."""
    step_s = np.diff(time_s)
    whole = np.cumsum((values[1:] + values[:-1]) / 2 * step_s[:, None], axis=0)
    whole = np.concatenate((np.zeros((1, values.shape[1])), whole))
    before = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, len(step_s) - 1)
    beyond_s = (at_s - time_s[before])[..., None]
    slope = (values[before + 1] - values[before]) / step_s[before][..., None]
    integral: FloatArray = whole[before] + beyond_s * (values[before] + slope * beyond_s / 2)
    return integral


GRAVITY_MEMORY_S = 3.0
"""Standard deviation of the weights by which the filter averages gravity; longer than a stride, shorter than drift."""

_GREATEST_COMPONENT = 2.0
"""Components of a unit quaternion are at most 1; much larger ones are not a rotation."""


LevelOrientation = RotationSeries
"""``level_R_body`` at any time between its readings."""


def logged_orientation(game_rotation: SensorSeries) -> LevelOrientation:
    """Read Android's game rotation vector (``v1`` to ``v4``: x, y, z and w, which is 0 on old phones)."""
    quaternion = game_rotation.values.copy()
    quaternion[~(np.abs(quaternion) <= _GREATEST_COMPONENT).all(axis=1)] = 0.0
    implied = np.sqrt(np.maximum(1 - np.sum(quaternion[:, :3] ** 2, axis=1), 0.0))
    quaternion[:, 3] = np.where(quaternion[:, 3] == 0, implied, quaternion[:, 3])
    turns = np.linalg.norm(quaternion, axis=1) > 0
    quaternion[~turns] = (0.0, 0.0, 0.0, 1.0)
    return LevelOrientation(game_rotation.time_ns, Rotation.from_quat(quaternion))


def filtered_orientation(accelerometer: SensorSeries, gyroscope: SensorSeries) -> LevelOrientation:
    """Integrate the gyroscope (rad/s), and level it by gravity averaged in the integrated frame (m/s^2).

    A complementary filter without delay: in the frame of the gyroscope, the average of the accelerometer before and
    after is gravity, except for the gyroscope's drift within a few seconds.
    """
    time_s = (gyroscope.time_ns - gyroscope.time_ns[0]) * 1e-9
    turn = (gyroscope.values[1:] + gyroscope.values[:-1]) / 2 * np.diff(time_s)[:, None]
    start_R_body = Rotation.from_quat(_running_product(Rotation.from_rotvec(turn).as_quat()))
    at_s = (accelerometer.time_ns - gyroscope.time_ns[0]) * 1e-9
    force = np.column_stack([np.interp(time_s, at_s, axis) for axis in accelerometer.values.T])
    memory = GRAVITY_MEMORY_S / np.median(np.diff(time_s))
    up = gaussian_filter1d(start_R_body.apply(force), memory, axis=0, mode="reflect")
    return LevelOrientation(gyroscope.time_ns, _upright(up) * start_R_body)


def _running_product(quaternion: FloatArray) -> FloatArray:
    """Products (n + 1, 4) of the first 0, 1, ... n quaternions (n, 4), by doubling: log2(n) vectorised steps."""
    product = np.concatenate((np.array([[0.0, 0.0, 0.0, 1.0]]), quaternion))
    reach = 1
    while reach < len(product):
        product[reach:] = multiply(product[:-reach], product[reach:])
        reach *= 2
    unit: FloatArray = product / np.linalg.norm(product, axis=1, keepdims=True)
    return unit


def _upright(up: FloatArray) -> Rotation:
    """Return the smallest rotations that turn the directions (n, 3) up."""
    x, y, z = (up / np.linalg.norm(up, axis=1, keepdims=True)).T
    angle = np.arccos(z.clip(-1, 1)) / np.maximum(np.hypot(x, y), 1e-12)
    return Rotation.from_rotvec(np.column_stack((y * angle, -x * angle, np.zeros_like(x))))


TURN_S = 0.5
"""Turns are compared over this time: longer than a late pose stamp, shorter than a swing of the hand."""
MIN_ALIKE = 0.5
"""Correlation of the tilting turns below which camera and phone do not describe the same motion."""
MIN_LEAD = 0.2
"""Margin by which the best assignment of axes must beat the second."""
MIN_GRAVITY = 0.9
"""Mean cosine between the two upward directions; 25 degrees."""
COMPARED_NS = 100_000_000
"""Frames are thinned to this interval; headings are averaged, and turns compared over longer times."""
HEADING_SPAN_S = 5.0
"""Headings are averaged over this time before and after: late stamps cancel, the phone's own heading hardly drifts."""
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LevelHeading:
    """Heading of the level frame's x axis in the BCS at frames (n,): ``turn`` is ``exp(i heading)``.

    It is shorter than 1 by the cosine of the angle between the two upward directions. ``camera_axes`` is
    ``camera_R_body``.
    """

    time_ns: IntArray
    turn: ComplexArray
    camera_axes: Rotation

    def at(self, time_ns: IntArray) -> ComplexArray:
        """Average about each time (k,); shorter results mean less agreement. Zero if no frame is near."""
        span_ns = round(HEADING_SPAN_S * 1e9)
        first = np.searchsorted(self.time_ns, time_ns - span_ns)
        last = np.searchsorted(self.time_ns, time_ns + span_ns, side="right")
        total = np.concatenate((np.zeros(1, dtype=complex), np.cumsum(self.turn)))
        mean: ComplexArray = (total[last] - total[first]) / np.maximum(last - first, 1)
        return mean


def level_heading(time_ns: IntArray, bcs_R_camera: Rotation, level: LevelOrientation) -> LevelHeading | None:
    """Compare the two orientations at frames (n,), in time order; None if they do not describe the same motion."""
    kept = np.flatnonzero(np.diff(time_ns // COMPARED_NS, prepend=-1))
    time_ns, bcs_R_camera = time_ns[kept], bcs_R_camera[kept]
    level_R_body = level.at(time_ns)
    camera_R_body = _camera_axes(time_ns, bcs_R_camera, level_R_body)
    if camera_R_body is None:
        return None
    matrix = (bcs_R_camera * camera_R_body * level_R_body.inv()).as_matrix()
    heading = np.arctan2(matrix[:, 1, 0] - matrix[:, 0, 1], matrix[:, 0, 0] + matrix[:, 1, 1])
    return LevelHeading(time_ns, (np.cos(heading) + 1j * np.sin(heading)) * matrix[:, 2, 2], camera_R_body)


def _camera_axes(time_ns: IntArray, bcs_R_camera: Rotation, level_R_body: Rotation) -> Rotation | None:
    """Choose among the 24 ways in which the camera's axes can be parallel to the phone's, by frames (n,)."""
    later = np.searchsorted(time_ns, time_ns + round(TURN_S * 1e9))
    pairs = np.flatnonzero(later < len(time_ns))
    if len(pairs) == 0:
        return None
    up_camera, up_body = bcs_R_camera.inv().apply(_UP), level_R_body.inv().apply(_UP)
    turn_camera = _tilting(bcs_R_camera, up_camera, pairs, later[pairs])
    turn_body = _tilting(level_R_body, up_body, pairs, later[pairs])
    ways = Rotation.create_group("O").as_matrix()
    gravity = np.einsum("wij,ij->w", ways, up_camera.T @ up_body) / len(time_ns)
    norm = np.sqrt(np.sum(turn_camera**2) * np.sum(turn_body**2))
    alike = np.einsum("wij,ij->w", ways, turn_camera.T @ turn_body) / max(norm, 1e-12)
    alike[gravity < MIN_GRAVITY] = -1.0
    second, best = np.argsort(alike)[-2:]
    if alike[best] < MIN_ALIKE or alike[best] - alike[second] < MIN_LEAD:
        return None
    return Rotation.from_matrix(ways[best])


def _tilting(world_R_own: Rotation, up: FloatArray, start: IntArray, end: IntArray) -> FloatArray:
    """Turns (p, 3) between pairs of frames in their own axes, without the part about the vertical."""
    turn = (world_R_own[start].inv() * world_R_own[end]).as_rotvec()
    tilting: FloatArray = turn - np.sum(turn * up[start], axis=1, keepdims=True) * up[start]
    return tilting


JUMP_M, FASTEST_M_S = 0.1, 4.0
"""A step between frames longer than both allow, metres and metres a second, was not walked."""


@dataclass(frozen=True)
class MappedFrames:
    """Usable frames in time order; ``positioned`` (n,): those with position and orientation."""

    series: SensorSeries
    positioned: BoolArray
    orientation: Rotation
    """``bcs_R_camera`` of the positioned frames."""

    @property
    def positioned_ns(self) -> IntArray:
        """(k,) times of the positioned frames."""
        positioned_ns: IntArray = self.series.time_ns[self.positioned]
        return positioned_ns

    def first_fault(self, start_ns: IntArray, end_ns: IntArray) -> IntArray:
        """Return for each window (w,) why it is not mapped completely, or FINE."""
        series = self.series
        faults = series.faults(LabelSettings().max_gap_s)
        step_m = np.hypot(*np.diff(series.values[:, :2], axis=0).T)
        jumped = step_m > JUMP_M + FASTEST_M_S * np.diff(series.time_ns) * 1e-9
        faults[(faults == FINE) & jumped] = JUMP
        return first_fault(series.time_ns, faults, start_ns, end_ns)

    def place_at(self, time_ns: IntArray) -> FloatArray:
        """Interpolate x, y and sigma at times (w,) without fault: (w, 3)."""
        since, at = ((times - self.series.time_ns[0]) * 1e-9 for times in (self.positioned_ns, time_ns))
        return np.column_stack([np.interp(at, since, column) for column in self.series.values[self.positioned].T])

    def turned(self, axis: FloatArray, start_ns: IntArray, end_ns: IntArray) -> FloatArray:
        """Angle (w,) by which an axis (3,) of the camera turned about the vertical, rad, counter-clockwise."""
        between = RotationSeries(self.positioned_ns, self.orientation)
        start, end = (between.at(times).apply(axis) for times in (start_ns, end_ns))
        turned: FloatArray = np.angle((end[:, 0] + 1j * end[:, 1]) * (start[:, 0] - 1j * start[:, 1]))
        return turned


def mapped_frames(trajectory: pl.DataFrame, gyroscope: SensorSeries) -> MappedFrames:
    """Read a session's frames from its ``trajectory`` table; late stamps are corrected with the gyroscope."""
    unusable = (Status.DUPLICATE.label, Status.INVALID.label)
    rows = in_time_order(trajectory.filter(~pl.col("status").is_in(unusable)))
    positioned = rows.select(pl.all_horizontal(pl.col("x", "y", "qx", "qy", "qz", "qw").is_not_null())).to_series()
    quaternion = rows.filter(positioned).select("qx", "qy", "qz", "qw").to_numpy(writable=True).reshape(-1, 4)
    status = status_codes(rows)
    status[has_position(status) & ~positioned.to_numpy()] = Status.NO_MAPPING
    time_ns = rows["time_ns"].to_numpy()
    lag_s = estimate_pose_lag(time_ns[positioned.to_numpy()], quaternion, gyroscope.time_ns, gyroscope.values) or 0.0
    series = SensorSeries(
        time_ns - round(lag_s * 1e9),
        rows.select("x", "y", "sigma").cast(pl.Float64).fill_null(float("nan")).to_numpy().reshape(-1, 3),
        status,
        rows["floor"].cast(pl.Int64).to_numpy(),
    )
    return MappedFrames(series, positioned.to_numpy(), Rotation.from_quat(quaternion))
