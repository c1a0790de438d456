"""Mistakes about a survey as a whole are findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.discover import BESIDE_M, LEAST_BYTES

POSE = "1000000000; 0,1; 0,2; 0,3; 0,0; 0,0; 0,0; 1,0\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """One walk on a floor of 40 m x 20 m with a landmark on its wall."""
    walk = tmp_path / "floor_1" / "LG" / "walk"
    walk.mkdir(parents=True)
    (walk / "poses.csv").write_text(POSE * (LEAST_BYTES // len(POSE) + 1))
    (tmp_path / "floor_dimensions.csv").write_text("floor,width,height\n1,40,20\n")
    (tmp_path / "floor_1" / "marker_dict.csv").write_text("id,x,y\n1,0,0\n")
    return tmp_path


def kinds(root: Path) -> list[str]:
    wanted = ("landmarks_off_plan", "walk_twice", "unrecognised_folder")
    return [finding.kind for finding in open_survey(root).findings if finding.kind in wanted]


@pytest.mark.parametrize(("x", "off"), [(40 + BESIDE_M - 0.1, False), (40 + BESIDE_M + 0.1, True), (-9.0, True)])
def test_landmarks_off_the_plan(root: Path, x: float, off: bool) -> None:
    (root / "floor_1" / "marker_dict.csv").write_text(f"id,x,y\n1,0,0\n2,{x},5\n3,,\n")
    assert kinds(root) == ["landmarks_off_plan"] * off
    (root / "corrections.toml").write_text('[[landmark_units]]\nfloor = 1\nunit = "ft"\n')
    assert kinds(root) == [], "a corrected table is not judged by what the file says"


def test_a_walk_that_is_there_twice(root: Path) -> None:
    copy = root / "floor_1" / "LG" / "walk (1)"
    copy.mkdir()
    (copy / "poses.csv").write_bytes((root / "floor_1/LG/walk/poses.csv").read_bytes())
    assert kinds(root) == ["walk_twice"]
    (copy / "poses.csv").write_text((root / "floor_1/LG/walk/poses.csv").read_text().replace("0,1", "0,4"))
    assert kinds(root) == [], "of the same size, but another walk"


def test_walks_in_a_folder_that_is_no_floor(root: Path) -> None:
    (root / "Annex" / "LG" / "walk").mkdir(parents=True)
    assert kinds(root) == []
    (root / "Annex" / "LG" / "walk" / "poses.csv").write_text(POSE)
    assert kinds(root) == ["unrecognised_folder"]
