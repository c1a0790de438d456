"""A walk whose landmark table is wrong says so, and none of its frames is ``ok``; a right walk says nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

import vislam2tag as vt
from tests.pipeline.labels.test_map_walk import POSE, table
from tests.surveys import make_survey
from vislam2tag.labeling.mapped_walk import MappedWalk

OF_TABLES = {"survey_fault", "walk_contradicts_table"}


class Made:
    """A simulated walk as tables."""

    def __init__(self, folder: Path, seed: int, severity: str, seconds: float = 120.0) -> None:
        survey = make_survey(folder, devices=("LG",), seconds=seconds, severity=severity, seed=seed)
        session = next((survey / "floor_0" / "LG").iterdir())
        self.poses = table(session / "poses.csv", ["time_ns", *POSE])
        self.sightings = table(session / "initPoses.csv", ["id", "time_ns", *POSE])
        self.landmarks = pl.read_csv(survey / "floor_0" / "marker_dict.csv")

    def mapped(self, landmarks: pl.DataFrame) -> MappedWalk:
        return vt.map_walk(self.poses, self.sightings, landmarks)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return Made(tmp_path_factory.mktemp("walk") / "survey", 2, "none")


@pytest.mark.parametrize("wrong", ["exchanged", "mirrored", "cm"])
def test_a_wrong_table_is_named_and_no_frame_is_ok(made: Made, wrong: str) -> None:
    landmarks = {
        "exchanged": made.landmarks.rename({"x": "y", "y": "x"}),
        "mirrored": made.landmarks.with_columns(x=-pl.col("x")),
        "cm": made.landmarks.with_columns(pl.col("x", "y") * 100),
    }[wrong]
    walk = made.mapped(landmarks)
    (found,) = (finding for finding in walk.findings if finding.kind in OF_TABLES)
    said = "in cm, not in metres" if wrong == "cm" else "mirrored"
    assert found.kind == "survey_fault"
    assert found.message.startswith(f"the landmark table of floor 0 is {said}: ")
    assert "ok" not in set(walk.frames["status"])
    assert "ok" not in set(walk.label(made.poses.select("time_ns"))["status"])


def test_landmarks_at_one_anothers_places_contradict_the_walk(made: Made) -> None:
    seen = made.landmarks.filter(pl.col("id").cast(pl.String).is_in(made.sightings["id"].unique().to_list()))
    order = np.random.default_rng(0).permutation(seen.height)
    walk = made.mapped(seen.with_columns(seen["x"][order], seen["y"][order]))
    assert OF_TABLES & {found.kind for found in walk.findings}


def test_one_landmark_away_from_its_place_is_named(made: Made) -> None:
    seen = [name for name in made.landmarks["id"].cast(pl.String) if name in set(made.sightings["id"])]
    away = seen[len(seen) // 2]
    there = pl.col("id").cast(pl.String) == away
    walk = made.mapped(made.landmarks.with_columns(x=pl.col("x") + pl.when(there).then(3.0).otherwise(0.0)))
    (found,) = (finding for finding in walk.findings if finding.kind == "contradicting_landmark")
    assert found.message.startswith(f"landmark {away} contradicts the others by 3.0")


def test_a_walk_that_fits_a_mirrored_table_as_well_says_so(made: Made) -> None:
    first = made.sightings["id"].unique(maintain_order=True)[:2].to_list()
    few = made.landmarks.filter(pl.col("id").cast(pl.String).is_in(first))
    assert "table_not_verified" in {found.kind for found in made.mapped(few).findings}
    for enough in (made.landmarks, made.landmarks.head(0)):
        assert "table_not_verified" not in {found.kind for found in made.mapped(enough).findings}


@pytest.mark.parametrize(("seed", "severity"), [(2, "none"), (3, "default"), (8, "severe"), (11, "severe")])
def test_a_right_walk_is_not_contradicted(tmp_path: Path, seed: int, severity: str) -> None:
    made = Made(tmp_path / "survey", seed, severity)
    assert not OF_TABLES & {found.kind for found in made.mapped(made.landmarks).findings}
