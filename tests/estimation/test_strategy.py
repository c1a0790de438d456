"""Sessions in which the tracker began anew: each part is mapped on its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, about_vertical, loops
from tests.walks import to_acs
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.context import TrackerState
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, longest_section, section_numbers
from vislam2tag.core.transforms import as_complex, as_points, multiply
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named


def anew(camera: CameraTrack, log: LandmarkLog, later: BoolArray) -> tuple[CameraTrack, LandmarkLog]:
    """From the frames of a mask on the tracker has another origin and heading, and knows no landmark of before."""
    turn = 2.2
    camera = replace(camera, position_acs=camera.position_acs.copy(), orientation_acs=camera.orientation_acs.copy())
    log = replace(log, position_acs=log.position_acs.copy(), orientation_acs=log.orientation_acs.copy())
    for part, which in ((camera, later), (log, later[log.frame])):
        plane = as_complex(part.plane_acs[which]) * np.exp(1j * turn) + (30 - 12j)
        part.position_acs[which] = to_acs(as_points(plane), part.position_acs[which, 1])
        part.orientation_acs[which] = multiply(about_vertical(np.array([turn])), part.orientation_acs[which])
    tracking = np.ones(len(later), dtype=bool)
    state = TrackerState(tracking, later.astype(np.int64), ("NONE",), np.zeros(len(later), dtype=np.int64))
    return replace(camera, state=state), log


@pytest.fixture(scope="module")
def walk() -> Drifting:
    return loops(3, marks=6, laps=2, rate_hz=10.0)


@pytest.mark.parametrize("name", ["smoother", "local-corrected", "global"])
def test_both_parts_are_mapped_as_if_each_were_a_session(walk: Drifting, name: str) -> None:
    camera, log = walk.logged()
    strategy = strategy_named(name, MappingSettings(visit_radius_m=4.0))
    half = len(camera.time_ns) // 2
    later = np.arange(len(camera.time_ns)) >= half
    split_camera, split_log = anew(camera, log, later)
    mapped = strategy.map(split_camera, split_log, walk.landmarks())
    for part, inside in ((0, ~later), (1, later)):
        status = np.where(inside, split_camera.status, np.int8(Status.INVALID)).astype(np.int8)
        alone = strategy.map(
            replace(split_camera, status=status, state=None),
            split_log.rows_kept(inside[split_log.frame]),
            walk.landmarks(),
        )
        np.testing.assert_array_equal(mapped.status[inside], alone.status[inside], err_msg=f"part {part}")
        np.testing.assert_allclose(mapped.position_bcs[inside], alone.position_bcs[inside])
        assert (alone.status[inside] == Status.OK).any()
    frames = [visit.frame for visit in mapped.visits]
    assert frames == sorted(frames)
    assert min(frames) < half <= max(frames)


def test_frames_near_the_seam_are_true(walk: Drifting) -> None:
    camera, log = walk.logged()
    half = len(camera.time_ns) // 2
    later = np.arange(len(camera.time_ns)) >= half
    strategy = strategy_named("smoother", MappingSettings())
    whole = strategy.map(camera, log, walk.landmarks())
    mapped = strategy.map(*anew(camera, log, later), walk.landmarks())
    apart = np.linalg.norm(mapped.position_bcs[:, :2] - whole.position_bcs[:, :2], axis=1)
    assert np.quantile(apart, 0.95) < 0.5


def test_a_session_in_one_part_is_mapped_as_ever(walk: Drifting) -> None:
    camera, log = walk.logged()
    told = replace(camera, state=None)
    for each in (camera, told):
        assert section_numbers(each).tolist() == [0]
        assert longest_section(each, log) == (each, log)


def test_the_longest_part_is_the_one_with_most_frames(walk: Drifting) -> None:
    camera, log = walk.logged()
    later = np.arange(len(camera.time_ns)) >= len(camera.time_ns) // 3
    camera, log = anew(camera, log, later)
    assert section_numbers(camera).tolist() == [0, 1]
    chosen, kept = longest_section(camera, log)
    np.testing.assert_array_equal(chosen.usable, later)
    assert later[kept.frame].all()
    assert len(kept.frame) == int(later[log.frame].sum())
