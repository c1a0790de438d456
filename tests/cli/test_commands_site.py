"""``vislam2tag site`` as its users run it."""

from __future__ import annotations

import json
import tarfile
from pathlib import Path

import pytest
from PIL import Image

from tests.cli.command import the_error, vislam2tag
from tests.conftest import shared_folder
from tests.site.plans import drawn_floor
from tests.site.site import write_survey
from tests.site.walkable.hand_made import HEIGHT_M, MARGIN_M, WIDTH_M, plan, walls
from vislam2tag.cli import main
from vislam2tag.site.discover import read_site
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import Use


def test_a_site_is_begun_shown_and_written(tmp_path: Path) -> None:
    site = tmp_path / "site"
    plan = drawn_floor.pdf(tmp_path)
    size = ("--width-m", "20", "--height-m", "10")
    done = vislam2tag(
        "site", "init", site, "--plan", plan, "--page", "2", "--floor", "0", *size, "--lower-left", "5,-2"
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "floor 0 added" in done.stdout
    assert "5.00 to 25.00 m" in done.stdout
    points = ("--point", "0,100=0,0", "--point", "200,100=0,20")
    done = vislam2tag("site", "init", site, "--plan", drawn_floor.png(tmp_path), "--floor", "1", *points)
    assert "marker_dict.csv" not in done.stdout + done.stderr  # landmarks come next, as the last line says
    assert done.returncode == 0, done.stderr
    assert sorted(str(path.relative_to(site)) for path in site.rglob("*.*")) == [
        "floor_0/plan.pdf",
        "floor_0/plan_as_read.png",
        "floor_1/plan.png",
        "floor_1/plan_as_read.png",
        "site.toml",
    ]
    (site / "floor_0" / "marker_dict.csv").write_text("id,x,y\n1,6,-1\n2,20.5,3\n3,,\n")
    (site / "floor_0" / "refmarker.csv").write_text("7,1\n")
    for kind in ("png", "pdf", "svg", "html"):
        done = vislam2tag("site", "show", site, "--out", tmp_path / f"site.{kind}")
        assert done.returncode == 0, done.stderr
        assert "3 (1 without position)" in done.stdout
        assert (tmp_path / f"site.{kind}").stat().st_size > 5000
    with Image.open(tmp_path / "site.png") as image:
        assert min(image.size) > 500
    done = vislam2tag("site", "write", site, "--out", tmp_path / "published")
    assert done.returncode == 0, done.stderr
    assert "floor 0: positions moved by (-5, 2) m" in done.stdout
    dimensions = (tmp_path / "published" / "floor_dimensions.csv").read_text().splitlines()
    assert dimensions[1] == "0,20.0,10.0,,Floor 0"
    assert dimensions[2].startswith("1,10.0")
    marks = (tmp_path / "published" / "floor_0" / "marker_dict.csv").read_text()
    assert marks == "id,x,y\n1,1.0,1.0\n2,15.5,5.0\n3,,\n"
    assert (tmp_path / "published" / "floor_0" / "refmarker.csv").read_text() == "2.0,3.0\n"
    old, new = (read_site(folder)[0] for folder in (site, tmp_path / "published"))
    assert [floor.width_m for floor in new.floors] == pytest.approx([floor.width_m for floor in old.floors])
    assert drawn_floor.is_dark(floor_plan(new.floor(0)), 5, 3)
    assert vislam2tag("site", "write", site, "--out", tmp_path / "published").returncode == 0
    assert "was not made by this command" in the_error(vislam2tag("site", "write", site, "--out", site))


def test_the_published_layout_is_described(tmp_path: Path) -> None:
    root = write_survey(tmp_path)
    before, _ = read_site(root)
    done = vislam2tag("site", "init", root, "--building", "Old house", "--georeference", "50.78,6.06,12")
    assert done.returncode == 0, done.stderr
    after, _ = read_site(root)
    assert [(floor.number, floor.extent_m, floor.plan) for floor in after.floors] == [
        (floor.number, floor.extent_m, floor.plan) for floor in before.floors
    ]
    assert after.floor(1).georeference is not None
    assert "already exists" in the_error(vislam2tag("site", "init", root))


def test_the_mall_of_the_competition(tmp_path: Path) -> None:
    with tarfile.open(shared_folder("ilc20") / "site2-F4.tar.xz") as archive:
        wanted = [member for member in archive.getmembers() if not member.name.endswith(".txt")]
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(tmp_path, wanted)
    done = vislam2tag("site", "init", tmp_path / "mall", "--plan", tmp_path / "site2" / "F4")
    assert done.returncode == 0, done.stderr
    site, _ = read_site(tmp_path / "mall")
    (floor,) = site.floors
    assert (floor.number, floor.name) == (3, "F4")
    assert (floor.width_m, floor.height_m) == (236.71181213998395, 219.74676479990106)
    plan = floor_plan(floor)
    assert [each.use for each in plan.polygons].count(Use.OUTLINE) == 1
    # What the competition draws white inside its outline is white on ours, too.
    with Image.open(tmp_path / "site2" / "F4" / "floor_image.png") as image:
        theirs = image.convert("RGBA")
    ours = Image.fromarray(plan.image).resize(theirs.size)
    alike = [
        (ours.getpixel((x, y)) == (255, 255, 255)) == (theirs.getpixel((x, y)) == (255, 255, 255, 255))
        for x in range(5, 795, 13)
        for y in range(5, 735, 13)
        if theirs.getpixel((x, y))[3] == 255  # type: ignore[index]
    ]
    assert len(alike) > 500
    assert sum(alike) > 0.9 * len(alike)


def test_landmarks_are_rebased_by_those_in_common(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    for folder, rows in ((old, "1,0,0\n2,10,0\n3,0,10\n4,5,5\n"), (new, "1,100,0\n2,100,10\n3,90,0\n4,99,99\n")):
        (folder / "floor_1").mkdir(parents=True)
        (folder / "floor_1" / "marker_dict.csv").write_text(f"id,x,y\n{rows}")
    done = vislam2tag("site", "rebase", old, "--to", new, "--without", "4", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "90.0000°" in done.stdout
    changed = (tmp_path / "out" / "floor_1" / "marker_dict.csv").read_text().splitlines()
    assert [float(each) for each in changed[4].split(",")[1:]] == pytest.approx([95, 5])
    (tmp_path / "all.csv").write_text("id,x,y,floor\n7,1,2,1\n")
    change = tmp_path / "out" / "rebase.toml"
    done = vislam2tag("site", "rebase", tmp_path / "all.csv", "--by", change, "--out", tmp_path / "there.csv")
    assert done.returncode == 0, done.stderr
    done = vislam2tag(
        "site", "rebase", tmp_path / "there.csv", "--by", change, "--back", "--out", tmp_path / "back.csv"
    )
    assert done.returncode == 0, done.stderr
    fields = (tmp_path / "back.csv").read_text().splitlines()[1].split(",")
    assert [float(each) for each in fields] == pytest.approx([7, 1, 2, 1])


def init(site: Path, plan: Path, *options: str) -> str:
    done = vislam2tag("site", "init", site, "--plan", plan, *options)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.parametrize("unit", ["mm", "cm", "in", "pt", "pc"])
def test_an_svg_that_tells_its_size_on_paper_takes_a_scale(tmp_path: Path, unit: str) -> None:
    metres = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6}[unit]
    plan = drawn_floor.svg(tmp_path, f'width="{0.2 / metres:.9g}{unit}" height="{0.1 / metres:.9g}{unit}"')
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", plan)
    assert "(200 mm x 100 mm on paper; with --scale" in the_error(done)
    init(tmp_path / "site", plan, "--scale", "1:100", "--lower-left", "5,-2")
    floor = read_site(tmp_path / "site")[0].floor(1)
    assert floor.extent_m == pytest.approx((5, 25, -2, 8))
    assert drawn_floor.is_dark(floor_plan(floor), 10, 1)
    assert not drawn_floor.is_dark(floor_plan(floor), 10, 5)


def test_an_svg_in_the_buildings_own_size_needs_no_scale(tmp_path: Path) -> None:
    plan = drawn_floor.svg(tmp_path, 'width="20000mm" height="10000mm"')
    init(tmp_path / "site", plan)
    assert read_site(tmp_path / "site")[0].floor(1).extent_m == pytest.approx((0, 20, 0, 10))


def test_pixels_of_an_svg_are_no_size_on_paper(tmp_path: Path) -> None:
    plan = drawn_floor.svg(tmp_path, 'width="800px" height="400"')
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", plan, "--scale", "1:100")
    assert "has no size on paper" in the_error(done)
    init(tmp_path / "site", plan, "--height-m", "10")
    assert read_site(tmp_path / "site")[0].floor(1).extent_m == pytest.approx((0, 20, 0, 10))


@pytest.mark.parametrize(
    "scale",
    [
        ("--width-m", "20", "--height-m", "10"),
        ("--width-m", "20.1"),
        ("--scale", "1:100"),
        ("--distance", "120,300,686.93,300,20"),
    ],
)
def test_frame_and_title_block_are_not_taken_for_the_building(tmp_path: Path, scale: tuple[str, ...]) -> None:
    told = init(tmp_path / "site", drawn_floor.framed_pdf(tmp_path), *scale)
    assert "note: the page has a frame: only the drawing between 1" in told
    floor = read_site(tmp_path / "site")[0].floor(1)
    assert floor.extent_m == pytest.approx((0, 20, 0, 10), abs=0.2)
    plan = floor_plan(floor)
    for (x, y), dark in {(5, 3): True, (10, 0.05): True, (15, 3): False, (5, 8): False}.items():
        assert drawn_floor.is_dark(plan, x, y) == dark, (x, y)


def test_the_page_is_taken_where_only_it_has_the_shape_given_or_it_is_asked_for(tmp_path: Path) -> None:
    plan = drawn_floor.framed_pdf(tmp_path)
    size = ("--width-m", "42", "--height-m", "29.7")
    assert "note: the size applies to the whole page, because their shapes match" in init(tmp_path / "a", plan, *size)
    assert "note:" not in init(tmp_path / "b", plan, "--scale", "1:100", "--area", "page")
    for site in ("a", "b"):
        assert read_site(tmp_path / site)[0].floor(1).extent_m == pytest.approx((0, 42, 0, 29.7), abs=0.01)
    done = vislam2tag("site", "init", tmp_path / "c", "--plan", plan, "--width-m", "20", "--height-m", "12")
    assert "is 1.667; the whole page does not match either. Use" in the_error(done)


def test_part_of_an_image_is_taken(tmp_path: Path) -> None:
    plan = drawn_floor.png(tmp_path)  # 200 x 100 pixels, 10 a metre, from the upper left corner
    init(tmp_path / "site", plan, "--area", "200,100,40,0", "--width-m", "16")
    floor = read_site(tmp_path / "site")[0].floor(1)
    assert floor.extent_m == pytest.approx((0, 16, 0, 10))
    assert drawn_floor.is_dark(floor_plan(floor), 1, 3)
    assert not drawn_floor.is_dark(floor_plan(floor), 5, 3)


def test_pixels_need_not_be_square_if_one_says_so(tmp_path: Path) -> None:
    init(tmp_path / "site", drawn_floor.png(tmp_path), "--width-m", "20", "--height-m", "15", "--stretch")
    assert read_site(tmp_path / "site")[0].floor(1).extent_m == (0, 20, 0, 15)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            (),
            "the file has no scale. Use --width-m or --height-m or both, two --point, --distance, --scale or --unit-m",
        ),
        (("--width-m", "20", "--height-m", "11"), "is 2.000 times as wide as high, but 20 m x 11 m is 1.818. Use"),
        (("--scale", "1/50"), "--scale 1/50: expected 1:N as printed on the drawing, such as 1:100"),
        (("--area", "0,0,9", "--width-m", "20"), "--area 0,0,9: expected X,Y,X,Y, two opposite corners"),
        (("--area", "900,0,999,9", "--width-m", "20"), "the plan of floor 1 shows only 0,0,200,100, but area"),
        (("--point", "1,2=3,4"), "--point: two known points are needed, but 1 are given"),
        (("--point", "1,2=3", "--point", "1,2=3,4"), "--point 3: expected PX,PY=X,Y"),
        (("--point", "1,2=3,4", "--point", "1,2=3,4"), "points are identical, so they give no scale"),
        (("--distance", "0,0,0,0,5"), "from and to are the same point"),
        (("--distance", "0,0,5"), "--distance 0,0,5: expected X,Y,X,Y,METRES"),
        (("--lower-left", "1,1"), "--lower-left: also pass"),
        (
            ("--width-m", "20", "--height-m", "10", "--unit-m", "1"),
            "error: --width-m and --unit-m give the scale of the plan",
        ),
        (("--width-m", "20", "--height-m", "10", "--georeference", "here"), "--georeference here: expected EPSG:CODE"),
        (("--width-m", "20", "--height-m", "10", "--georeference", "EPSG:4326,6,50"), "has no eastings and northings"),
        (
            ("--width-m", "20", "--georeference", "EPSG:25832,5628801,294405"),
            "easting and northing are exchanged: EPSG",
        ),
        (("--width-m", "20", "--georeference", "100.5,50"), "latitude and longitude are exchanged; pass 50,100.5"),
        (("--width-m", "20", "--height-m", "10", "--others", "roof"), "others: "),
        (("--width-m", "41000"), "error: --width-m 41000: must be at most 10000 metres"),
        (("--width-m", "20", "--elevation-m", "nan"), "error: elevation_m: Input should be a finite number"),
        (("--width-m", "20", "--elevation-m", "inf"), "error: elevation_m: Input should be a finite number"),
    ],
)
def test_options_that_cannot_be(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", drawn_floor.png(tmp_path), *options)
    assert message in the_error(done)
    assert not (tmp_path / "site").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--width-m", "41,5"), "'--width-m': '41,5' is not a number; write a decimal point: 41.5"),
        (("--width-m=41,5",), "'--width-m': '41,5' is not a number; write a decimal point: 41.5"),
        (("--floor", "x"), "'--floor': 'x' is not a whole number"),
    ],
)
def test_what_is_not_a_number_is_named(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", drawn_floor.png(tmp_path), *options)
    assert done.returncode == 2
    assert message in done.stderr


def test_a_new_site_is_asked_for_landmarks_and_walks(tmp_path: Path) -> None:
    site = tmp_path / "site"
    vislam2tag("site", "init", site, "--plan", drawn_floor.png(tmp_path), "--width-m", "20")
    done = vislam2tag("site", "show", site, "--out", tmp_path / "site.html")
    assert "floor 1 has no landmarks yet: plan them with `vislam2tag plan SITE --out plan --write`" in done.stdout
    assert f"contains no walks yet: record some, then run vislam2tag receive {site}" in the_error(
        vislam2tag("inspect", site)
    )


def test_plans_that_cannot_be(tmp_path: Path) -> None:
    size = ("--width-m", "20")
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", tmp_path / "gone.png", *size)
    assert "gone.png: the plan does not exist" in the_error(done)
    plan = drawn_floor.png(tmp_path)
    assert vislam2tag("site", "init", tmp_path / "site", "--plan", plan, *size).returncode == 0
    assert "--floor 7: the site does not have this floor; its floors are: 1" in the_error(
        vislam2tag("site", "show", tmp_path / "site", "--floor", "7")
    )


def test_changes_that_cannot_be(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "site")
    assert "pass the new site with --to, or the change with --by" in the_error(
        vislam2tag("site", "rebase", root, "--out", tmp_path / "out")
    )
    (tmp_path / "rebase.toml").write_text("[[floors]]\nnumber = 1\n")
    done = vislam2tag("site", "rebase", root, "--by", tmp_path / "rebase.toml", "--rigid", "--out", tmp_path / "out")
    assert "--by FILE already specifies the change" in the_error(done)
    done = vislam2tag("site", "rebase", root, "--by", tmp_path / "rebase.toml", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "there is no change for floor 4; add it to rebase.toml" in done.stderr
    assert not (tmp_path / "out").exists()


def test_inspect_and_site_show_a_site_with_a_pdf(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey")
    (root / "floor_1" / "plan.pdf").write_bytes(drawn_floor.pdf(tmp_path).read_bytes())
    (root / "site.toml").write_text(
        "[[floors]]\nnumber = 1\n[floors.plan]\nfile = 'floor_1/plan.pdf'\npage = 2\nunit_m = 0.05\n"
        "[[floors]]\nnumber = 4\n"
    )
    done = vislam2tag("inspect", root, "--json")
    assert done.returncode in (0, 1), done.stderr
    floor = json.loads(done.stdout)["floors"][0]
    assert (floor["width_m"], floor["plan"]) == (pytest.approx(20.0), "floor_1/plan.pdf")


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["vislam2tag", "site", "walkable", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_tells_what_it_found_and_what_is_closed_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site"
    (site / "floor_0").mkdir(parents=True)
    (site / "floor_dimensions.csv").write_text(
        f"id,width,height\n0,{WIDTH_M + 2 * MARGIN_M},{HEIGHT_M + 2 * MARGIN_M}\n"
    )
    Image.fromarray(plan(10, lines=walls(gate=False)).image).save(site / "floor_0" / "floorplan.png")
    assert run(monkeypatch, str(site), "--out", str(tmp_path / "out"), "--wall-contrast", "0.4") == 0
    shown = capsys.readouterr().out
    assert "Walkable space" in shown
    assert "floor 0: rooms without an open door are excluded" in shown
    assert "written" in shown
    (tmp_path / "own.toml").write_text("[walkable]\nwall_contrast = 0.3\ncell_m = 0.2\n")
    config = ("--config", str(tmp_path / "own.toml"), "--wall-contrast", "0.4")
    assert run(monkeypatch, str(site), "--out", str(tmp_path / "out"), *config) == 0
    kept = json.loads((tmp_path / "out" / "walkable.json").read_text())["settings"]["walkable"]
    assert (kept["wall_contrast"], kept["cell_m"]) == (0.4, 0.2)
    assert run(monkeypatch, str(site), "--floor", "9", "--out", str(tmp_path / "out")) == 2
