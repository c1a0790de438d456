from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.dataset.test_labelled import RUN, write_out
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.dataset.model import FloorInfo
from vislam2tag.pipeline.datasets.sources import LabelledSource, merged_floors, named_sessions, open_sources


def sources(folder: Path, *floors: dict[str, object], buildings: tuple[str, ...] = ()) -> tuple[LabelledSource, ...]:
    """One source for each floor record given."""
    usual = {"number": 1, "name": "One", "elevation_m": None, "width_m": 60.0, "height_m": 30.0}
    outs = [write_out(folder / str(n), RUN | {"floors": [usual | floor]}) for n, floor in enumerate(floors)]
    return open_sources(outs, buildings, [None] * len(outs), outs, Folder.at(folder / "scratch"))


def test_floors_that_agree_are_one(tmp_path: Path) -> None:
    floors, plans = merged_floors(sources(tmp_path, {}, {"name": "other"}, {"number": -1, "width_m": None}))
    assert [(floor.number, floor.name, floor.width_m) for floor in floors] == [(-1, "One", None), (1, "One", 60.0)]
    assert plans == {}
    assert isinstance(floors[0], FloorInfo)


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        ({}, {"width_m": 61.0}, "60 m wide .*0 and 61 m in .*1"),
        ({}, {"height_m": 20.0}, "30 m deep .*0 and 20 m in .*1"),
        ({"elevation_m": 0.0}, {"elevation_m": 3.5}, r"0 m high up in .*0 and 3.5 m in .*1"),
    ],
)
def test_floors_that_clash_name_both_sources(
    tmp_path: Path, first: dict[str, object], second: dict[str, object], words: str
) -> None:
    with pytest.raises(DatasetError, match=f"floor 1 is {words}: these are two buildings.*--building"):
        merged_floors(sources(tmp_path / "one", first, second))
    floors, _ = merged_floors(sources(tmp_path / "two", first, second, buildings=("a", "b")))
    assert [floor.building for floor in floors] == ["a", "b"]


def test_an_unknown_extent_clashes_with_none(tmp_path: Path) -> None:
    assert len(merged_floors(sources(tmp_path, {"width_m": None}, {"elevation_m": 3.0}))[0]) == 1


def test_plans_lie_by_building_and_floor(tmp_path: Path) -> None:
    one = sources(tmp_path, {}, {}, buildings=("Main: hall", ""))
    drawn = tuple(replace(source, plans={1: Path("a/floorplan.JPG")}) for source in one)
    floors, plans = merged_floors(drawn)
    assert sorted(plans) == ["plans/Main-hall.floor_1.jpg", "plans/floor_1.jpg"]
    assert [floor.plan for floor in floors] == ["plans/floor_1.jpg", "plans/Main-hall.floor_1.jpg"]


def test_sessions_are_named_once(tmp_path: Path) -> None:
    same = sources(tmp_path / "same", {}, {})
    processed_on_the_way = (same[0], replace(same[1], named=Path("the survey")))
    with pytest.raises(DatasetError, match=r"session floor_1.LG.a is in .*0 and in the survey: give"):
        named_sessions(processed_on_the_way)
    named = named_sessions(sources(tmp_path / "two", {}, {}, buildings=("west wing", "annex")))
    assert [name for name, _, _ in named] == [
        "annex.floor_1.LG.a",
        "annex.floor_1.LG.b",
        "west-wing.floor_1.LG.a",
        "west-wing.floor_1.LG.b",
    ]
    assert [source.building for _, source, _ in named] == ["annex", "annex", "west wing", "west wing"]


def test_each_source_has_a_building_or_none_has(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="2 names for 1 sources"):
        sources(tmp_path, {}, buildings=("a", "b"))
