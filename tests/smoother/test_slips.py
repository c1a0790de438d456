"""Slips between two passes: reported where the tracker led far off, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from vislam2tag.core.faults import EventKind, TrackerEvent
from vislam2tag.smoother.landmark_priors import KnownLandmarks
from vislam2tag.smoother.noise import Noise
from vislam2tag.smoother.observations import Walked
from vislam2tag.smoother.slips import slips
from vislam2tag.smoother.smoothing import smooth

TYPICAL = Noise(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def found(walk: Drifting, walked: Walked) -> tuple[TrackerEvent, ...]:
    smoothed = smooth(walked, KnownLandmarks.of(walk.ids, walk.landmarks()))
    assert smoothed is not None
    return slips(smoothed)


def slipped(walked: Walked, step: int, by: complex) -> Walked:
    """Lead all frames after a step elsewhere, without any trace in the odometry."""
    path = walked.odometry.path.copy()
    path[step + 1 :] += by
    return replace(walked, odometry=replace(walked.odometry, path=path))


def test_usual_drift_is_no_slip() -> None:
    for seed in range(5):
        walk = loops(seed, TYPICAL, marks=8, laps=2, survey_m=0.02)
        assert found(walk, walk.walked()) == ()


@pytest.mark.parametrize("by", [1.5 + 0j, -2.0 + 2.0j])
def test_a_slip_is_found_in_its_stretch_with_its_size(by: complex) -> None:
    walk = loops(6, TYPICAL, marks=8, laps=2, survey_m=0.02)
    walked = walk.walked()
    step = int(walked.nodes[6:8].mean())
    (event,) = found(walk, slipped(walked, step, by))
    assert event.kind is EventKind.SLIP
    assert walked.nodes[6] <= event.frame <= walked.nodes[7]
    assert event.size_m == pytest.approx(abs(by), abs=0.4)


def test_a_doubtful_step_says_when_it_happened_and_a_known_jump_is_not_told_twice() -> None:
    walk = loops(7, TYPICAL, marks=8, laps=2, survey_m=0.02)
    walked = walk.walked()
    step = int(walked.nodes[6]) + 10
    doubt = np.zeros(len(walked.odometry.path) - 1, dtype=np.complex128)
    doubt[step] = 0.01j
    walked = slipped(walked, step, 2.0j)
    (event,) = found(walk, replace(walked, odometry=replace(walked.odometry, doubt=doubt)))
    assert event.frame == step + 1
    known = replace(walked.odometry, doubt=doubt, jumped=doubt != 0)
    assert found(walk, replace(walked, odometry=known)) == ()


def test_a_larger_doubt_across_does_not_say_when() -> None:
    walk = loops(7, TYPICAL, marks=8, laps=2, survey_m=0.02)
    walked = walk.walked()
    across, step = int(walked.nodes[6]) + 4, int(walked.nodes[6]) + 10
    doubt = np.zeros(len(walked.odometry.path) - 1, dtype=np.complex128)
    doubt[across], doubt[step] = 0.7, 0.6j
    walked = slipped(walked, step, 2.0j)
    (event,) = found(walk, replace(walked, odometry=replace(walked.odometry, doubt=doubt)))
    assert event.frame == step + 1
