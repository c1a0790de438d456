"""Second thoughts about a site, as its users have them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from ezdxf.entities.dxfgfx import DXFGraphic
from ezdxf.filemanagement import readfile

from tests.cli.command import the_error, vislam2tag
from tests.cli.three_plans import draw
from tests.surveys import bytes_of
from vislam2tag.pipeline.labels.walked_floors import floor_areas
from vislam2tag.preparation.sheets.sheet_requests import requested_sheets
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.discover import read_site
from vislam2tag.site.site_file import read_site_file


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plans")
    draw(folder)
    return folder


@pytest.fixture(scope="module")
def planned(plans: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site with one floor whose landmarks are planned; the plan's folder is beside it."""
    site = tmp_path_factory.mktemp("planned") / "site"
    words = ("--plan", plans / "second.dxf", "--floor", "1", "--name", "First floor", "--building", "Town hall")
    assert vislam2tag("site", "init", site, *words).returncode == 0
    done = vislam2tag("plan", site, "--further", "0", "--write", "--out", site.parent / "plan")
    assert done.returncode == 0, done.stderr
    return site


@pytest.fixture
def site(planned: Path, tmp_path: Path) -> Path:
    shutil.copytree(planned, tmp_path / "site")
    return tmp_path / "site"


@pytest.mark.usefixtures("undrawn_figures")
def test_sheets_name_building_floor_and_nearest_room(planned: Path) -> None:
    table = planned.parent / "plan" / "landmarks.csv"
    rows = pl.read_csv(table)
    assert set(rows["near"].to_list()) <= {f"room 0.{number:02d}" for number in range(1, 11)}
    assert "room 0.0" in (planned.parent / "plan" / "index.html").read_text()
    for source in (table, planned):
        for one in requested_sheets(source, None)[0]:
            assert (one.building, one.floor, one.floor_name) == ("Town hall", 1, "First floor")
            assert one.near.startswith("room 0.")


def test_name_elevation_building_size_and_place_are_set(site: Path, plans: Path) -> None:
    done = vislam2tag("site", "set", site, "--name", "Ground", "--elevation-m", "3.5", "--building", "Hall")
    assert (done.returncode, done.stderr) == (0, "")
    assert "the building is called Hall now\nfloor 1: name, elevation_m changed\n" in done.stdout
    assert done.stdout.endswith(f"next: vislam2tag site show {site}\n")
    done = vislam2tag("site", "set", site, "--floor", "1", "--lower-left", "5,-2")  # its scale is in the file
    assert "were planned for the plan as it was: plan again with --restart" in done.stdout
    assert done.stdout.endswith(f"next: vislam2tag plan {site} --restart --out plan --write\n")
    floor = read_site(site)[0].floor(1)
    assert (floor.name, floor.elevation_m, read_site_file(site).name) == ("Ground", 3.5, "Hall")
    assert floor.extent_m == pytest.approx((5, 45, -2, 14))
    init = ("site", "init", site, "--plan", plans / "first.pdf", "--floor", "2", "--scale", "1:200")
    assert vislam2tag(*init, "--lower-left", "5,-2").returncode == 0
    done = vislam2tag("site", "set", site, "--floor", "2", "--width-m", "80", "--json")
    assert json.loads(done.stdout)["done"][0] == "floor 2: plan changed"
    left, right, low, _ = read_site(site)[0].floor(2).extent_m or (0, 0, 0, 0)
    assert (left, right, low) == pytest.approx((5, 85, -2)), "another size keeps the corner and the part of the page"
    plan = read_site_file(site).floors[1].plan
    assert plan is not None
    assert plan.area is not None
    vislam2tag("site", "set", site, "--floor", "2", "--lower-left", "1,2")
    assert (read_site(site)[0].floor(2).extent_m or ())[::2] == pytest.approx((1, 2))


def test_a_number_of_a_floor_is_whole(site: Path) -> None:
    done = vislam2tag("site", "renumber", site, "1", "EG")
    assert (done.returncode, "'new': 'EG' is not a whole number" in done.stderr) == (2, True)


def test_chosen_layers_are_taken_back(site: Path) -> None:
    before = read_site_file(site)
    assert vislam2tag("site", "set", site, "--walls", "WALLS", "--ignore", "TEXT").returncode == 0
    assert read_site_file(site) != before
    assert vislam2tag("site", "set", site, "--walls", "none", "--ignore", "none").returncode == 0
    assert read_site_file(site) == before
    done = vislam2tag("site", "set", site, "--name", "First floor", "--building", "Town hall")
    assert done.stdout.startswith("nothing changed, because the site has these properties already\nnext: ")
    done = vislam2tag("site", "set", site, "--name", "First floor", "--building", "Hall")
    assert done.stdout.splitlines()[0] == "the building is called Hall now"
    assert "changed" not in done.stdout


def test_a_plan_with_coordinates_of_a_national_grid_gets_an_origin(site: Path, tmp_path: Path) -> None:
    drawing = tmp_path / "grid.dxf"
    document = readfile(site / "floor_1" / "second.dxf")
    for drawn in document.modelspace():
        if isinstance(drawn, DXFGraphic):
            drawn.translate(4_398_200_000, 5_600_000_000, 0)
    document.saveas(drawing)
    shutil.copy(drawing, site / "floor_1" / "second.dxf")
    done = vislam2tag("site", "set", site, "--lower-left", "0,0")
    assert done.returncode == 0, done.stderr
    assert read_site(site)[0].floor(1).extent_m == pytest.approx((0, 40, 0, 16), abs=0.01)
    init = ("site", "init", tmp_path / "new", "--plan", drawing)
    assert "For the plan, pass --lower-left 0,0" in the_error(vislam2tag(*init))
    assert vislam2tag(*init, "--lower-left", "0,0").returncode == 0
    assert read_site(tmp_path / "new")[0].floor(1).extent_m == pytest.approx((0, 40, 0, 16), abs=0.01)


def test_a_number_is_changed_in_all_files_and_back(site: Path) -> None:
    folder = site / "floor_1"
    marks = folder / "marker_dict.csv"
    header, *rows = marks.read_text().splitlines()
    marks.write_text("\n".join((f"{header},floor", *(f"{row},1" for row in rows))) + "\n")
    (folder / "registration.json").write_text('{"floor": 1, "landmarks": []}')
    (site / "corrections.toml").write_text(
        "# keep\n[[landmark_units]]\nfloor = 1\nunit = 'cm'\n\n[[set_floor]]\ndevice = 'a'\nto = 1  # wrong\n"
    )
    before, landmarks = bytes_of(site), read_site(site)[0].landmarks
    done = vislam2tag("site", "renumber", site, "1", "-1")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(
        "floor 1 is floor -1 now\nchanged: site.toml, floor_-1/marker_dict.csv, floor_-1/registration.json, "
        "corrections.toml\nnote: sheets and plans that were made before say floor 1"
    )
    assert not folder.exists()
    after, findings = read_site(site)
    assert [floor.number for floor in after.floors] == [-1]
    assert after.floor(-1).extent_m == pytest.approx((0, 40, 0, 16))
    assert set(after.landmarks.floor.tolist()) == {-1}
    assert after.landmarks.planned_ids == landmarks.planned_ids
    assert not [one for one in findings if one.severity != "info"]
    corrections = read_corrections(site)
    assert (corrections.landmark_units[0].floor, corrections.set_floor[0].to) == (-1, -1)
    assert json.loads((site / "floor_-1" / "registration.json").read_text())["floor"] == -1
    vislam2tag("site", "renumber", site, "-1", "1")
    (folder / "registration.json").write_text('{"floor": 1, "landmarks": []}')
    assert bytes_of(site) == before


def test_a_removed_floor_keeps_its_files(site: Path, plans: Path) -> None:
    assert "it is the only floor of the site" in the_error(vislam2tag("site", "remove", site, "--floor", "1"))
    for _ in range(2):
        words = ("--floor", "2", "--scale", "1:200")
        assert vislam2tag("site", "init", site, "--plan", plans / "first.pdf", *words).returncode == 0
        done = vislam2tag("site", "remove", site, "--floor", "2")
        assert (done.returncode, done.stderr) == (0, "")
    assert f"its files are kept in {site / 'removed_floor_2_2'}; delete them" in done.stdout
    assert (site / "removed_floor_2" / "first.pdf").read_bytes() == (plans / "first.pdf").read_bytes()
    assert [floor.number for floor in read_site(site)[0].floors] == [1]
    assert vislam2tag("site", "show", site).returncode == 0


def test_what_cannot_be_changed_leaves_all_files(site: Path, plans: Path) -> None:
    words = ("--floor", "2", "--scale", "1:200")
    vislam2tag("site", "init", site, "--plan", plans / "first.pdf", *words)
    (site / "floor_1" / "phone" / "walk").mkdir(parents=True)
    before = bytes_of(site)
    for arguments, message in (
        (("renumber", site, "1", "3"), "floor 1 has 1 recorded walk, and recordings are never changed: move"),
        (("remove", site, "--floor", "1"), "out of the survey yourself first"),
        (("renumber", site, "2", "1"), "already has a floor 1; renumber or remove that one first"),
        (("renumber", site, "2", "2"), "floor 2 already has this number: pass another one"),
        (("renumber", site, "7", "8"), "--floor 7: "),
        (("remove", site, "--floor", "2", "--floor", "1"), "--floor is given 2 times: pass it once"),
        (("set", site, "--floor", "2", "--width-m", "3", "--unit-m", "1"), "--width-m and --unit-m give the scale of"),
        (("renumber", site, "2", "9999999"), "number: Input should be less than or equal to 999999"),
        (("set", site, "--floor", "2", "--elevation-m", "nan"), "elevation_m: Input should be a finite number"),
        (("set", site), "nothing to change is given"),
        (("set", site, "--name", "A"), "--floor: the site has several floors (1, 2); choose one"),
        (("set", site, "--floor", "2", "--width-m", "3", "--height-m", "3"), "times as wide as high"),
        (("align", site, "--floor", "1", "--onto", "2", "--pair", "1,1=2,2"), "two common points at different places"),
        (("align", site, "--floor", "1", "--onto", "1", "--pair", "1,1=2,2"), "--onto 1: this is the same floor"),
        (
            ("align", site, "--floor", "1", "--onto", "2", "--pair", "0,0=0,0", "--pair", "10,0=10.5,0"),
            "the points are 1.050 times as far apart on floor 2 as on floor 1: one of the plans has a wrong size",
        ),
        (("align", site, "--floor", "1", "--onto", "2", "--pair", "1,1"), "expected X,Y=X,Y"),
    ):
        assert message in the_error(vislam2tag("site", *arguments)), arguments
        assert bytes_of(site) == before


def test_floors_are_laid_on_top_of_each_other(site: Path, plans: Path) -> None:
    words = ("--floor", "2", "--scale", "1:200", "--lower-left", "100,50")
    vislam2tag("site", "init", site, "--plan", plans / "first.pdf", *words)
    turned = ("--pair", "110,55=5,-10", "--pair", "130,55=5,10.1")
    done = vislam2tag("site", "align", site, "--floor", "2", "--onto", "1", *turned)
    assert done.returncode == 0, done.stderr
    assert "floor 2 is laid on floor 1: turned by 90.00°" in done.stdout
    assert "a third --pair would check the points; lengths differ by 0.5%" in done.stdout
    assert "note: floor 2 is turned by 90° against floor 1: if both plans are drawn the same way up" in done.stdout
    frame = read_site(site)[0].floor(2).site_T_bcs
    assert frame @ np.array([(120.0, 55.0)]) == pytest.approx(np.array([(5.0, 0.05)]), abs=1e-3)


@pytest.mark.usefixtures("undrawn_figures")
def test_excluded_rooms_are_left_out_of_plan_and_coverage(site: Path, tmp_path: Path) -> None:
    before = bytes_of(site)
    done = vislam2tag("site", "set", site, "--exclude-room", "0.1")
    assert "there is no room 0.1; the most similar name is 0.10" in the_error(done)
    assert "--include-room 0.01: this room is not excluded" in the_error(
        vislam2tag("site", "set", site, "--include-room", "0.01")
    )
    assert bytes_of(site) == before
    done = vislam2tag("site", "set", site, "--exclude-room", "0.01", "--exclude-room", "0.07")
    assert (done.returncode, done.stderr) == (0, "")
    assert "floor 1: excluded_rooms changed" in done.stdout
    words = ("--rooms", "--further", "0", "--spacing-m", "6", "--restart", "--out", tmp_path / "plan")
    done = vislam2tag("plan", site, *words)
    assert "no walk goes into the excluded rooms 0.01, 0.07" in done.stdout
    plan = json.loads((tmp_path / "plan" / "plan.json").read_text())["floors"][0]
    tour = np.array(plan["tour"]["line_m"])
    places = np.array([(one["x_m"], one["y_m"]) for one in plan["landmarks"]])
    floor = read_site(site)[0].floor(1)
    for x0, y0, x1, y1 in ((0.3, 0.3, 7.7, 6.7), (8.3, 9.3, 15.7, 15.7)):
        for points in (tour, places):
            assert not ((points > (x0, y0)) & (points < (x1, y1))).all(axis=1).any()
    assert ((tour > (8.3, 0.3)) & (tour < (15.7, 6.7))).all(axis=1).any(), "the tour goes into other rooms"
    assert not {"0.01", "0.07"} & set(floor_areas(floor, ()).names)
    vislam2tag("site", "set", site, "--include-room", "0.01", "--include-room", "0.07")
    assert bytes_of(site) == before
