"""Which stretches are certain enough, and the reason of each that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import along, odometry_of
from vislam2tag.core.status import Status
from vislam2tag.estimation.floor_plan.acceptance import WalkFit, judged, misfit_of
from vislam2tag.estimation.floor_plan.posterior import BestPose
from vislam2tag.estimation.floor_plan.stretches import stretches_of

GOOD = WalkFit(misfit=0.1, mirror=12.0, exchanged=8.0, floors={1: 4.0}, open_share=0.01, way_m=150.0)


def pose(mass: float, fit: float = -0.1) -> BestPose:
    return BestPose(0j, 0.0, mass, np.eye(2), fit)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, Status.OK),
        ({"misfit": 0.26}, Status.FITS_NOWHERE),
        ({"misfit": 0.26, "mirror": -5.1}, Status.FITS_MIRROR),
        ({"mirror": 3.9}, Status.FITS_MIRROR),
        ({"mirror": -30.0}, Status.FITS_MIRROR),
        ({"misfit": 0.2, "mirror": 5.4}, Status.FITS_MIRROR),
        ({"misfit": 0.2, "mirror": 5.6}, Status.OK),
        ({"exchanged": 0.9}, Status.FITS_NOWHERE),
        ({"floors": {1: 4.0, 2: 0.4}}, Status.FITS_OTHER_FLOOR),
        ({"floors": {1: -40.0}}, Status.FITS_OTHER_FLOOR),
        ({"floors": {}}, Status.OK),
    ],
)
def test_a_walk_is_refused_for_one_reason(changes: dict[str, float], reason: Status) -> None:
    assert replace(GOOD, **changes).refusal() is reason  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, Status.AMBIGUOUS),
        ({"way_m": 59.0}, Status.TOO_SHORT),
        ({"open_share": 0.16}, Status.PLAN_TOO_OPEN),
        ({"open_share": 0.16, "way_m": 30.0}, Status.PLAN_TOO_OPEN),
    ],
)
def test_several_places_have_a_reason(changes: dict[str, float], reason: Status) -> None:
    assert replace(GOOD, **changes).vague() is reason  # type: ignore[arg-type]


def test_each_stretch_of_an_accepted_walk_counts_by_its_own_mass_and_fit() -> None:
    poses = [pose(0.995), pose(0.985), pose(0.999, fit=-2.6), pose(0.5, fit=-2.6)]
    expected = [Status.OK, Status.AMBIGUOUS, Status.FITS_NOWHERE, Status.AMBIGUOUS]
    assert judged(GOOD, poses).tolist() == expected
    assert judged(replace(GOOD, way_m=40.0), poses)[1] == Status.TOO_SHORT


@pytest.mark.parametrize(
    ("changes", "sure", "unsure"),
    [
        ({"mirror": 2.0}, Status.FITS_MIRROR, Status.AMBIGUOUS),
        ({"floors": {1: 0.0}}, Status.FITS_OTHER_FLOOR, Status.AMBIGUOUS),
        ({"mirror": 2.0, "open_share": 0.5}, Status.FITS_MIRROR, Status.PLAN_TOO_OPEN),
        ({"misfit": 1.0}, Status.FITS_NOWHERE, Status.FITS_NOWHERE),
    ],
)
def test_no_stretch_of_a_refused_walk_counts(changes: dict[str, float], sure: Status, unsure: Status) -> None:
    fit = replace(GOOD, **changes)  # type: ignore[arg-type]
    assert judged(fit, [pose(1.0), pose(0.6), pose(0.4)]).tolist() == [sure, sure, unsure]


def test_the_misfit_is_the_cost_of_ten_metres() -> None:
    walk = stretches_of(odometry_of(along((0, 48))))
    assert misfit_of(walk, [pose(1.0, fit) for fit in (-1.0, 0.0, -0.5, -1.0)]) == pytest.approx(25 / walk.way_m)
