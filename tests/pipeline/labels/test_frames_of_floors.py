"""A walk over floors with different frames: each row is told in the frame of its own floor."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.labeling.new_frame import changed_table
from vislam2tag.pipeline.labels.landmark_survey import reduce_session
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.site.init import describe_published
from vislam2tag.pipeline.site.rebase import write_changed_site
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb, SiteColumn
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.frame_change import FrameChange, FrameChanges
from vislam2tag.site.site_file import Relation, read_site_file, site_file_text

UPPER = FrameChange(number=1, x_m=12, y_m=-4, angle_deg=40)
"""From the frame that both floors had to the one that floor 1 gets."""
ELEVATED = frozenset({SiteColumn.ELEVATION, SiteColumn.Z})


@pytest.fixture(scope="module")
def surveys(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A walk over two floors: in one frame, and with the upper floor's landmarks in another one."""
    folder = tmp_path_factory.mktemp("frames")
    one, two = folder / "one" / "survey", folder / "two" / "survey"
    scenario = regular_survey(3, "none", (0, 1), ("LG",), 1, 90.0, climb=Climb.STAIRS)
    simulate(scenario, one, WritingOptions(columns=ELEVATED))
    describe_published(one)
    shutil.copytree(one, two)
    write_changed_site(one, folder / "marks", FrameChanges(floors=(FrameChange(number=0), UPPER)))
    shutil.copytree(folder / "marks" / "floor_1", two / "floor_1", dirs_exist_ok=True)
    site = read_site_file(one)
    upper = UPPER.inverse
    relation = Relation(x_m=upper.x_m, y_m=upper.y_m, angle_deg=upper.angle_deg)
    floors = (site.floors[0], site.floors[1].model_copy(update={"site_T_bcs": relation}))
    (two / "site.toml").write_text(site_file_text(site.model_copy(update={"floors": floors})))
    process(one, folder / "one" / "out")
    process(two, folder / "two" / "out")
    return folder / "one" / "out", folder / "two" / "out"


def test_rows_are_told_in_the_frame_of_their_floor(surveys: tuple[Path, Path]) -> None:
    one, two = surveys
    floors = set()
    for path in sorted(one.glob("*/*.parquet")):
        plain = pl.read_parquet(path)
        floors |= set(plain["floor"].unique())
        expected = changed_table(plain.lazy(), {0: FrameChange(number=0), 1: UPPER}).collect()
        turned = ["qx", "qy", "qz", "qw"]
        found = pl.read_parquet(two / path.relative_to(one))
        assert_frame_equal(
            found.drop(turned, strict=False), expected.drop(turned, strict=False), abs_tol=1e-5, rel_tol=1e-6
        )
    assert floors == {0, 1}


def test_what_is_drawn_elsewhere_lies_there(surveys: tuple[Path, Path]) -> None:
    one, two = surveys
    drawn = 0
    for path in sorted(one.glob("sessions/*.json")):
        plain, found = (json.loads(each.read_bytes()) for each in (path, two / path.relative_to(one)))
        assert plain["elsewhere"].keys() == found["elsewhere"].keys()
        for number, drawing in plain["elsewhere"].items():
            change = UPPER.new_T_old if int(number) == 1 else FrameChange(number=0).new_T_old
            for before, after in zip(drawing["mapped"], found["elsewhere"][number]["mapped"], strict=True):
                assert change @ np.array(before["points"][0]) == pytest.approx(after["points"][0], abs=0.02)
                drawn += 1
    assert drawn


def test_landmarks_are_not_surveyed_across_frames(surveys: tuple[Path, Path]) -> None:
    errors = []
    for out in surveys:
        survey = open_survey(out.parent / "survey")
        task = SessionTask(survey.sessions[0], survey.site, Corrections())
        errors.append(reduce_session(MappingSettings(), task).error)
    assert errors[0] is None
    assert errors[1] is not None
    assert "floors with different frames" in errors[1]
