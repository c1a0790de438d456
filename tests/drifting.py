"""Walks drawn from the smoother's own model: a tracker whose heading, scale and position drift at random.

Two ways to use them: :meth:`Drifting.observations` hands the odometry and the passes to the equations directly;
:meth:`Drifting.logged` writes what a phone would have logged, frame by frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.walks import to_acs
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.observations import METRES_PER_S, Passes, WalkObservations
from vislam2tag.estimation.odometry import continuous_odometry
from vislam2tag.estimation.tracker_errors import SCALE_SIGMA, NoiseLevels

QUIET = NoiseLevels(position_m=0.0, heading_rad=0.0, scale=0.0, sighting_m=0.0, sheet_rad=0.0)
"""A perfect tracker."""
IN_SIGHT_M = 2.5
JITTER_M = 1e-5
"""A sheet in sight is estimated anew at each frame: its logged position changes by about this."""
SURVEY_SIGMA_M = 0.02


@dataclass(frozen=True)
class Drifting:
    """A walk of ``n`` frames on the plane: ``truth`` (n,) complex, BCS; ``tracked`` (n,) complex, ACS.

    ``time_s`` (n,); ``factor`` (n,): true displacements near a frame are ``factor`` times tracked ones; landmarks
    ``place`` (m,) complex and ``heading_rad`` (m,) in the BCS, ``surveyed_at`` (m,) as measured.
    """

    noise: NoiseLevels
    rng: np.random.Generator
    time_s: FloatArray
    truth: ComplexArray
    tracked: ComplexArray
    factor: ComplexArray
    place: ComplexArray
    heading_rad: FloatArray
    surveyed_at: ComplexArray

    @property
    def ids(self) -> tuple[str, ...]:
        return tuple(f"L{i}" for i in range(len(self.place)))

    def landmarks(self, surveyed: list[int] | None = None, headed: list[int] | None = None) -> Landmarks:
        """Survey of these landmarks (default: all), with a heading for those of ``headed``."""
        rows = range(len(self.place)) if surveyed is None else surveyed
        m = len(self.place)
        position, covariance = np.full((m, 2), np.nan), np.tile(np.diag([np.inf, np.inf]), (m, 1, 1))
        heading, sigma = np.full(m, np.nan), np.full(m, np.nan)
        position[list(rows)] = as_points(self.surveyed_at)[list(rows)]
        covariance[list(rows)] = np.eye(2) * SURVEY_SIGMA_M**2
        heading[headed or []] = self.heading_rad[headed or []]
        sigma[headed or []] = 0.01
        return Landmarks(
            self.ids, np.zeros(m, dtype=np.int64), position, covariance, np.full(m, np.nan), heading, sigma
        )

    def _approaches(self) -> list[tuple[IntArray, IntArray, int]]:
        """Of each pass: its frames, its nearest frame, the landmark."""
        found = []
        for j, place in enumerate(self.place):
            distance = np.abs(self.truth - place)
            near = np.flatnonzero(distance < IN_SIGHT_M)
            visits = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
            found += [(frames, frames[np.argmin(distance[frames])], j) for frames in visits if len(frames)]
        return sorted(found, key=lambda one: int(one[1]))

    def _sighting_errors(self, distance_m: FloatArray) -> ComplexArray:
        sigma = self.noise.sighting_m * np.sqrt((1 + distance_m**2) / 2)
        return np.asarray(sigma * (self.rng.standard_normal(len(sigma)) + 1j * self.rng.standard_normal(len(sigma))))

    def observations(self) -> WalkObservations:
        """The walk as the equations take it: one observation a pass, no events."""
        approaches = self._approaches()
        at = np.array([one[1] for one in approaches], dtype=np.int64)
        landmark = np.array([one[2] for one in approaches], dtype=np.int64)
        away = self.place[landmark] - self.truth[at]
        error = self._sighting_errors(np.abs(away))
        sheet = self.heading_rad[landmark] + self.noise.sheet_rad * self.rng.standard_normal(len(at))
        turn = self.factor[at] / np.abs(self.factor[at])
        smooth = continuous_odometry(camera_track(self.truth, self.time_s), nothing_logged())
        odometry = replace(smooth, path=self.tracked)
        passes = Passes(
            at=at,
            landmark=landmark,
            offset=(away + error) / self.factor[at],
            heading=np.exp(1j * sheet) / turn,
            distance_m=np.abs(away),
            spread_m=np.zeros(len(at)),
            count=np.array([len(one[0]) for one in approaches]),
        )
        return WalkObservations(self.ids, odometry, passes)

    def logged(self) -> tuple[CameraTrack, LandmarkLog]:
        """The walk as a phone logs it: each landmark at every frame from its first sighting on."""
        n = len(self.truth)
        place = np.full((n, len(self.place)), np.nan, dtype=np.complex128)
        sheet = np.full((n, len(self.place)), np.nan)
        for frames, nearest, j in self._approaches():
            away = self.place[j] - self.truth[frames]
            shared = self._sighting_errors(np.abs(self.place[j : j + 1] - self.truth[nearest]))
            jitter = JITTER_M * (self.rng.standard_normal(len(frames)) + 1j * self.rng.standard_normal(len(frames)))
            place[frames, j] = self.tracked[frames] + (away + shared) / self.factor[frames] + jitter
            error = self.noise.sheet_rad * self.rng.standard_normal()
            sheet[frames, j] = self.heading_rad[j] + error - np.angle(self.factor[frames])
        camera = camera_track(self.tracked, self.time_s, self.truth, self.factor)
        return camera, _held(self.ids, place, sheet)


def nothing_logged() -> LandmarkLog:
    """A log without any row."""
    none = np.empty(0, dtype=np.int64)
    return LandmarkLog((), none, none, np.empty((0, 3)), np.empty((0, 4)), np.empty(0, dtype=bool))


def camera_track(
    tracked: ComplexArray, time_s: FloatArray, truth: ComplexArray | None = None, factor: ComplexArray | None = None
) -> CameraTrack:
    """Frames at these places; the camera looks along the true way, if given."""
    n = len(tracked)
    heading = np.zeros(n) if truth is None or factor is None else np.angle(np.gradient(truth) / factor)
    return CameraTrack(
        time_ns=10**12 + np.round(time_s * 1e9).astype(np.int64),
        position_acs=to_acs(as_points(tracked), 1.4),
        orientation_acs=about_vertical(heading),
        status=np.zeros(n, dtype=np.int8),
    )


def about_vertical(angle_rad: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of turns about the ACS's vertical axis (y)."""
    zero = np.zeros_like(angle_rad)
    return np.column_stack((zero, np.sin(angle_rad / 2), zero, np.cos(angle_rad / 2)))


def sheet_orientation(heading_rad: FloatArray) -> FloatArray:
    """Quaternions (k, 4) of sheets on a wall whose X axis points along these directions of the ACS plane.

    X to the right, Y out of the wall, Z down the sheet: a quarter turn about X, then one about the vertical.
    """
    half = np.sqrt(0.5)
    sin, cos = np.sin(heading_rad / 2), np.cos(heading_rad / 2)
    return np.asarray(half * np.column_stack((cos, sin, -sin, cos)))


def _held(ids: tuple[str, ...], place: ComplexArray, sheet: FloatArray) -> LandmarkLog:
    """Hold each landmark's logged pose (n, m), NaN where it is not in sight, from sighting to sighting."""
    n = len(place)
    newest = np.maximum.accumulate(np.where(np.isfinite(place), np.arange(n)[:, None], -1), axis=0)
    landmark, frame = np.nonzero(newest.T >= 0)
    source = newest[frame, landmark]
    return LandmarkLog(
        ids=ids,
        landmark=landmark.astype(np.int64),
        frame=frame.astype(np.int64),
        position_acs=to_acs(as_points(place[source, landmark]), 1.4),
        orientation_acs=sheet_orientation(sheet[source, landmark]),
        lost=np.zeros(len(frame), dtype=bool),
    )


def loops(
    seed: int,
    noise: NoiseLevels = QUIET,
    *,
    marks: int = 8,
    laps: float = 2.0,
    rate_hz: float = 10.0,
    survey_m: float = 0.0,
    size_m: tuple[float, float] = (15.0, 8.0),
    drifted: bool = True,
) -> Drifting:
    """Walk at 1 m/s around an ellipse, landmarks 1 m beside the way; the walk starts between two of them.

    ``survey_m`` is the standard deviation per axis of the survey's errors; not ``drifted``: ACS is the BCS.
    """
    rng = np.random.default_rng(seed)
    a, b = size_m
    fine = np.linspace(0, 2 * np.pi * laps, int(4000 * laps) + 1)
    ellipse = a * np.cos(fine) + 1j * b * np.sin(fine)
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(ellipse)))))
    time_s = np.arange(int(travelled[-1] * rate_hz)) / rate_hz
    angle = np.interp(time_s, travelled, fine)
    truth = a * np.cos(angle) + 1j * b * np.sin(angle)
    start = (rng.uniform(-np.pi, np.pi), rng.normal(0, SCALE_SIGMA)) if drifted else (0.0, 0.0)
    tracked, factor = _tracked(truth, time_s, noise, rng, *start)
    hung = 2 * np.pi * (np.arange(marks) + 0.5) / marks
    inside = np.where(np.arange(marks) % 2, 1.0, -1.0) * np.exp(1j * np.arctan2(a * np.sin(hung), b * np.cos(hung)))
    place = a * np.cos(hung) + 1j * b * np.sin(hung) + inside
    measured = place + survey_m * (rng.standard_normal(marks) + 1j * rng.standard_normal(marks))
    return Drifting(noise, rng, time_s, truth, tracked, factor, place, rng.uniform(-np.pi, np.pi, marks), measured)


def _tracked(
    truth: ComplexArray, time_s: FloatArray, noise: NoiseLevels, rng: np.random.Generator, heading: float, scale: float
) -> tuple[ComplexArray, ComplexArray]:
    """Draw the drift of heading, scale and position step by step; returns path and factor."""
    step = np.diff(truth)
    spread = np.sqrt(np.abs(step) + METRES_PER_S * np.diff(time_s))
    headings = heading + np.concatenate(([0.0], np.cumsum(noise.heading_rad * spread * rng.standard_normal(len(step)))))
    observations = np.sqrt(np.abs(step))
    scales = scale + np.concatenate(([0.0], np.cumsum(noise.scale * observations * rng.standard_normal(len(step)))))
    factor = (1 + scales) * np.exp(1j * headings)
    slip = noise.position_m * spread * (rng.standard_normal(len(step)) + 1j * rng.standard_normal(len(step)))
    start = rng.uniform(-20, 20) if heading else truth[0]
    return np.asarray(start + np.concatenate(([0.0], np.cumsum((step + slip) / factor[1:])))), np.asarray(factor)
