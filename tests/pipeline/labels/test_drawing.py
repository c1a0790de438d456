"""What a report draws of a walk: thinned, in runs of one status, each on its floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tests.drifting import nothing_logged
from tests.pipeline.labels.mapped import walk
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, Landmarks, Trajectory
from vislam2tag.labeling.results import Drawing
from vislam2tag.pipeline.labels.drawing import MAX_EXTENT_M, SPACING_M, draw

OK, UNCERTAIN, LOST = Status.OK, Status.UNCERTAIN, Status.TRACKING_LOST
NO_SCAN = pl.DataFrame(schema={"scan": pl.Int64, "x": pl.Float64, "y": pl.Float64, "floor": pl.Int32})


def no_landmarks() -> Landmarks:
    none = np.empty(0)
    return Landmarks((), np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty((0, 2, 2)), none, none, none)


def drawn(camera: CameraTrack, trajectory: Trajectory, wifi: pl.DataFrame = NO_SCAN) -> dict[int, Drawing]:
    return draw(1, camera, nothing_logged(), no_landmarks(), trajectory, wifi)


def test_runs_of_one_status_are_drawn_each_with_its_sigmas() -> None:
    camera, trajectory = walk(np.arange(6.0), [OK, OK, UNCERTAIN, UNCERTAIN, LOST, OK])
    trajectory.covariance_bcs[5] = np.nan
    found = drawn(camera, trajectory)[1]
    assert [(run.status, [x for x, _ in run.points], run.sigma_m) for run in found.mapped] == [
        ("ok", [0.0, 1.0], [0.1, 0.1]),
        ("uncertain", [2.0, 3.0], [0.1, 0.1]),
        ("ok", [5.0], []),
    ]
    # What is not mapped is laid over the floor by the frames that are, up to where mapping goes on.
    (lost,) = found.discarded
    assert (lost.status, lost.points) == ("tracking_lost", [(4.0, 10.0), (5.0, 10.0)])
    assert found.raw == [(float(second), 10.0) for second in range(6)]


def test_points_are_drawn_about_as_far_apart_as_said_and_never_too_far_out() -> None:
    camera, trajectory = walk(np.arange(0, 20, 0.05), [OK] * 400)
    trajectory.position_bcs[100] = MAX_EXTENT_M + 1
    (run,) = drawn(camera, trajectory)[1].mapped
    points = np.array(run.points)
    assert len(points) == pytest.approx(20 / SPACING_M, abs=2)
    assert points.max() < MAX_EXTENT_M
    assert points[[0, -1], 0].tolist() == [0.0, 19.95]


def test_each_floor_has_its_own_and_the_raw_path_lies_on_the_sessions() -> None:
    camera, trajectory = walk(np.arange(4.0), [OK] * 4)
    wifi = pl.DataFrame(
        {"scan": [7, 7, 8], "x": [1.0, 2.0, None], "y": [10.0, 10.0, None], "floor": [2, 2, 1]},
        schema=NO_SCAN.schema,
    )
    found = drawn(camera, replace(trajectory, floor=np.array([1, 1, 2, 2])), wifi)
    assert [len(found[floor].mapped) for floor in (1, 2)] == [1, 1]
    assert found[2].mapped[0].points == [(2.0, 10.0), (3.0, 10.0)]
    assert (len(found[1].raw), found[2].raw) == (4, [])
    assert (found[1].wifi, found[2].wifi) == ([], [(1.5, 10.0)])


def test_without_mapped_frames_and_landmarks_nothing_is_laid_over_the_floor() -> None:
    camera, trajectory = walk(np.arange(4.0), [LOST] * 4)
    found = drawn(camera, trajectory)[1]
    assert (found.mapped, found.discarded, found.raw) == ([], [], [])
