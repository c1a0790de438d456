"""Commands that write into a survey, which comes from others with a link planted where they write."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.preparation.rendered_walk import Walk, write_stray_scanner
from tests.sessions.companion_walks import OtherClock, write_sensor_logger
from tests.site.plans import drawn_floor
from tests.site.site import write_survey
from tests.surveys import bytes_of, make_survey
from vislam2tag.sessions.registry import open_survey, read_session

MINE = "ssh-ed25519 mine\n"
"""What is in a file outside that a command must not touch."""


@dataclass(frozen=True)
class Attacked:
    """A survey, a command that writes into it, and the file that it writes there."""

    survey: Path
    command: tuple[str | Path, ...]
    written: Path


def registering(folder: Path) -> Attacked:
    survey = write_survey(folder / "survey")
    known = {"A": (1, 1), "B": (58, 2), "C": (55, 30), "D": (3, 29)}
    points = known | {"10": (1.5, 2.5), "7": (30, 4)}
    (folder / "S1.txt").write_text(
        "Punkt;Y;X;Höhe\n" + "".join(f"{name};{x};{y};0\n" for name, (x, y) in points.items())
    )
    (folder / "known.csv").write_text("name,x,y,z\n" + "".join(f"{name},{x},{y},0\n" for name, (x, y) in known.items()))
    files = ("--station", folder / "S1.txt", "--control", folder / "known.csv")
    command = ("register", survey, "--floor", "1", *files, "--write", "--replace")
    return Attacked(survey, command, survey / "floor_1" / "marker_dict.csv")


def planning(folder: Path) -> Attacked:
    survey = folder / "survey"
    written = survey / "floor_1" / "marker_dict.csv"
    written.parent.mkdir(parents=True)
    written.write_text("id,x,y\n")
    drawn_floor.png(written.parent, name="floorplan.png")
    (survey / "floor_dimensions.csv").write_text("id,width,height\n1,20,10\n")
    return Attacked(survey, ("plan", survey, "--further", "0", "--write", "--out", folder / "plan"), written)


def beginning_a_site(folder: Path) -> Attacked:
    survey = folder / "survey"
    (survey / "floor_1").mkdir(parents=True)
    points = ("--point", "0,100=0,0", "--point", "200,100=0,20")
    command = ("site", "init", survey, "--plan", drawn_floor.png(folder), "--floor", "1", *points)
    return Attacked(survey, command, survey / "site.toml")


def copying_a_plan(folder: Path) -> Attacked:
    begun = beginning_a_site(folder)
    return Attacked(begun.survey, begun.command, begun.survey / "floor_1" / "plan.png")


def finding_landmarks(folder: Path) -> Attacked:
    survey, walk = folder / "survey", Walk.round_the_room(1.0)
    few = Walk(walk.time_s[:8], walk.position_bcs[:8], walk.heading_rad[:8])
    session = survey / "floor_1" / "iPhone" / "walk"
    write_stray_scanner(session, few, [])
    (survey / "floor_1" / "marker_dict.csv").write_text("id,x,y,z\n1,2,3,1\n")
    command = ("sightings", survey, "--tags", "apriltag-36h11", "--tag-side-m", "0.2", "--replace")
    return Attacked(survey, command, session / "sightings.csv")


def attaching(folder: Path) -> Attacked:
    survey = make_survey(folder / "survey", devices=("LG",), seconds=80.0)
    (ref,) = open_survey(survey).sessions
    walk = read_session(ref)
    write_sensor_logger(folder / "pixel", walk, OtherClock(1.7e9, 4e-5, int(walk.camera.time_ns[0])))
    written = ref.folder / "companions" / "pixel.json"
    written.parent.mkdir()
    return Attacked(survey, ("attach", ref.folder, folder / "pixel", "--replace"), written)


Making = Callable[[Path], Attacked]
WRITERS = (registering, planning, beginning_a_site, copying_a_plan, finding_landmarks, attaching)


def linked_outside(path: Path, folder: Path) -> Path:
    """Move a file or folder out of the survey and leave a link to it; to a file of the user's if there is none."""
    outside = folder / "outside"
    outside.mkdir()
    if path.exists():
        path.rename(outside / path.name)
    else:
        (outside / path.name).write_text(MINE)
    path.symlink_to(outside / path.name)
    return outside


@pytest.mark.parametrize("making", [each for each in WRITERS if each is not copying_a_plan])
def test_nothing_is_written_at_a_name_that_can_be_foreseen(making: Making, tmp_path: Path) -> None:
    attacked = making(tmp_path)
    written = attacked.written
    outside = linked_outside(written.with_name(f"{written.name}.part"), tmp_path)
    done = vislam2tag(*attacked.command)
    assert done.returncode == 0, done.stderr
    assert bytes_of(outside) == {f"{written.name}.part": hashlib.sha256(MINE.encode()).hexdigest()}
    assert not written.is_symlink()
    assert written.is_file()


@pytest.mark.parametrize("making", [each for each in WRITERS if each is not beginning_a_site])
def test_a_folder_that_is_a_link_is_not_written_into(making: Making, tmp_path: Path) -> None:
    attacked = making(tmp_path)
    folder = attacked.written.parent
    outside = linked_outside(folder, tmp_path)
    before = bytes_of(outside)
    reading = ("--follow-links",) if making is planning else ()  # else it reads no plan from there
    done = vislam2tag(*attacked.command, *reading)
    assert done.returncode != 0
    assert f"{folder}: it is a link" in done.stderr
    assert bytes_of(outside) == before


@pytest.mark.parametrize("making", [registering, planning, finding_landmarks])
def test_a_link_in_place_of_a_file_is_neither_followed_nor_replaced(making: Making, tmp_path: Path) -> None:
    attacked = making(tmp_path)
    outside = linked_outside(attacked.written, tmp_path)
    before = bytes_of(outside)
    done = vislam2tag(*attacked.command)
    assert done.returncode != 0
    assert str(attacked.written) in done.stderr
    assert attacked.written.is_symlink()
    assert bytes_of(outside) == before


@pytest.mark.parametrize("making", [beginning_a_site, copying_a_plan, attaching])
def test_no_file_is_made_through_a_link_to_none(making: Making, tmp_path: Path) -> None:
    attacked = making(tmp_path)
    attacked.written.symlink_to(tmp_path / "none")
    done = vislam2tag(*attacked.command)
    assert done.returncode != 0
    assert f"{attacked.written}: it is a link" in done.stderr
    assert attacked.written.is_symlink()
    assert not (tmp_path / "none").exists()
