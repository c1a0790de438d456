"""Finer positions around known poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import OFFICE_ROUTE, along, in_own_frame, odometry_of, office, with_gap
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.wall_costs import WallCosts
from vislam2tag.estimation.floor_plan.local_poses import LOCAL_LENGTH_M, LOST_M, LocalPoses, frames_of, local_poses
from vislam2tag.estimation.floor_plan.pose_grid import PoseGrid
from vislam2tag.estimation.floor_plan.posterior import BestPose
from vislam2tag.estimation.floor_plan.stretches import Stretches, stretches_of
from vislam2tag.estimation.odometry import Odometry

TURN_RAD = 0.7
TRUTH = along(OFFICE_ROUTE)


def exact_walk() -> Odometry:
    return odometry_of(in_own_frame(TRUTH, TURN_RAD))


def rough(long: Stretches, off: complex = 0.3 - 0.2j, turned_rad: float = 0.03) -> tuple[BestPose, ...]:
    """Poses of long stretches as a coarse grid may give them."""
    return tuple(
        BestPose(
            OFFICE_ROUTE[0] + one.middle * np.exp(1j * TURN_RAD) + off * (-1) ** number,
            TURN_RAD + turned_rad * (-1) ** number,
            1.0,
            np.eye(2),
            0.0,
        )
        for number, one in enumerate(long.stretches)
    )


def refined(odometry: Odometry, sure: BoolArray | None = None, off: complex = 0.3 - 0.2j) -> LocalPoses:
    long, short = stretches_of(odometry), stretches_of(odometry, LOCAL_LENGTH_M)
    every = np.ones(len(long.stretches), dtype=np.bool_)
    return local_poses(PoseGrid(office()), long, rough(long, off), every if sure is None else sure, short)


def errors_m(poses: LocalPoses) -> FloatArray:
    """Distance (k,) of each stretch's middle from where it was."""
    true = np.array([OFFICE_ROUTE[0] + one.middle * np.exp(1j * TURN_RAD) for one in poses.stretches])
    return np.asarray(np.abs(poses.place - true))


def test_an_exact_walk_is_placed_to_a_few_centimetres() -> None:
    odometry = exact_walk()
    poses = refined(odometry)
    assert len(poses.stretches) == len(stretches_of(odometry, LOCAL_LENGTH_M).stretches)
    error = errors_m(poses)
    assert error.mean() < 0.1
    assert error.max() < 0.15
    turned = np.abs(np.angle(np.exp(1j * (poses.yaw_rad - TURN_RAD))))
    assert turned.max() < np.radians(1.5)


def test_the_covariance_states_the_error() -> None:
    odometry = exact_walk()
    poses = refined(odometry)
    assert poses.covariance_m2.shape == (len(poses.stretches), 2, 2)
    sigma_m = np.sqrt(np.trace(poses.covariance_m2, axis1=1, axis2=2) / 2)
    assert (sigma_m > 0.02).all()
    assert (sigma_m < 0.45).all()  # a corridor is 2 m wide
    assert np.sqrt(np.mean((errors_m(poses) / sigma_m) ** 2)) < 1.5
    assert np.linalg.eigvalsh(poses.covariance_m2).min() > 0


def test_stretches_that_are_not_sure_have_no_finer_pose() -> None:
    odometry = exact_walk()
    long = stretches_of(odometry)
    sure = np.ones(len(long.stretches), dtype=np.bool_)
    sure[2] = False
    poses = refined(odometry, sure)
    gone = long.stretches[2]
    middle = frames_of(poses)
    assert not ((middle > gone.first) & (middle < gone.last)).any()
    assert len(poses.stretches) < len(stretches_of(odometry, LOCAL_LENGTH_M).stretches)
    assert errors_m(poses).max() < 0.2
    nothing = refined(odometry, np.zeros(len(long.stretches), dtype=np.bool_))
    assert (len(nothing.stretches), nothing.covariance_m2.shape) == (0, (0, 2, 2))


@pytest.mark.parametrize("sigma_m", [LOST_M + 0.1, 0.4])
def test_a_step_over_a_loss_does_not_move_what_is_beside_it(sigma_m: float) -> None:
    """From the loss on the path is 0.6 m off its place, and the known poses are not."""
    step = 330
    moved = exact_walk()
    path = moved.path.copy()
    path[step + 1 :] += 0.6 * np.exp(0.4j)
    lost = with_gap(replace(moved, path=path), step, sigma_m)
    long, short = stretches_of(lost), stretches_of(lost, LOCAL_LENGTH_M)
    truth = [
        OFFICE_ROUTE[0] + (one.middle - (0.6 * np.exp(0.4j) if one.first > step else 0)) * np.exp(1j * TURN_RAD)
        for one in (*long.stretches, *short.stretches)
    ]
    count = len(long.stretches)
    best = tuple(replace(pose, place=place) for pose, place in zip(rough(long, 0j, 0.0), truth[:count], strict=True))
    poses = local_poses(PoseGrid(office()), long, best, np.ones(count, dtype=np.bool_), short)
    assert np.abs(poses.place - np.array(truth[count:])).max() < 0.3


def test_points_beyond_the_plan_count_as_outside() -> None:
    """The edge of this plan is free, so only what is beyond it costs anything."""
    costs = WallCosts(np.zeros((40, 40), dtype=np.float32), (0.0, 0.0))
    odometry = odometry_of(along((0, 4)))
    long, short = stretches_of(odometry), stretches_of(odometry, LOCAL_LENGTH_M)
    half_out = (BestPose(4 + 2j, 0.0, 1.0, np.eye(2), 0.0),)
    poses = local_poses(PoseGrid(costs), long, half_out, np.ones(1, dtype=np.bool_), short)
    assert poses.place[0].real < 3.3  # as far inwards as it may be moved


def test_a_far_wrong_pose_stays_near_where_it_was_known() -> None:
    poses = refined(exact_walk(), off=5 + 5j)
    assert np.isfinite(poses.place).all()
    assert np.isfinite(poses.covariance_m2).all()
    assert (errors_m(poses) > 4).all()
    assert (errors_m(poses) < abs(5 + 5j) + 3).all()
