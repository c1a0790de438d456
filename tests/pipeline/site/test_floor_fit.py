"""Floors of a building whose places or sizes do not fit each other."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.site.plans import drawn_floor
from vislam2tag.pipeline.site.floor_fit import floor_fit_notes


def two_floors(folder: Path, *further: str) -> Path:
    for number, words in (("0", ("--width-m", "20")), ("1", further)):
        plan = drawn_floor.png(folder, name=f"{number}.png")
        done = vislam2tag("site", "init", folder / "site", "--plan", plan, "--floor", number, *words)
        assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.mark.parametrize(
    ("placed", "message"),
    [
        (("--width-m", "20", "--lower-left", "4398.2,0"), "floor 1 begins at (4,398, 0) m and is not above or below"),
        (("--width-m", "40"), "floor 1 is 40.0 m x 20.0 m and floor 0 20.0 m x 10.0 m, in the same shape"),
    ],
)
def test_the_command_of_the_note_makes_the_floor_fit(tmp_path: Path, placed: tuple[str, ...], message: str) -> None:
    site = two_floors(tmp_path, *placed)
    (note,) = floor_fit_notes(site, 1)
    assert message in note
    assert len(floor_fit_notes(site, 0)) == 1
    assert vislam2tag(*shlex.split(note.partition("run vislam2tag ")[2])).returncode == 0
    assert floor_fit_notes(site, 1) == floor_fit_notes(site, 0) == []


def test_another_shape_at_the_same_corner_is_aligned(tmp_path: Path) -> None:
    site = two_floors(tmp_path, "--width-m", "20", "--height-m", "13", "--stretch")
    (note,) = floor_fit_notes(site, 1)
    assert "--floor 1 --onto 0 --page align.html" in note
    pairs = ("--pair", "0,0=1,0", "--pair", "10,0=11,0")
    assert vislam2tag("site", "align", site, "--floor", "1", "--onto", "0", *pairs).returncode == 0
    assert floor_fit_notes(site, 1) == []


def test_a_floor_of_the_same_size_counts_more_than_a_closer_one(tmp_path: Path) -> None:
    site = two_floors(tmp_path, "--width-m", "40")
    plan = drawn_floor.png(tmp_path, name="2.png")
    vislam2tag("site", "init", site, "--plan", plan, "--floor", "2", "--width-m", "20", "--lower-left", "1,1")
    assert floor_fit_notes(site, 2) == floor_fit_notes(site, 0) == []
    assert "floor 1 is 40.0 m x 20.0 m and floor 0 20.0 m x 10.0 m" in floor_fit_notes(site, 1)[0]
    done = vislam2tag("site", "set", site, "--floor", "2", "--lower-left", "300,0")
    assert "floor 2 is 20.00 m x 10.00 m, with its lower left corner at (300.00, 0.00) m\n" in done.stdout
    assert "note: floor 2 begins at (300, 0) m and is not above or below floor 1" in done.stdout


def test_a_single_floor_fits(tmp_path: Path) -> None:
    plan = drawn_floor.png(tmp_path)
    vislam2tag("site", "init", tmp_path / "site", "--plan", plan, "--width-m", "20")
    assert floor_fit_notes(tmp_path / "site", 1) == []
