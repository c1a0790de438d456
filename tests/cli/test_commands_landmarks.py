"""Commands that prepare landmarks: ``plan`` and ``sheets``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cli.command import the_error, vislam2tag
from tests.preparation.planning.floors import write_ring_site
from tests.preparation.sheets.printed import printed
from tests.site.site import write_survey
from tests.surveys import bytes_of
from vislam2tag.preparation.sheets.images import dead_leaves_picture


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ring_site(tmp_path_factory.mktemp("plan") / "site")


@pytest.mark.usefixtures("undrawn_figures")
def test_a_plan_is_written_and_told(site: Path, tmp_path: Path) -> None:
    done = vislam2tag("plan", site, "--out", tmp_path / "plan", "--further", "0")
    assert done.returncode == 0, done.stderr
    assert "Landmarks" in done.stdout
    assert "1 Floor 1" in done.stdout
    assert f"page: {tmp_path / 'plan' / 'index.html'}\n" in done.stdout
    assert len((tmp_path / "plan" / "landmarks.csv").read_text().splitlines()) == 7


@pytest.mark.usefixtures("undrawn_figures")
def test_a_second_plan_needs_no_landmark_and_sheets_warn_of_other_paper(site: Path, tmp_path: Path) -> None:
    copied = tmp_path / "site"
    shutil.copytree(site, copied)
    plan = ("plan", copied, "--further", "0", "--write", "--out", tmp_path / "plan")
    assert "the new landmarks were added" in vislam2tag(*plan).stdout
    done = vislam2tag(*plan, "--paper", "A3")
    assert "no new landmark is needed: 6 are in the site already; to plan again, pass --restart" in done.stdout
    assert f"next: vislam2tag sheets {copied} --out sheets" in done.stdout
    assert "were added" not in done.stdout
    sheets = ("sheets", copied, "--paper", "A3", "--ids", "1-2", "--out", tmp_path / "sheets")
    done = vislam2tag(*sheets)
    warning = "warning: --paper A3 was not used for 2 landmarks, whose paper is A4 in the landmark table"
    assert warning in done.stdout
    assert warning in vislam2tag(*sheets, "--json").stderr
    assert f"then: vislam2tag register {copied} --click clicks.html" in done.stdout
    done = vislam2tag(*plan[:-3], "--anew", "--out", tmp_path / "plan")
    assert "floor 1: planned landmarks 1, 2, 3, 4, 5, 6 are not used, and --write drops them" in done.stdout
    assert len((copied / "floor_1" / "marker_dict.csv").read_text().splitlines()) == 7


@pytest.mark.usefixtures("undrawn_figures")
def test_a_file_says_where_walls_are_and_what_is_demanded(site: Path, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[walkable]\ncell_m = 0.2\n[plan]\nspacing_m = 10\nfurther = 0\n")
    words = ("--out", tmp_path / "plan", "--config", tmp_path / "own.toml", "--spacing-m", "12", "--json")
    printed = vislam2tag("plan", site, *words).stdout
    kept = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert json.loads(printed) == kept
    assert (kept["walkable"]["cell_m"], kept["settings"]["spacing_m"]) == (0.2, 12.0)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_demand_that_no_wall_meets_is_told_and_ends_with_1(site: Path, tmp_path: Path) -> None:
    forbidden = tmp_path / "glass.csv"
    forbidden.write_text("floor,x0,y0,x1,y1\n1,3.5,-1,26.5,3\n")
    done = vislam2tag("plan", site, "--out", tmp_path / "plan", "--further", "0", "--forbid", forbidden)
    assert done.returncode == 1
    assert "m passes no wall for a sheet; put up a stand there" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--spacing-m", "0"), "--spacing-m 0.0"),
        (("--spacing-m", "1e308"), "--spacing-m 1e+308: Input should be less than or equal to 1000"),
        (("--view-deg", "0", "50"), "--view-deg 0 50: expected angles of view between 10 and 170 degrees"),
        (("--paper", "B5"), "'B5' is not a paper size"),
        (("--floor", "9"), "--floor 9: the site does not have this floor"),
        (("--forbid", "/none.csv"), "/none.csv: cannot be opened"),
    ],
)
def test_wrong_usage_is_told(site: Path, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    assert message in the_error(vislam2tag("plan", site, "--out", tmp_path / "plan", *arguments))
    assert not (tmp_path / "plan").exists()


def test_a_site_gets_a_sheet_for_each_landmark(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    raw = bytes_of(survey)
    done = vislam2tag("sheets", survey, "--out", tmp_path / "out", "--paper", "letter")
    assert (done.returncode, done.stderr) == (0, "")
    assert "Letter" in done.stdout
    assert "0.196 m" in done.stdout
    assert "warning: landmarks 10, 7 have the same image on several floors" in done.stdout
    assert (
        f"for the phone: {tmp_path / 'out/images'}\nnext: print {tmp_path / 'out/sheets.pdf'} at 100 %" in done.stdout
    )
    assert (tmp_path / "out/images/manifest.csv").read_text() == "id,file,width_m\n10,10.png,0.196\n7,7.png,0.196\n"
    assert "floor 4" in printed(tmp_path / "out/sheets.pdf", 3, dpi=25.4).text
    assert len(json.loads((tmp_path / "out/sheets.json").read_text())["pages"]) == 4
    assert bytes_of(survey) == raw


def test_ids_alone_and_the_same_bytes_again(tmp_path: Path) -> None:
    for name in ("a", "b"):
        done = vislam2tag("sheets", "--ids", "1-3,lobby", "--seed", "7", "--out", tmp_path / name)
        assert (done.returncode, done.stderr) == (0, "")
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")
    assert "lobby,lobby.png,0.19" in (tmp_path / "a/images/manifest.csv").read_text()


def test_a_file_gives_seed_and_paper_and_options_win(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[sheets]\nseed = 7\npaper = 'A3'\n")
    for name, *options in (("file", "--config", tmp_path / "own.toml", "--paper", "A4"), ("typed", "--seed", "7")):
        assert vislam2tag("sheets", "--ids", "1", "--out", tmp_path / name, *options).returncode == 0
    assert (tmp_path / "file" / "sheets.pdf").read_bytes() == (tmp_path / "typed" / "sheets.pdf").read_bytes()


def test_own_images_keep_their_width(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    for name in ("1", "2"):
        Image.fromarray(dead_leaves_picture(3, name)).save(own / f"{name}.png", optimize=True)
    done = vislam2tag("sheets", "--images", own, "--width-m", "0.1", "--out", tmp_path / "out")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/images/manifest.csv").read_text() == "id,file,width_m\n1,1.png,0.1\n2,2.png,0.1\n"
    assert (tmp_path / "out/images/1.png").read_bytes() == (own / "1.png").read_bytes()


@pytest.fixture(name="photos")
def _photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    Image.fromarray(np.zeros((400, 400), np.uint8)).save(folder / "black.png")
    return folder


def test_wrong_usage_is_2_with_one_line_and_nothing_written(tmp_path: Path, photos: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    full = tmp_path / "full"
    shutil.copytree(survey, full)
    raw = bytes_of(full)
    for arguments, message in (
        (("--ids", "1,01"), "'1' and '01' are the same id, 1; name each once"),
        ((survey, "--paper", "B5"), "'B5' is not a paper size; available are: A4, Letter, A3"),
        (
            ("--images", photos),
            "1 of 1 images are not suitable as landmarks: black.png (its contrast is 0, but must be at least 30",
        ),
    ):
        assert message in the_error(vislam2tag("sheets", *arguments, "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()
    assert "is not empty and was not made by this command" in the_error(
        vislam2tag("sheets", "--ids", "1", "--out", full)
    )
    assert bytes_of(full) == raw
