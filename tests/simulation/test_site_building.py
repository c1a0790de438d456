from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.site.walkable.hand_made import CORRIDOR, HEIGHT_M, MARGIN_M, WIDTH_M, plan, rectangles
from vislam2tag.cli import main
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.settings import TrackerSettings, WalkSettings
from vislam2tag.simulation.site_building import (
    PASSED_M,
    SiteFloor,
    site_building,
    site_floors,
    site_paths,
)
from vislam2tag.simulation.tracker import track
from vislam2tag.simulation.walk import make_walk
from vislam2tag.site.discover import read_site
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.graph import NodeKind, corridor_graph
from vislam2tag.site.walkable.space import walkable_space

WIDE = rectangles(40, 12, (1, 2, 39, 9))
"""One corridor, 7 m wide."""
SHEETS = np.array([(12.0, 2.0), (30.0, 9.0)])
HEADING_RAD = np.array([np.pi, 0.0])
"""The sheet on the lower wall faces upwards: to the right of who looks at it is the left of the plan."""


def distance_to_ways(nodes: np.ndarray, edges: np.ndarray, point: np.ndarray) -> float:
    start, leg = nodes[edges[:, 0]], nodes[edges[:, 1]] - nodes[edges[:, 0]]
    share = (((point - start) * leg).sum(axis=1) / (leg**2).sum(axis=1)).clip(0, 1)
    return float(np.linalg.norm(start + share[:, None] * leg - point, axis=1).min())


def test_ways_lead_past_sheets_off_the_middle() -> None:
    ways = site_paths(corridor_graph(WIDE), WIDE, SHEETS, HEADING_RAD)
    assert not ways.missed
    for sheet in SHEETS:
        assert distance_to_ways(ways.nodes, ways.edges, sheet) < 1.0
    joined = ways.nodes[ways.edges]
    assert WIDE.clear_line(joined[:, 0], joined[:, 1]).all()


def test_ways_that_pass_anyway_stay() -> None:
    narrow = rectangles(40, 6, (1, 2, 39, 4))
    graph = corridor_graph(narrow)
    ways = site_paths(graph, narrow, np.array([(12.0, 2.0)]), np.array([np.pi]))
    assert len(ways.nodes) == len(graph.nodes) + sum(len(line) - 2 for line in graph.polylines)
    assert distance_to_ways(ways.nodes, ways.edges, np.array([12.0, 2.0])) < PASSED_M


def test_a_sheet_behind_a_wall_is_missed() -> None:
    ways = site_paths(corridor_graph(WIDE), WIDE, np.array([(12.0, 0.5)]), np.array([0.0]))
    assert ways.missed == (0,)


def test_rooms_and_their_doors_are_told() -> None:
    space = walkable_space(plan())
    graph = corridor_graph(space)
    ways = site_paths(graph, space, np.empty((0, 2)), np.empty(0))
    for node, kind in enumerate(graph.kinds):
        assert (node in ways.rooms) == (kind in (NodeKind.ROOM, NodeKind.DOOR))


LOW, HIGH = CORRIDOR
PLACES = np.array([(2.0, LOW + 0.1), (8.5, HIGH - 0.1), (16.0, HIGH - 0.1), (22.0, LOW + 0.1), (12.0, 0.1)])
"""Four sheets in the corridor and one in the hall."""


def landmarks(places: FloatArray = PLACES) -> Landmarks:
    unknown = np.full(len(places), np.nan)
    ids = tuple(str(number) for number in range(1, len(places) + 1))
    covariance = np.broadcast_to(0.02**2 * np.eye(2), (len(places), 2, 2))
    return Landmarks(ids, np.zeros(len(places), dtype=np.int64), places, covariance, unknown, unknown, unknown)


@cache
def floor() -> SiteFloor:
    drawn = plan()
    space = walkable_space(drawn)
    width_m = np.full(len(PLACES), np.nan)
    return SiteFloor(0, "Ground", drawn.extent_m, None, space, corridor_graph(space), landmarks(), width_m)


def walk(seed: int = 0, minutes: float = 4) -> TrueWalk:
    return make_walk(site_building([floor()], 7).floors[0], minutes * 60, WalkSettings(), np.random.default_rng(seed))


def test_headings_that_nobody_knows_are_those_of_the_walls() -> None:
    (made,) = site_building([floor()], 7).floors
    heading = np.exp(1j * made.landmark_heading_rad)
    assert heading.real == pytest.approx([-1, 1, 1, -1, -1], abs=0.05)  # seen from the corridor, right is x or -x
    assert made.landmark_position[:, 2] == pytest.approx(1.4, abs=0.2)
    assert made.lower_left_m == (-MARGIN_M, -MARGIN_M)


def test_floors_are_drawn_by_their_own_numbers() -> None:
    alone = site_building([floor()], 7)
    both = site_building([floor(), replace(floor(), number=1)], 7)
    assert (both.floors[0].control_points == alone.floors[0].control_points).all()
    assert (both.ap_position[: len(alone.ap_position)] == alone.ap_position).all()
    assert both.floors[1].elevation_m == pytest.approx(3.6)
    assert len(alone.ap_bssid) == 6


def test_walks_keep_within_the_floor_and_pass_the_sheets() -> None:
    walked = walk()
    assert floor().space.inside(walked.position[:, :2]).mean() > 0.999
    assert len(np.unique(walked.landmarks_passed)) >= 4


def test_the_tracker_sees_sheets_but_not_through_walls() -> None:
    (made,) = site_building([floor()], 7).floors
    walked = walk()
    log = track(walked, made, TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert len(set(log.landmarks.ids)) >= 4
    # Behind the wall that each of the corridor's sheets hangs on, turned to the corridor and near enough.
    moved = made.landmark_position.copy()
    moved[:4, 1] += (-0.6, 0.6, 0.6, -0.6)
    behind = replace(made, landmark_position=moved)
    hidden = track(walked, behind, TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert set(hidden.landmarks.ids) <= {"5"}
    unwalled = track(walked, replace(behind, space=None), TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert len(set(unwalled.landmarks.ids)) > 2


def test_larger_sheets_are_seen_from_farther() -> None:
    (made,) = site_building([replace(floor(), width_m=np.full(len(PLACES), 0.4))], 7).floors
    assert made.sheet_reach == pytest.approx(0.4 / 0.19)


def test_thin_walls_are_one_wall_for_radio() -> None:
    (made,) = site_building([floor()], 7).floors
    middle = made.walls.mean(axis=1)
    inner = (np.abs(middle[:, 1] - LOW) < 0.3) & (np.abs(np.diff(made.walls, axis=1)[:, 0, 0]) > 3)
    assert inner.sum() == 2  # one face on each side of the gate


def test_too_few_landmarks_are_told() -> None:
    with pytest.raises(SurveyError, match="has 1 landmarks"):
        site_building([replace(floor(), landmarks=landmarks(PLACES[:1]))], 7)


def test_a_landmark_outside_is_named() -> None:
    places = np.vstack((PLACES, [(WIDTH_M + 5, HEIGHT_M)]))
    with pytest.raises(SurveyError, match=r"landmark 6 at \(29\.00, 20\.00\)"):
        site_building([replace(floor(), landmarks=landmarks(places))], 7)


SIZE = f"{WIDTH_M + 2 * MARGIN_M},{HEIGHT_M + 2 * MARGIN_M}"
LANDMARKS = "id,x,y,heading_rad\n" + "".join(
    f"{n},{x},{y},{h}\n"
    for n, (x, y, h) in enumerate([(3.0, 11.1, 3.14), (9.5, 13.1, 0.0), (17.0, 13.1, 0.0), (23.0, 11.1, 3.14)], start=1)
)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    root = tmp_path / "site"
    (root / "floor_2").mkdir(parents=True)
    (root / "floor_dimensions.csv").write_text(f"id,width,height\n2,{SIZE}\n")
    (root / "floor_2" / "marker_dict.csv").write_text(LANDMARKS)
    Image.fromarray(plan(10).image).save(root / "floor_2" / "floorplan.png")
    return root


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["vislam2tag", "simulate", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_a_survey_on_a_site_takes_over_its_plan_and_landmarks(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "survey"
    assert run(monkeypatch, str(out), "--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.5") == 0
    simulated, findings = read_site(out)
    assert not findings
    original, _ = read_site(site)
    assert simulated.landmarks.position_bcs == pytest.approx(original.landmarks.position_bcs)
    plan_file = out / "floor_2" / "floorplan.png"
    assert plan_file.read_bytes() == (site / "floor_2" / "floorplan.png").read_bytes()
    truth = np.genfromtxt(next(out.rglob("truth.csv")), delimiter=",", names=True)
    assert 1 < truth["x"].min() < truth["x"].max() < 25


def test_the_same_options_give_the_same_bytes(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ("--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.25", "--seed", "5")
    for name in ("one", "two"):
        assert run(monkeypatch, str(tmp_path / name), *options) == 0
    for path in (tmp_path / "one").rglob("*.csv"):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()


def test_a_described_site_is_taken_over_as_such(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (site / "floor_dimensions.csv").unlink()
    extent = f"extent = {{ width_m = {SIZE.split(',')[0]}, height_m = {SIZE.split(',')[1]}, lower_left_m = [-50, 30] }}"
    plan_table = f'[floors.plan]\nfile = "floor_2/floorplan.png"\n{extent}\n'
    (site / "site.toml").write_text(f"[[floors]]\nnumber = 2\nelevation_m = 8.0\n\n{plan_table}")
    moved = LANDMARKS.splitlines()
    rows = [row.split(",") for row in moved[1:]]
    text = "\n".join([moved[0], *(f"{n},{float(x) - 50},{float(y) + 30},{h}" for n, x, y, h in rows)])
    (site / "floor_2" / "marker_dict.csv").write_text(text + "\n")
    out = tmp_path / "survey"
    assert (
        run(monkeypatch, str(out), "--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.25") == 0
    )
    assert (out / "site.toml").read_bytes() == (site / "site.toml").read_bytes()
    assert not (out / "floor_dimensions.csv").exists()
    truth = np.genfromtxt(next(out.rglob("truth.csv")), delimiter=",", names=True)
    assert -50 < truth["x"].min() < truth["x"].max() < -24


def test_landmarks_of_a_plan_replace_the_sites_own(site: Path, tmp_path: Path) -> None:
    planned = tmp_path / "landmarks.csv"
    planned.write_text(
        "id,floor,x,y,z,heading_rad,sheet,width_m\n7,2,3,11.1,1.4,3.14,A3,0.277\n8,2,17,13.1,1.4,0,A4,0.19\n"
    )
    (floor,) = site_floors(site, landmark_file=planned)
    assert floor.landmarks.ids == ("7", "8")
    assert floor.width_m.tolist() == [0.277, 0.19]


def test_a_mask_corrects_one_floor(site: Path, tmp_path: Path) -> None:
    mask = np.full((22, 26, 3), 255, dtype=np.uint8)
    mask[-10:] = (255, 0, 0)
    Image.fromarray(mask).save(tmp_path / "mask.png")
    (free,), (masked,) = site_floors(site), site_floors(site, masks={2: tmp_path / "mask.png"})
    assert masked.space.area.mask.sum() < free.space.area.mask.sum()


def test_settings_of_walkable_space_count(site: Path) -> None:
    (floor,) = site_floors(site, settings=WalkableSettings(cell_m=0.25))
    assert floor.space.area.cell_m == 0.25


def test_a_floor_that_is_not_there_is_told(site: Path) -> None:
    with pytest.raises(SurveyError, match="has no floor 3; it has: 2"):
        site_floors(site, [3])


@pytest.mark.parametrize("options", [("--like", "paper"), ("--climb", "stairs"), ("--mask", "x.png")])
def test_options_that_contradict_each_other(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), "--site", str(site), *options) == 2


def test_options_of_a_site_need_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), "--floor", "2") == 2
