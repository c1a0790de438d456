"""From all sessions of a survey to one completed landmark file: sessions become local maps, which are joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.tabular import Frames, TabularResult, column_frame, listed_frame
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.context import Storeys, WalkedWays
from vislam2tag.core.limits import MAX_JOINT_LANDMARKS
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.estimation.heights import Heights, estimate_heights, vertical_span_m
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.landmark_map import SETTLED_M, LandmarkMap, join
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.smoother import solve_in_own_frame
from vislam2tag.estimation.tracker_errors import NoiseLevels
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.pipeline.run.selection import OpenedSurvey, Selection
from vislam2tag.pipeline.run.workers import outcomes_of
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, prepared_track
from vislam2tag.sessions.session_landmarks import CLIMB_M
from vislam2tag.site.model import SessionKey, Site, Survey

if TYPE_CHECKING:
    import polars as pl


class LandmarkPlace(NamedTuple):
    """A landmark at one position: a landmark that corrections move counts as another one during that time."""

    floor: int
    landmark: str
    moved_to: tuple[float, float] | None = None


@dataclass(frozen=True)
class WalkedPasses:
    """The ``p`` passes of a walk: ``landmark`` (p,) row of its map, ``at_m`` (p,) way walked until then, metres;
    ``whole_m`` is the whole way.
    """

    landmark: IntArray
    at_m: FloatArray
    whole_m: float

    def longest_stretch_m(self, known: BoolArray) -> float:
        """Longest way without a landmark of a mask (k,)."""
        at_m = self.at_m[known[self.landmark]]
        return float(np.diff(np.concatenate(([0.0], at_m, [self.whole_m]))).max())


@dataclass(frozen=True, repr=False)
class ReducedSession(TabularResult):
    """A session's input to a joint survey; ``places``, ``z_m`` (k,) are those of the map's landmarks.

    ``z_m`` is the height above the floor, metres, NaN if it is not known; ``unused`` are logged ids that only
    other floors have; ``error`` says why the session cannot be read.
    """

    key: SessionKey
    places: tuple[LandmarkPlace, ...] = ()
    local: LocalMap | None = None
    z_m: FloatArray | None = None
    passes: WalkedPasses | None = None
    unused: tuple[str, ...] = ()
    error: str | None = None
    converged: bool = True
    """Whether the re-weighting of its map converged."""
    noise: NoiseLevels | None = None
    """Noise of its tracker, if it observed landmarks."""
    way: WalkedWays | None = None
    """Its path, if the session has no poses."""


@dataclass(frozen=True, repr=False)
class JointSurvey(TabularResult):
    """The joined map of a survey's landmarks: ``places`` (m,) and ``file`` (m,) belong to the rows of ``joined``.

    ``sessions`` are sorted by key; map i of ``joined`` is that of ``mapped[i]``.
    """

    main_table: ClassVar[str] = "landmarks"

    survey: Survey
    sessions: tuple[ReducedSession, ...]
    mapped: tuple[ReducedSession, ...]
    places: tuple[LandmarkPlace, ...]
    joined: LandmarkMap

    def _facts(self) -> dict[str, object]:
        return {
            "landmarks": len(self.places),
            "sessions": len(self.sessions),
            "connected": int(self.joined.tied.sum()),
            "converged": self.joined.converged,
        }

    def _frames(self) -> Frames:
        return {"landmarks": self._landmark_frame, "sessions": partial(listed_frame, self.sessions)}

    def _landmark_frame(self) -> pl.DataFrame:
        """The joined landmarks, BCS of their floors, metres; null if a value is not known."""
        known = self.joined.placed
        covariance = np.where(known[:, None, None], self.joined.position_covariance, np.nan)
        columns = {
            "x": np.where(known, self.joined.position.real, np.nan),
            "y": np.where(known, self.joined.position.imag, np.nan),
            "cov_xx": covariance[:, 0, 0],
            "cov_xy": covariance[:, 0, 1],
            "cov_yy": covariance[:, 1, 1],
        }
        names = {"id": [place.landmark for place in self.places], "floor": [place.floor for place in self.places]}
        return column_frame(names | columns)


def reduce_session(settings: MappingSettings, task: SessionTask) -> ReducedSession:
    """Read a session and map its landmarks in its own frame; a failure is recorded as its ``error``."""
    key = task.ref.key
    return done_or_failed(
        key,
        lambda: reduced(settings, prepared_track(task).longest_section()),
        lambda error: ReducedSession(key, error=error),
    )


def reduced(settings: MappingSettings, prepared: PreparedSession) -> ReducedSession:
    """Map the landmarks of a session's longest section in its own frame.

    Raises SessionError if it passes landmarks of floors with different frames.
    """
    task = prepared.task
    key, site = task.ref.key, task.site
    camera, log, landmarks = prepared.session.camera, prepared.session.landmarks, prepared.landmarks
    if camera.without_poses:
        from vislam2tag.estimation.strategies.dead_reckoning import DeadReckoning  # SciPy, which workers alone need

        walk = DeadReckoning(settings.dead_reckoning, settings.heights).reckoned(camera, landmarks)
        return ReducedSession(key, way=None if walk is None else walk.way())
    if task.frames and (landmarks.floor != key.floor).any():
        raise SessionError(
            f"{key}: its landmarks are on floors with different frames (site_T_bcs), which cannot be joined"
        )
    log = log.select([i for i, name in enumerate(log.ids) if name not in prepared.unused])
    range_m = settings.smoother.sighting_range_m
    observations = WalkObservations.of(camera, log, range_m, surveyed=landmarks.surveyed_ids)
    log = log.select(np.flatnonzero(np.isin(log.ids, observations.ids)).tolist())
    if len(observations.passes.at) == 0:
        return ReducedSession(key, unused=prepared.unused)
    smoothed = solve_in_own_frame(observations)
    local = LocalMap.of(smoothed)
    climbed = len(site.floors) > 1 and vertical_span_m(camera, log) >= CLIMB_M
    around = _over_all_floors(site, landmarks) if climbed else landmarks
    heights = estimate_heights(camera, log, around, settings.heights, observations.odometry)
    floors = [_floor(observations, heights, landmarks, index, key.floor) for index in local.landmark.tolist()]
    places = tuple(
        _place(site.landmarks, landmarks, log.ids[index], floor)
        for index, floor in zip(local.landmark.tolist(), floors, strict=True)
    )
    z_m = _heights_above_floor(site, camera, log, observations, heights, floors, local)
    passes = _walked_passes(observations, local)
    converged, noise = smoothed.unreached_sigmas == 0, smoothed.noise
    return ReducedSession(key, places, local, z_m, passes, prepared.unused, converged=converged, noise=noise)


def _walked_passes(observations: WalkObservations, local: LocalMap) -> WalkedPasses:
    way_m = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(observations.odometry.path)))))
    passes = observations.passes
    return WalkedPasses(np.searchsorted(local.landmark, passes.landmark), way_m[passes.at], float(way_m[-1]))


def _over_all_floors(site: Site, landmarks: Landmarks) -> Landmarks:
    """A session's landmarks for a walk that went up or down, though it may have met no known landmark there."""
    if landmarks.storeys is None:
        return landmarks
    elevation = {floor.number: floor.elevation_m for floor in site.floors if floor.elevation_m is not None}
    there = [floor.number for floor in site.floors]
    numbers = np.unique(np.concatenate((landmarks.storeys.number, landmarks.floor, there))).astype(np.int64)
    elevations = np.array([elevation.get(number, np.nan) for number in numbers.tolist()])
    return replace(landmarks, storeys=Storeys(landmarks.storeys.own, numbers, elevations))


def _floor(observations: WalkObservations, heights: Heights, landmarks: Landmarks, index: int, own: int) -> int:
    """A landmark's floor: as its file says, else the one on which the walk passed it most often."""
    name = observations.ids[index]
    if name in landmarks.index:
        return int(landmarks.floor[landmarks.index[name]])
    if not len(heights.floor):
        return own
    at = observations.passes.at[observations.passes.landmark == index]
    floors, count = np.unique(heights.floor[observations.odometry.frame[at]], return_counts=True)
    return int(floors[count.argmax()])


def _place(site: Landmarks, mine: Landmarks, name: str, floor: int) -> LandmarkPlace:
    """Name a landmark; corrections may change its position or id."""
    if name not in mine.index or not mine.surveyed[mine.index[name]]:
        return LandmarkPlace(floor, name)
    here = mine.position_bcs[mine.index[name]]
    there = site.on_floor(floor)
    same = name in there.index and np.array_equal(here, there.position_bcs[there.index[name]])
    return LandmarkPlace(floor, name, None if same else (float(here[0]), float(here[1])))


def _heights_above_floor(
    site: Site,
    camera: CameraTrack,
    log: LandmarkLog,
    observations: WalkObservations,
    heights: Heights,
    floors: Sequence[int],
    local: LocalMap,
) -> FloatArray:
    """(k,) median over the passes of each landmark: the camera's height, and how much higher the landmark was."""
    elevation = {floor.number: floor.elevation_m for floor in site.floors if floor.elevation_m is not None}
    passes = observations.passes
    z_m = np.full(len(floors), np.nan)
    for i, (index, floor) in enumerate(zip(local.landmark.tolist(), floors, strict=True)):
        rows = log.rows_of(index)
        frames = observations.odometry.frame[passes.at[passes.landmark == index]]
        chosen = rows.start + np.searchsorted(log.frame[rows], frames)
        above = log.position_acs[chosen, 1] - camera.position_acs[frames, 1] + heights.z_m[frames]
        z_m[i] = np.median(above) - elevation.get(floor, np.nan)
    return z_m


def survey_landmarks(
    root: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    floors: tuple[int, ...] = (),
    jobs: int = 1,
    progress: Progress[ReducedSession] = silent,
) -> JointSurvey:
    """Estimate positions of landmarks without one, jointly from all sessions of a survey (or of some floors).

    ``progress`` is called after each session with it and their total number. With ``jobs`` > 1 sessions are reduced in
    that many processes. Raises SurveyError if ``root`` is not a survey, UsageError for a floor without sessions,
    OutputError if a worker is killed; a session that cannot be read has an ``error``.
    """
    opened = OpenedSurvey.at(root, settings, selection=Selection(floors=floors), jobs=jobs)
    work = partial(reduce_session, opened.settings.mapping)
    sessions = outcomes_of(opened.run_all, work, opened.tasks(opened.refs), progress)
    return join_sessions(opened.survey, sessions, opened.settings.survey.landmark_sigma_m)


def join_sessions(
    survey: Survey, sessions: Sequence[ReducedSession], default_sigma_m: float, settled_m: float = SETTLED_M
) -> JointSurvey:
    """Join the local maps of sessions, in any order.

    Raises SurveyError for too many landmarks.
    """
    ordered = tuple(sorted(sessions, key=lambda session: session.key))
    site = survey.site.landmarks
    in_files = [LandmarkPlace(floor, name) for floor, name in zip(site.floor.tolist(), site.ids, strict=True)]
    further = {place for session in ordered for place in session.places} - set(in_files)
    places = (*in_files, *sorted(further, key=lambda place: (place.floor, place.landmark, place.moved_to or ())))
    if len(places) > MAX_JOINT_LANDMARKS:
        raise SurveyError(
            f"{survey.root}: landmark files and sessions have {len(places):,} landmarks, but at most "
            f"{MAX_JOINT_LANDMARKS:,} can be placed together; remove those that do not exist, or create a survey for "
            "each building"
        )
    index = {place: i for i, place in enumerate(places)}
    mapped, maps = [], []
    for session in ordered:
        if session.local is not None:
            numbers = np.array([index[place] for place in session.places], dtype=np.int64)
            mapped.append(session)
            maps.append(replace(session.local, landmark=numbers))
    return JointSurvey(
        survey, ordered, tuple(mapped), places, join(maps, _priors(places, site, default_sigma_m), settled_m)
    )


def _priors(places: Sequence[LandmarkPlace], site: Landmarks, default_sigma_m: float) -> LandmarkPriors:
    """Positions from files and corrections; the site's landmarks come first."""
    priors = LandmarkPriors.nothing(len(places))
    count = len(site.ids)
    rows = np.flatnonzero(site.surveyed)
    priors.position[rows] = site.position_bcs[rows] @ (1, 1j)
    priors.covariance[rows] = site.covariance_bcs[rows]
    headed = np.isfinite(site.heading_rad) & np.isfinite(site.heading_sigma_rad)
    priors.heading_rad[:count] = np.where(headed, site.heading_rad, np.nan)
    priors.heading_sigma_rad[:count] = np.where(headed, site.heading_sigma_rad, np.nan)
    sigma_m = dict(zip(places, np.sqrt(site.covariance_bcs[:, 0, 0]).tolist(), strict=False))
    for i, place in enumerate(places):
        if place.moved_to is not None:
            usual = sigma_m.get(place._replace(moved_to=None), np.inf)
            priors.position[i] = complex(*place.moved_to)
            priors.covariance[i] = np.eye(2) * (usual if np.isfinite(usual) else default_sigma_m) ** 2
    return priors
