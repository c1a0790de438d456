"""A walk reduced to a map of its landmarks."""

from __future__ import annotations

import numpy as np
import pytest

from tests.walks import corridor_walk
from vislam2tag.core.similarity import Similarity2
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.smoothing import smooth_in_own_frame

STATIONS = {"a": (5.0, 0.5), "b": (15.0, -0.5), "c": (30.0, 0.6)}


@pytest.fixture(name="local", scope="module")
def _local() -> LocalMap:
    bcs_t_acs = Similarity2(complex(np.exp(0.7j)), 3 - 2j)
    camera, log, _, _ = corridor_walk(bcs_t_acs, STATIONS)
    return LocalMap.of(smooth_in_own_frame(WalkObservations.of(camera, log, 6.0)))


def test_landmarks_lie_as_in_the_building_but_for_turn_and_place(local: LocalMap) -> None:
    true = np.array([complex(*place) for place in STATIONS.values()])
    assert np.abs(np.diff(local.position)) == pytest.approx(np.abs(np.diff(true)), abs=1e-3)
    assert local.passes.tolist() == [1, 1, 1]


def test_landmarks_farther_along_the_walk_are_less_certain(local: LocalMap) -> None:
    variance = np.diag(local.covariance)[:6].reshape(3, 2).sum(axis=1)
    assert variance[0] < variance[1] < variance[2]
    assert np.linalg.eigvalsh(local.covariance[:6, :6]).min() > 0


def test_a_selection_keeps_what_belongs_together(local: LocalMap) -> None:
    last = local.select(np.array([False, False, True]))
    assert last.position.tolist() == local.position[2:].tolist()
    assert last.covariance.tolist() == local.covariance[np.ix_([4, 5, 8], [4, 5, 8])].tolist()


def test_headings_that_nobody_logged_are_not_observed(local: LocalMap) -> None:
    unlogged = LocalMap(local.landmark, local.position, np.full(3, np.nan), local.covariance, local.passes)
    assert unlogged.observed.tolist() == list(range(6))
