"""Labels and data sets in another frame are those of the survey that is processed in it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import polars as pl
import pytest
from PIL import Image
from polars.testing import assert_frame_equal

from tests.surveys import bytes_of
from vislam2tag.common.errors import DatasetError, OutputError, SurveyError, UsageError
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.schema import FINGERPRINTS
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.site.rebase import rebase
from vislam2tag.site.discover import read_site
from vislam2tag.site.frame_change import FrameChange, FrameChanges, estimated_changes
from vislam2tag.site.plans.source import PlanSource, ScalePoint
from vislam2tag.site.site_file import FloorPart, GeoreferencePart, SiteFile, site_file_text

CHANGES = FrameChanges(
    floors=(
        FrameChange(number=0, x_m=100, y_m=-20.5, angle_deg=30),
        FrameChange(number=1, x_m=-7, y_m=3, angle_deg=-100),
    )
)


def moved_site(old: Path, new: Path) -> None:
    """The same survey with its landmarks in the new frame, and its plans placed there by two points."""
    shutil.copytree(old, new)
    marks = new.parent / "marks"
    assert rebase(old, marks, CHANGES) == "site"
    shutil.copytree(marks, new, dirs_exist_ok=True)
    parts = []
    for floor in read_site(old)[0].floors:
        assert floor.plan is not None
        with Image.open(floor.plan) as image:
            width, height = image.size
        ends = CHANGES.by_floor[floor.number].new_T_old @ floor.corners_m
        points = [
            ScalePoint(plan=plan, bcs_m=tuple(end))
            for plan, end in zip(((0.0, float(height)), (float(width), 0.0)), ends.tolist(), strict=True)
        ]
        source = PlanSource(file=str(floor.plan.relative_to(old)), points=(points[0], points[1]))
        parts.append(FloorPart(number=floor.number, plan=source))
    earth = GeoreferencePart(latitude_deg=50.0, longitude_deg=6.0)
    (new / "site.toml").write_text(site_file_text(SiteFile(georeference=earth, floors=tuple(parts))))


@pytest.fixture(scope="module")
def new_survey(clean_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("moved")
    moved_site(clean_survey, folder / "survey")
    return folder / "survey"


@pytest.fixture(scope="module")
def new_run(new_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ``process`` makes of the survey in the new frame."""
    out = tmp_path_factory.mktemp("moved_run") / "out"
    process(new_survey, out)
    return out


@pytest.fixture(scope="module")
def rebased(clean_run: Path, new_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("rebased") / "out"
    assert rebase(clean_run, out, CHANGES, new_survey) == "labels"
    return out


def tables(folder: Path) -> dict[str, pl.DataFrame]:
    return {str(path.relative_to(folder)): pl.read_parquet(path) for path in sorted(folder.glob("*/*.parquet"))}


def test_labels_are_those_of_the_new_frame(rebased: Path, new_run: Path) -> None:
    ours, theirs = tables(rebased), tables(new_run)
    assert ours.keys() == theirs.keys()
    turned = ["qx", "qy", "qz", "qw"]  # a quaternion and its negative are the same turn
    for name, table in ours.items():
        assert_frame_equal(table.drop(turned, strict=False), theirs[name].drop(turned, strict=False), abs_tol=1e-6)


def test_results_and_report_are_of_the_new_frame(rebased: Path, new_run: Path) -> None:
    for path in sorted((rebased / "sessions").glob("*.json")):
        ours, theirs = (json.loads((folder / "sessions" / path.name).read_bytes()) for folder in (rebased, new_run))
        assert ours["fingerprint"] != theirs["fingerprint"]
        assert ours["drawing"]["mapped"][0]["points"][0] == pytest.approx(
            theirs["drawing"]["mapped"][0]["points"][0], abs=0.011
        )
        assert [mark["landmark"] for mark in ours["visits"]] == [mark["landmark"] for mark in theirs["visits"]]
    run = json.loads((rebased / "run.json").read_bytes())
    assert [each["number"] for each in run["rebase"]] == [0, 1]
    assert run["floors"] == json.loads((new_run / "run.json").read_bytes())["floors"]
    assert run["floors"][0]["georeference"]["latitude_deg"] == 50.0
    assert "a grid is drawn instead" not in (rebased / "report.html").read_text()


def test_the_source_stays_and_equal_input_gives_equal_bytes(
    clean_run: Path, new_survey: Path, rebased: Path, tmp_path: Path
) -> None:
    before = bytes_of(clean_run)
    rebase(clean_run, tmp_path / "again", CHANGES, new_survey)
    assert bytes_of(clean_run) == before
    assert bytes_of(tmp_path / "again") == bytes_of(rebased)


def test_labels_of_a_version_with_other_settings_are_refused(clean_run: Path, new_survey: Path, tmp_path: Path) -> None:
    old = shutil.copytree(clean_run, tmp_path / "old")
    run = json.loads((old / "run.json").read_bytes())
    run["settings"] = {"strategy": "local", "visits": {"radius_m": 1.0}}
    (old / "run.json").write_text(json.dumps(run))
    with pytest.raises(DatasetError, match="from another version, with other settings; run `vislam2tag process`"):
        rebase(old, tmp_path / "new", CHANGES, new_survey)
    assert not (tmp_path / "new").exists()


def test_labels_there_and_back(rebased: Path, clean_run: Path, clean_survey: Path, tmp_path: Path) -> None:
    rebase(rebased, tmp_path / "back", CHANGES.inverse, clean_survey)
    for name, table in tables(tmp_path / "back").items():
        assert_frame_equal(table, tables(clean_run)[name], abs_tol=1e-8)


def test_the_change_is_found_by_the_landmarks(clean_survey: Path, new_survey: Path) -> None:
    found = estimated_changes(read_site(clean_survey)[0], read_site(new_survey)[0])
    for change in found.floors:
        expected = CHANGES.by_floor[change.number].new_T_old
        assert change.new_T_old.a == pytest.approx(expected.a, abs=1e-9)
        assert change.new_T_old.b == pytest.approx(expected.b, abs=1e-6)


def test_a_data_set_and_back(clean_run: Path, clean_survey: Path, new_survey: Path, tmp_path: Path) -> None:
    old = build_dataset(clean_run, tmp_path / "old", options=BuildOptions(surveys=(clean_survey,)))
    assert rebase(tmp_path / "old", tmp_path / "new", CHANGES, new_survey) == "data set"
    new = open_dataset(tmp_path / "new")
    floor = new.info.floors[1]
    site_floor = read_site(new_survey)[0].floor(1)
    assert (floor.width_m, floor.lower_left_m) == (site_floor.width_m, site_floor.lower_left_m)
    assert floor.georeference == site_floor.georeference
    assert [source.kind for source in new.info.sources] == ["process", "rebase"]
    assert new.info.sources[1].settings["floors"][1]["angle_deg"] == -100  # type: ignore[index]
    assert sorted(new.files) == ["plans/floor_0.png", "plans/floor_1.png"]
    assert {name: split.groups.to_dicts() for name, split in new.splits.items()} == {
        name: split.groups.to_dicts() for name, split in old.splits.items()
    }
    rebase(tmp_path / "new", tmp_path / "back", CHANGES.inverse, clean_survey)
    back = open_dataset(tmp_path / "back")
    for name, table in old.tables.items():
        assert_frame_equal(back.tables[name].collect(), table.collect(), abs_tol=1e-8)
    assert back.info.floors == old.info.floors


def test_a_data_set_of_the_new_labels_tells_the_change(rebased: Path, tmp_path: Path) -> None:
    built = build_dataset(rebased, tmp_path / "built")
    assert [each["number"] for each in built.info.sources[0].settings["rebase"]] == [0, 1]  # type: ignore[attr-defined]
    assert built.info.floors[0].georeference is not None
    ground = built.tables[FINGERPRINTS].filter(pl.col("floor") == 0).collect()
    assert (ground["x"].drop_nulls() > 80).all()


def test_landmarks_are_replaced_only_where_nothing_else_is(clean_survey: Path, tmp_path: Path) -> None:
    rebase(clean_survey, tmp_path / "out", CHANGES)
    before = bytes_of(tmp_path / "out")
    rebase(clean_survey, tmp_path / "out", CHANGES)
    assert bytes_of(tmp_path / "out") == before
    (tmp_path / "out" / "floor_0" / "LG" / "walk").mkdir(parents=True)
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        rebase(clean_survey, tmp_path / "out", CHANGES)


def test_what_cannot_be_rebased(clean_run: Path, clean_survey: Path, new_survey: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="labels and data sets need --to with the new site"):
        rebase(clean_run, tmp_path / "out", CHANGES)
    only_first = FrameChanges(floors=CHANGES.floors[:1])
    with pytest.raises(SurveyError, match=r"there is no change for floor 1; add it to rebase.toml"):
        rebase(clean_run, tmp_path / "out", only_first, new_survey)
    with pytest.raises(SurveyError, match=r"marker_dict.csv: there is no change for floor 1"):
        rebase(clean_survey, tmp_path / "out", only_first)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UsageError, match="this is the source, which must not change"):
        rebase(clean_run, clean_run, CHANGES, new_survey)
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        rebase(clean_survey, new_survey, CHANGES)
