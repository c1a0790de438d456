"""What a file states of counts, extents and times never decides how much memory a command asks for."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from tests.drifting import loops
from tests.site.plans import drawn_floor
from tests.surveys import make_survey
from vislam2tag.common.errors import SurveyError
from vislam2tag.core import limits
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.limits import MAX_CELLS, MAX_CONTROL_POINTS, MAX_FLOOR_M, MAX_JOINT_LANDMARKS, MAX_PAIRS
from vislam2tag.estimation.tracker_errors import NoiseLevels
from vislam2tag.pipeline.labels.landmark_survey import join_sessions
from vislam2tag.preparation.planning.refine import sigma_map
from vislam2tag.quality.diagnosis.alignment import _some_pairs
from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk, _Cells
from vislam2tag.quality.evaluation.press_truth import estimate_lead
from vislam2tag.quality.evaluation.station_frame import read_station_track
from vislam2tag.quality.evaluation.truth import nearest_points
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.landmark_file import read_control_points
from vislam2tag.site.walkable.graph import _net_places
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.views.quality_pages import _gain_map

GB = 10**9
YEARS_200_NS = 200 * 365 * 86_400 * 10**9


def run(*arguments: str | Path, memory: int = 4 * GB) -> str:
    """All that a command prints with so much address space, of which libraries take 1 GB before it begins."""
    bounded = None
    if sys.platform == "linux":
        import resource  # Windows has none

        def bounded() -> None:
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))

    done = subprocess.run(
        [sys.executable, "-m", "vislam2tag", *map(str, arguments)],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1", "COLUMNS": "1000"},
        preexec_fn=bounded,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def peak_of(work: Callable[[], object]) -> int:
    """Most bytes that something takes at once."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def walked(root: Path) -> Path:
    return next(path.parent for path in sorted((make_survey(root, devices=("OnePlus",))).rglob("poses.csv")))


@pytest.mark.parametrize("count", [5_000, 100_000])
def test_landmarks_seen_at_one_frame_do_not_fill_the_memory(tmp_path: Path, count: int) -> None:
    walk = walked(tmp_path / "survey")
    frame = (walk / "poses.csv").read_text().splitlines()[300].split(";")
    x, y, z = (float(number.replace(",", ".")) for number in frame[1:4])
    near = np.random.default_rng(0).uniform(-1, 1, (count, 2))
    with (walk / "initPoses.csv").open("a") as file:
        file.writelines(
            f"{1000 + i};{frame[0]};{x + a:.4f};{y:.4f};{z + b:.4f};0;0;0;1\n" for i, (a, b) in enumerate(near.tolist())
        )
    printed = run("process", tmp_path / "survey", "--out", tmp_path / "out", "--jobs", "1", memory=3 * GB)
    assert "MemoryError" not in printed
    assert "1 session (0 failed)" in printed
    assert "too_many_landmarks" in printed
    kept = "".join(path.read_text() for path in (tmp_path / "out").rglob("*.json"))
    assert re.search(rf"{count // 1000},\d+ landmarks are logged, but a session may have at most 1,000", kept)


def test_one_time_200_years_later_is_left_out(tmp_path: Path) -> None:
    walk = walked(tmp_path / "survey")
    for name in ("poses.csv", "sensors.csv"):
        lines = (walk / name).read_text().splitlines()
        far = [f"{int(time) + YEARS_200_NS};{rest}" for time, rest in (line.split(";", 1) for line in lines[-60:])]
        (walk / name).write_text("\n".join([*lines, *(far[-1:] if name == "poses.csv" else far)]) + "\n")
    printed = run("process", tmp_path / "survey", "--out", tmp_path / "out", "--jobs", "1")
    assert "MemoryError" not in printed
    assert "far_times 61" in printed
    assert "frames labelled: 0.0 %" not in printed


@pytest.mark.parametrize("command", [("site", "walkable"), ("plan",)])
def test_a_plan_that_is_said_to_be_500_km_wide_is_one_message(tmp_path: Path, command: tuple[str, ...]) -> None:
    site = tmp_path / "site"
    (site / "floor_0").mkdir(parents=True)
    plan = drawn_floor.dxf(site)
    drawing = ezdxf.readfile(plan)  # type: ignore[attr-defined]
    drawing.modelspace().add_line((5e8, 0), (5e8, 1000), dxfattribs={"layer": "A-WALL"})
    drawing.saveas(plan)
    (site / "floor_0" / "marker_dict.csv").write_text("id,x,y\n1,2.0,2.0\n2,15.0,2.5\n")
    (site / "site.toml").write_text(
        '[[floors]]\nnumber = 0\n[floors.plan]\nfile = "plan.dxf"\narea = [-1, -1, 6e8, 2e4]\nunit_m = 0.001\n'
    )
    printed = run(*command, site, "--out", tmp_path / "out")
    assert "plan.dxf: the plan of floor 0 is 500000 m wide" in printed
    assert "a side may be 1 to 10000 m long" in printed


def large_hall() -> WalkableSpace:
    """10 km by 10 km in cells of 5 m, as :data:`MAX_CELLS` makes them."""
    side = int(MAX_FLOOR_M / 5)
    mask = np.ones((side, side), dtype=np.bool_)
    return WalkableSpace(WalkableArea(mask, (0.0, 0.0), 5.0), np.empty((0, 2, 2)))


def test_the_largest_floor_has_no_larger_map_than_any() -> None:
    assert sigma_map(large_hall(), []).grid.rows ** 2 <= 1.01 * MAX_CELLS


def test_the_net_over_the_largest_hall_is_wide() -> None:
    space = large_hall()
    assert len(_net_places(space.area.mask, space, 6.0 * 5.0)) < 200_000


def test_one_gain_far_away_is_not_drawn() -> None:
    gains = {**{(x, y): 0.1 for x in range(5) for y in range(5)}, (2_000_000, -2_000_000): 0.1}
    assert peak_of(lambda: _gain_map(gains)) < 10_000_000


def test_ways_far_apart_are_compared_in_larger_cells() -> None:
    names = np.array([f"ap{n}" for n in range(1000)])
    none = np.zeros(1000)
    far = HeardOnWalk(none, none.astype(np.int64), names, none, np.arange(2.0), np.array((0j, 1e5 + 1e5j)))
    assert np.prod(_Cells.of([far]).shape) < 1.1 * limits.MAX_LEVEL_CELLS
    near = replace(far, way=np.array((0j, 100 + 100j)))
    assert _Cells.of([near]).cell_m == 1.0


def test_a_station_track_leaves_out_a_time_of_another_century(tmp_path: Path) -> None:
    rows = "".join(f"2022-01-14 16:01:{second:02}.00;1.0;2.0\n" for second in range(30))
    (tmp_path / "tachy.csv").write_text(f"time;X;Y\n{rows}2222-01-14 16:01:04.00;1.0;2.0\n")
    track = read_station_track(tmp_path / "tachy.csv")
    assert len(track.time_ns) == 30
    assert track.left_out == 1


def test_more_control_points_than_a_floor_has_are_refused(tmp_path: Path) -> None:
    (tmp_path / "refmarker.csv").write_text("1.0,2.0\n" * (MAX_CONTROL_POINTS + 1))
    points, findings = read_control_points(tmp_path, tmp_path)
    assert not points.ids
    assert findings[-1].file == "refmarker.csv"
    assert findings[-1].message == "2,001 control points, but a floor may have at most 2,000; none is used"


def test_many_presses_are_not_compared_all_at_once() -> None:
    rng = np.random.default_rng(0)
    places, points = rng.uniform(0, 100, (20_000, 2)), rng.uniform(0, 100, (2_000, 2))
    assert peak_of(lambda: nearest_points(places, points)) < 200_000_000
    assert peak_of(lambda: estimate_lead(rng.normal(0, 1, 3_000), np.ones(3_000))) < 10_000_000


def test_pairs_of_passes_are_bounded_and_all_of_few() -> None:
    first, second = _some_pairs(100_000)
    assert len(first) <= MAX_PAIRS
    assert (first < second).all()
    assert len(_some_pairs(30)[0]) == 30 * 29 // 2


def test_landmarks_passed_once_go_before_what_ties_the_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    observations = loops(
        3,
        NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03),
        marks=10,
        laps=1.2,
    ).observations()
    assert observations.within_limits(()) is observations
    often = np.flatnonzero(np.bincount(observations.passes.landmark, minlength=10) > 1)
    count = np.isin(observations.passes.landmark, often)
    monkeypatch.setattr("vislam2tag.estimation.observations.MAX_SOLVER_BLOCKS", count.sum() * len(often) ** 2)
    less = observations.within_limits(())
    assert less.ids == tuple(observations.ids[i] for i in often)
    assert less.passes_left_out == (~count).sum()
    assert [less.ids[i] for i in less.passes.landmark] == [
        observations.ids[i] for i in observations.passes.landmark[count]
    ]
    monkeypatch.setattr("vislam2tag.estimation.observations.MAX_SOLVER_BLOCKS", 3 * len(often) ** 2)
    assert len(observations.within_limits(()).passes.at) == 3


def test_more_landmarks_than_can_be_placed_together_are_refused(tmp_path: Path) -> None:
    root = make_survey(tmp_path / "survey", devices=("LG",))
    with (root / "floor_0" / "marker_dict.csv").open("a") as file:
        file.writelines(f"{1000 + i},{i % 50}.5,{i % 20}.5\n" for i in range(MAX_JOINT_LANDMARKS))
    with pytest.raises(SurveyError, match=r"have 6,012 landmarks, but at most 6,000 can be placed together"):
        join_sessions(open_survey(root, 0.05), [], 0.05)
