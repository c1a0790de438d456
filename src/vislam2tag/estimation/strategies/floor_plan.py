"""Walks placed by their shape on the floor's plan, with or without landmarks (docs/explanation/floor_plan.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray, StatusArray
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.floor_plan.compass import compass_turn_rad
from vislam2tag.estimation.floor_plan.facts import facts_of
from vislam2tag.estimation.floor_plan.local_poses import LocalPoses
from vislam2tag.estimation.floor_plan.placing import PlacedWalk, place_walk
from vislam2tag.estimation.floor_plan.stretches import BETWEEN_FLOORS
from vislam2tag.estimation.heights import between_floors, estimate_heights
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import FEWEST_FRAMES, WalkObservations
from vislam2tag.estimation.settings import ON_PLAN
from vislam2tag.estimation.smoother import SolvedWalk, first_problem, mapped_path, solve_about_places
from vislam2tag.estimation.strategies.smoother import Smoother, smoother_of, visits_of
from vislam2tag.estimation.strategy import TrajectoryBuilder, register

PLACE_VARIANCE = 1.5
"""Factor on the covariance of places: plans and paths err more than the grid knows (simulated walks)."""
TIED_M = 12.0
"""Places on the plan so far apart along the way err together by 1 / e."""
PLAN_M, PLAN_SHARE = 0.1, 0.01
"""Common error per axis of all places on a plan against surveyed landmarks: of its position, metres, and its scale."""


@dataclass(frozen=True)
class FloorPlan:
    """Labels the stretches of a walk that the plan of its floor places with certainty; the others get a reason."""

    smoother: Smoother
    """Solves for the path through the places found, and maps walks that a plan does not help."""
    needs: str = "a walk of about two minutes with turns, on a floor whose plan shows its walls"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map the frames of all certain stretches; with surveyed landmarks also those that they determine."""
        if camera.without_poses or not camera.plans or camera.usable.sum() < FEWEST_FRAMES:
            return self.smoother.map(camera, log, landmarks)
        observations = bridged_observations(
            camera, log, self.smoother.sighting_range_m, surveyed=landmarks.surveyed_ids, turned_as_camera=True
        )
        priors = LandmarkPriors.of(observations.ids, landmarks)
        facts = facts_of(camera, observations, priors)
        floor = self._floors(camera, log, landmarks, observations)
        placed = place_walk(observations.odometry, camera.plans, camera.own_floor, facts, floor)
        if placed is None:
            return self.smoother.map(camera, log, landmarks)
        placing = replace(placed.placing, compass_rad=compass_turn_rad(camera, observations.odometry))
        placed = replace(placed, placing=placing)
        mapped_by_landmarks = first_problem(observations, priors, camera.tracker) is not None
        if not len(placed.local.place):
            if mapped_by_landmarks:
                return replace(self.smoother.map(camera, log, landmarks), placing=placed.placing)
            return _refused(camera, observations, placed)
        observations = observations.scaled(placed.scale)
        solved = _solved(camera, observations, priors, placed.local)
        mapped = self.smoother.mapped(solved, camera, log, landmarks)
        if mapped_by_landmarks:
            return replace(mapped, placing=_with_scale(placed, solved))
        placed = placed.without_contradictions(as_complex(mapped_path(solved)[0]), observations.odometry.path)
        status = placed.frame_status(len(observations.odometry.frame))
        return _without(mapped, status, observations, _with_scale(placed, solved))

    def _floors(
        self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, observations: WalkObservations
    ) -> IntArray | None:
        """Number (n,) of the floor of each frame, by height; None if the walk stays on one floor."""
        odometry = observations.odometry
        heights = estimate_heights(camera, log, landmarks, self.smoother.heights, odometry)
        if not len(heights.floor) or not np.ptp(heights.floor[odometry.frame]):
            return None
        return np.where(between_floors(camera, log, odometry), BETWEEN_FLOORS, heights.floor[odometry.frame])


def _refused(camera: CameraTrack, observations: WalkObservations, placed: PlacedWalk) -> Trajectory:
    """A walk without any position, with the reason of each stretch."""
    builder = TrajectoryBuilder.blank(camera, placed.placing.reason)
    builder.status[camera.usable] = placed.frame_status(int(camera.usable.sum()))
    return replace(
        builder.finish(camera, (), ()),
        visits=visits_of(observations),
        events=observations.odometry.events,
        placing=placed.placing,
    )


def _solved(
    camera: CameraTrack, observations: WalkObservations, priors: LandmarkPriors, local: LocalPoses
) -> SolvedWalk:
    """Solve for the path through the places on the plan and the landmarks."""
    at = np.array([(one.first + one.last) // 2 for one in local.stretches])
    path = observations.odometry.path[at]
    middle = np.array([one.middle for one in local.stretches])
    place = local.place + np.exp(1j * local.yaw_rad) * (path - middle)
    covariance = _joint_covariance(local, at, observations, place)
    if priors.surveyed.any():
        covariance += _common_covariance(place)
    return solve_about_places(observations, priors, at, place, local.yaw_rad, covariance, camera.tracker)


def _joint_covariance(
    local: LocalPoses,
    at: IntArray,
    observations: WalkObservations,
    place: ComplexArray,
) -> FloatArray:
    """(2k, 2k) covariance of x, y of each place: neighbours along the way err alike."""
    way = np.concatenate(([0.0], np.cumsum(observations.odometry.step_length_m)))[at]
    alike = np.exp(-np.abs(way[:, None] - way) / TIED_M)
    root = np.linalg.cholesky(PLACE_VARIANCE * local.covariance_m2)
    joint = np.einsum("iab,ij,jcb->iajc", root, alike, root)
    return np.asarray(joint.reshape(2 * len(place), 2 * len(place)))


def _common_covariance(place: ComplexArray) -> FloatArray:
    """(2k, 2k) covariance that all places share, because their plan is shifted and scaled."""
    away = place - place.mean()
    both = np.stack((away.real, away.imag), axis=1).ravel()
    axis = np.tile(np.eye(2), (len(place), len(place)))
    return np.asarray(PLAN_M**2 * axis + PLAN_SHARE**2 * np.outer(both, both))


def _with_scale(placed: PlacedWalk, solved: SolvedWalk) -> Placing:
    """Add the size of the plan: the solved walk is so many times as long as the tracker's."""
    scale, sigma = solved.mean_scale()
    return replace(placed.placing, scale=placed.scale * scale, scale_sigma=sigma)


def _without(
    mapped: Trajectory,
    status: StatusArray,
    observations: WalkObservations,
    placing: Placing,
) -> Trajectory:
    """The trajectory without positions of stretches that are not certain."""
    frame = observations.odometry.frame
    every = mapped.status.copy()
    every[frame] = np.where(mapped.status[frame] == Status.OK, status, mapped.status[frame])
    gone = frame[status != Status.OK]
    position, orientation, covariance = (
        values.copy() for values in (mapped.position_bcs, mapped.orientation_bcs, mapped.covariance_bcs)
    )
    position[gone], orientation[gone], covariance[gone] = np.nan, np.nan, np.nan
    return replace(
        mapped,
        position_bcs=position,
        orientation_bcs=orientation,
        covariance_bcs=covariance,
        status=every,
        placing=placing,
    )


register(ON_PLAN, lambda settings: FloorPlan(smoother_of(settings)))
