"""``register`` as its users meet it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.site.site import write_survey
from tests.surveys import bytes_of
from vislam2tag.cli.app import app
from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.site.discover import read_site

PLACES = {"10": 1.5 + 2.5j, "7": 30 + 4j, "11": 20 + 20j, "12": 50 + 25j}
KNOWN = {"A": 1 + 1j, "B": 58 + 2j, "C": 55 + 30j, "D": 3 + 29j}


@pytest.fixture(name="site")
def _site(tmp_path: Path) -> Path:
    """A survey with landmarks 10 and 7, and what a station measured on its floor 1."""
    site = write_survey(tmp_path / "survey")
    lines = ["Punkt;Y;X;Höhe"]
    for name, place in (KNOWN | PLACES).items():
        seen = (place - 20 - 10j) * np.exp(0.7j) + 1000 + 2000j
        lines.append(f"{name};{seen.real:.3f};{seen.imag:.3f};{1.4 if name in PLACES else 0.0}".replace(".", ","))
    (tmp_path / "S1.txt").write_text("\n".join(lines) + "\n")
    rows = [f"{name},{place.real},{place.imag},0" for name, place in KNOWN.items()]
    (tmp_path / "known.csv").write_text("\n".join(["name,x,y,z", *rows]) + "\n")
    return site


def arguments(site: Path, *further: str | Path) -> tuple[str | Path, ...]:
    folder = site.parent
    return (
        "register",
        site,
        "--floor",
        "1",
        "--station",
        folder / "S1.txt",
        "--control",
        folder / "known.csv",
        *further,
    )


def the_error_after(site: Path, *further: str) -> str:
    """The error of a registration that was printed and then not written."""
    done = vislam2tag(*arguments(site, *further))
    assert done.returncode == 2
    return done.stderr


def test_a_folder_has_all_and_the_site_stays(site: Path, tmp_path: Path) -> None:
    before = bytes_of(site)
    done = vislam2tag(*arguments(site, "--out", tmp_path / "out"))
    assert (done.returncode, done.stderr) == (0, "")
    assert "4 landmarks and 0 control points registered, 0 without a position, 0 contradictions" in done.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        OWN_FILES,
        "landmark_states.csv",
        "marker_dict.csv",
        "registration.json",
        "residuals.png",
        "residuals.svg",
    ]
    found = json.loads((tmp_path / "out/registration.json").read_text())
    for one in found["landmarks"]:
        assert complex(one["x_m"], one["y_m"]) == pytest.approx(PLACES[one["point"]], abs=0.002)
        assert one["z_m"] == 1.4
        assert len(one["covariance_m2"]) == 2
    assert bytes_of(site) == before
    assert vislam2tag(*arguments(site, "--out", tmp_path / "out")).returncode == 0


def test_the_site_is_written_whole_and_other_positions_only_if_asked(site: Path) -> None:
    before = bytes_of(site)
    assert "other positions of landmark 10 (floor_1/marker_dict.csv:2), 7" in the_error_after(site, "--write")
    assert bytes_of(site) == before
    assert vislam2tag(*arguments(site, "--write", "--replace")).returncode == 0
    assert vislam2tag(*arguments(site, "--write")).returncode == 0
    landmarks = read_site(site)[0].landmarks.on_floor(1)
    assert set(landmarks.ids) == set(PLACES)
    moved = (site.parent / "S1.txt").read_text().splitlines()
    row = next(i for i, line in enumerate(moved) if line.startswith("7;"))
    name, east, north, height = moved[row].split(";")
    moved[row] = ";".join((name, f"{float(east.replace(',', '.')) + 0.5:.3f}".replace(".", ","), north, height))
    (site.parent / "S1.txt").write_text("\n".join(moved))
    assert "of landmark 7 (floor_1/marker_dict.csv:3); pass --replace" in the_error_after(site, "--write")
    assert vislam2tag(*arguments(site, "--write", "--replace")).returncode == 0
    after = read_site(site)[0].landmarks.on_floor(1)
    off = np.linalg.norm(after.position_bcs - landmarks.position_bcs, axis=1)
    assert off[after.index["7"]] == pytest.approx(0.5, abs=0.01)
    assert np.delete(off, after.index["7"]).max() < 0.002


def test_names_that_are_not_those_of_the_table_are_not_written(site: Path, tmp_path: Path) -> None:
    planned = {"10": (2.5, 3.0), "7": (29.0, 4.5), "11": (21.0, 20.5), "12": (49.0, 25.5)}
    floor = site / "floor_1"
    (floor / "marker_dict.csv").write_text(
        "id,x,y\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in planned.items())
    )
    states = "".join(f"{name},planned,plan,{x},{y}\n" for name, (x, y) in planned.items())
    (floor / "landmark_states.csv").write_text("id,state,source,x,y\n" + states)
    measured = (tmp_path / "S1.txt").read_text()
    (tmp_path / "S1.txt").write_text(re.sub(r"^(?=\d)", "LM", measured, flags=re.MULTILINE))
    before = bytes_of(site)
    for further in (("--write",), ("--write", "--replace")):
        done = vislam2tag(*arguments(site, *further))
        assert done.returncode == 1
        assert "Register again with --landmark-names 'LM*'" in done.stdout
        assert "nothing was written into the site" in done.stdout
        assert done.stdout.splitlines()[-1].startswith("next: name the points like ids of the table (--landmark-names")
        assert bytes_of(site) == before
    assert vislam2tag(*arguments(site, "--write", "--landmark-names", "LM*")).returncode == 0
    assert read_site(site)[0].landmarks.planned_ids == ()

    (tmp_path / "S1.txt").write_text(
        re.sub(r"^10;|^7;|^11;|^12;", lambda m: f"{int(m[0][:-1]) + 20};", measured, flags=re.MULTILINE)
    )
    (floor / "marker_dict.csv").write_text((floor / "marker_dict.csv").read_text() + "30,,\n27,,\n31,,\n32,,\n")
    assert vislam2tag(*arguments(site, "--write")).returncode == 0, "rows with the new ids are there: further landmarks"


def test_the_site_shows_sheets_that_its_table_has_twice(site: Path) -> None:
    rows = "".join(
        f"{name},{x},{y}\nLM{name},{x + 1.5},{y}\n" for name, x, y in (("1", 2, 3), ("2", 9, 4), ("3", 5, 8))
    )
    (site / "floor_1/marker_dict.csv").write_text("id,x,y\n" + rows)
    states = "1,planned,plan,2,3\n2,planned,plan,9,4\n3,planned,plan,5,8\n"
    (site / "floor_1/landmark_states.csv").write_text("id,state,source,x,y\n" + states)
    done = vislam2tag("site", "show", site)
    assert "landmarks LM1, LM2, LM3 are measured where landmarks 1, 2, 3 are planned" in done.stdout
    assert "nothing is wrong" not in done.stdout


def test_a_swapped_pair_is_named_and_1(site: Path, tmp_path: Path) -> None:
    text = (tmp_path / "known.csv").read_text()
    (tmp_path / "known.csv").write_text(text.replace("\nA,", "\nx,").replace("\nB,", "\nA,").replace("\nx,", "\nB,"))
    done = vislam2tag(*arguments(site))
    assert done.returncode == 1
    assert "excluded either " in done.stdout
    assert "the known points B and A seem to be interchanged" in done.stdout


def test_tape_and_clicks(site: Path, tmp_path: Path) -> None:
    (tmp_path / "walls.csv").write_text("west,0,0,0,32\nsouth,0,0,60,0\n")
    (tmp_path / "tape.csv").write_text("20;west;3,00\n20;south;5,00\n21;west;3,00\n")
    (tmp_path / "clicks.csv").write_text("id,floor,x,y,screen_pixel_m,plan_pixel_m\n22,1,7,8,0.05,0.02\n")
    taped = ("--tape", tmp_path / "tape.csv", "--targets", tmp_path / "walls.csv", "--clicks", tmp_path / "clicks.csv")
    done = vislam2tag("register", site, "--floor", "1", *taped, "--write")
    assert done.returncode == 1
    assert "no position landmark 21: it has fewer than two usable distances" in done.stdout
    landmarks = read_site(site)[0].landmarks.on_floor(1)
    assert landmarks.position_bcs[landmarks.index["20"]] == pytest.approx((3, 5))
    sigma = np.sqrt(landmarks.covariance_bcs[:, 0, 0])
    assert sigma[landmarks.index["20"]] == pytest.approx(0.036, abs=0.003)
    assert sigma[landmarks.index["22"]] == pytest.approx(0.141, abs=0.003)


def test_a_tape_without_targets_names_the_option(site: Path, tmp_path: Path) -> None:
    (tmp_path / "tape.csv").write_text("20;west;3,00\n20;south;5,00\n")
    done = vislam2tag("register", site, "--floor", "1", "--tape", tmp_path / "tape.csv")
    assert done.returncode == 3
    assert "pass their positions with --targets FILE" in done.stdout
    assert "next: correct the problems above" in done.stdout


def test_the_page_is_written(site: Path, tmp_path: Path) -> None:
    done = vislam2tag("register", site, "--floor", "1", "--click", tmp_path / "click.html")
    assert done.returncode == 0
    assert "<svg" in (tmp_path / "click.html").read_text()


def test_wrong_usage_is_one_clear_error_and_nothing_written(site: Path, tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text("name,x,y\nA,1,1\n")
    station, one = ("--station", tmp_path / "S1.txt"), ("--floor", "1")
    before = bytes_of(tmp_path)
    for further, message in (
        (one, "there are no measurements; use --station, --tape or --clicks"),
        ((*one, *station), "--station needs known points; use --control FILE, or --known ID"),
        ((*one, *station, "--known", "99"), "--known 99: floor 1 has no measured position of this landmark"),
        ((*one, *station, "--control", tmp_path / "one.csv"), "station S1 shares only point A with the building"),
        ((*one, *station, "--control", tmp_path / "gone.csv"), "gone.csv: cannot be opened"),
        (
            (*one, *station, "--known", "all", "--columns", "point,E"),
            "--columns point,E: required columns are missing: N",
        ),
        (
            (*one, *station, "--known", "all", "--shot-sigma-m", "0"),
            "--shot-sigma-m 0.0: Input should be greater than 0",
        ),
        ((*one, *station, "--known", "all", "--out", site / "floor_1"), "this folder is among the site's own files"),
        ((*one, *station, "--known", "all", "--scale", "some"), "--scale some: expected fixed or free"),
        (station, "--floor: the site has several floors (1, 4)"),
        (("--floor", "9"), "--floor 9: the site does not have this floor; its floors are: 1, 4"),
    ):
        with pytest.raises(Vislam2tagError, match=re.escape(message)):
            in_process(site, *further)
    assert bytes_of(tmp_path) == before


def in_process(*arguments: str | Path) -> None:
    """Run the command here; its errors come through."""
    CliRunner().invoke(app, ["register", *map(str, arguments)], catch_exceptions=False)


def test_errors_end_the_process_with_2_and_one_line(site: Path) -> None:
    assert the_error(vislam2tag("register", site, "--floor", "1")).startswith("error: there are no measurements")


def test_stations_without_a_landmark_write_nothing(site: Path) -> None:
    assert vislam2tag(*arguments(site, "--write", "--replace")).returncode == 0
    record = site / "floor_1" / "registration.json"
    before = record.read_bytes()
    done = vislam2tag(*arguments(site, "--write", "--replace", "--landmark-names", "P*"))
    assert done.returncode == 3
    assert "no point of the stations is a landmark, so nothing was written" in done.stdout
    assert record.read_bytes() == before
