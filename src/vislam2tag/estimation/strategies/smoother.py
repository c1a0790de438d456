"""The smoother: all landmarks at once, robust, with a covariance for every frame (docs/explanation/smoother.md)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory, Visit
from vislam2tag.core.transforms import camera_to_bcs, level_view
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.fault_detection import contradictions, may_have_slipped, slips
from vislam2tag.estimation.frame_states import ExposureInterpolation
from vislam2tag.estimation.heights import estimate_heights
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import FEWEST_FRAMES, WalkObservations
from vislam2tag.estimation.settings import BY_LANDMARKS, HeightSettings, MappingSettings
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk, solve_with_ties
from vislam2tag.estimation.strategies.dead_reckoning import DeadReckoning
from vislam2tag.estimation.strategy import MappingStrategy, TrajectoryBuilder, not_converged, register


@dataclass(frozen=True)
class Smoother:
    """One robust least-squares problem for the whole walk: every usable frame gets a position and a covariance."""

    sighting_range_m: float
    allow_for_pose_lag: bool = False
    body_behind_camera_m: float = 0.0
    heights: HeightSettings = field(default_factory=HeightSettings)
    without_tracker: DeadReckoning = field(default_factory=DeadReckoning)
    """The strategy for sessions without poses."""
    without_landmarks: MappingStrategy | None = None
    """The strategy for sessions that no landmarks connect to the building, if their floor has a plan."""
    needs: str = (
        "sightings of two surveyed landmarks half a metre apart, or of one with a surveyed heading, or a plan of its "
        "floor with walls (a session without poses: two known positions at different places)"
    )

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map all usable frames, or none if the sighted landmarks do not connect the walk to the building."""
        if camera.without_poses:
            return self.without_tracker.map(camera, log, landmarks)
        nothing = TrajectoryBuilder.blank(camera, Status.NO_MAPPING).finish(camera, (), ())
        if camera.usable.sum() < FEWEST_FRAMES:
            return nothing
        observe = partial(bridged_observations, camera, log, self.sighting_range_m, surveyed=landmarks.surveyed_ids)
        observations = observe()
        priors = LandmarkPriors.of(observations.ids, landmarks)
        smoothed = solve_walk(observations, priors, camera.tracker)
        if smoothed is not None and camera.inertial is not None and may_have_slipped(smoothed):  # the IMU shows when
            observations = observe(slips=True)
            smoothed = solve_walk(observations, priors, camera.tracker)
        if smoothed is None and self.without_landmarks is not None and camera.plans:
            return self.without_landmarks.map(camera, log, landmarks)
        if smoothed is None:
            return replace(nothing, visits=visits_of(observations), events=observations.odometry.events)
        return self.mapped(smoothed, camera, log, landmarks)

    def mapped(self, smoothed: SolvedWalk, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """The trajectory of a walk that was solved by its landmarks, or by places on a plan."""
        observations = smoothed.model.observations
        frame = observations.odometry.frame
        tied = smoothed if camera.ties is None else self._tied(smoothed, camera, frame, camera.ties)
        heights = estimate_heights(camera, log, landmarks, self.heights, observations.odometry)
        return replace(
            self._placed(tied, camera, frame, heights.z_m[frame]),
            visits=visits_of(observations),
            floor=heights.floor,
            events=tuple(sorted((*observations.odometry.events, *slips(smoothed)), key=lambda event: event.frame)),
            contradictions=contradictions(smoothed),
            passes_left_out=observations.passes_left_out,
            not_converged=(
                *not_converged("path", tied.unreached_sigmas, "standard deviations"),
                *not_converged("heights", heights.unreached_m, "m"),
            ),
        )

    def _placed(self, smoothed: SolvedWalk, camera: CameraTrack, frame: IntArray, z_m: FloatArray) -> Trajectory:
        """Positions, covariances and orientations at the used frames (n,), of the body and at their stamps."""
        path, spread, rotation = mapped_path(smoothed)
        orientation = camera_to_bcs(camera.orientation_acs[frame], rotation)
        if self.body_behind_camera_m:
            path = path - self.body_behind_camera_m * level_view(orientation)
        position = np.column_stack((path, z_m))
        if self.allow_for_pose_lag and camera.pose_lag_s:
            stamps = ExposureInterpolation.of(smoothed.model.observations.odometry.time_s, camera.pose_lag_s)
            position, spread = stamps.blend(position), stamps.blend(spread)
            orientation = stamps.blend_quaternions(orientation)
        builder = TrajectoryBuilder.blank(camera, Status.NO_MAPPING)
        builder.position_bcs[frame], builder.covariance_bcs[frame] = position, spread
        builder.orientation_bcs[frame] = orientation
        builder.status[frame] = Status.OK
        return builder.finish(camera, (), ())

    def _tied(self, smoothed: SolvedWalk, camera: CameraTrack, frame: IntArray, ties: PlaceTies) -> SolvedWalk:
        """Smooth again with places of the body, which is behind the camera, from others; ``frame`` (n,) are used."""
        time_ns = camera.time_ns[frame]
        if self.body_behind_camera_m:
            view = level_view(camera_to_bcs(camera.orientation_acs[frame], mapped_path(smoothed)[2]))
            at = np.searchsorted(time_ns, ties.time_ns).clip(0, len(frame) - 1)
            ties = replace(ties, position_bcs=ties.position_bcs + self.body_behind_camera_m * view[at])
        return solve_with_ties(smoothed, time_ns, ties)


def visits_of(observations: WalkObservations) -> tuple[Visit, ...]:
    """Each pass of a landmark, without places that are no landmarks."""
    passes, frame = observations.passes, observations.odometry.frame
    return tuple(
        Visit(int(frame[at]), observations.ids[landmark], float(distance))
        for at, landmark, distance in zip(passes.at, passes.landmark, passes.distance_m, strict=True)
        if observations.ids[landmark]
    )


def smoother_of(settings: MappingSettings) -> Smoother:
    """The smoother with these settings."""
    return Smoother(
        settings.smoother.sighting_range_m,
        settings.smoother.allow_for_pose_lag,
        settings.smoother.body_behind_camera_m,
        settings.heights,
        DeadReckoning(settings.dead_reckoning, settings.heights),
    )


def _with_plan(settings: MappingSettings) -> Smoother:
    from vislam2tag.estimation.strategies.floor_plan import FloorPlan  # which is made of the smoother

    alone = smoother_of(settings)
    return replace(alone, without_landmarks=FloorPlan(alone))


register(BY_LANDMARKS, _with_plan)
