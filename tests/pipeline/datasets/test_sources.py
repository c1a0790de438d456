"""What sessions' findings add up to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.datasets.test_labelled import RUN, write_out
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.datasets.model import FloorInfo
from vislam2tag.pipeline.datasets.sources import (
    LabelledSource,
    SessionOutcome,
    merged_floors,
    named_sessions,
    open_sources,
    survey_findings,
)
from vislam2tag.pipeline.labels.walked_floors import WalkPlaces

NOWHERE = WalkPlaces(np.empty((0, 2)), np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64))


def finding(kind: FindingKind, count: int, message: str = "m", severity: Severity = Severity.INFO) -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=severity)


def outcome(device: str, readings: int, error: str | None = None, *found: Finding) -> SessionOutcome:
    return SessionOutcome("s", device, error, ("wifi",) if readings else (), found, NOWHERE)


def test_what_sessions_lack_is_counted() -> None:
    fine = survey_findings(
        [
            outcome("LG", 5, None, finding("encoding", 1)),
            outcome("Pixel", 2, None, finding("encoding", 2)),
        ]
    )
    assert fine == [finding("encoding", 3)]
    outcomes = [outcome("LG", 5), outcome("LG", 0, "no frame"), outcome("Pixel", 0), outcome("Pixel", 0, "lost")]
    found = {each.kind: each for each in survey_findings(outcomes)}
    assert (found["session_without_label"].count, found["device_without_scan"].count) == (2, 1)
    assert "the first: no frame" in found["session_without_label"].message
    assert found["device_without_scan"].message.endswith(": Pixel")
    (nothing,) = survey_findings([outcome("LG", 0), outcome("Pixel", 0)])
    assert (nothing.kind, nothing.count, nothing.severity) == ("no_radio_reading", 2, Severity.WARNING)


def sources(folder: Path, *floors: dict[str, object], buildings: tuple[str, ...] = ()) -> tuple[LabelledSource, ...]:
    """One source for each floor record given."""
    usual = {"number": 1, "name": "One", "elevation_m": None, "width_m": 60.0, "height_m": 30.0}
    outs = [write_out(folder / str(n), RUN | {"floors": [usual | floor]}) for n, floor in enumerate(floors)]
    return open_sources(outs, buildings, [None] * len(outs), outs, Folder.at(folder / "scratch"))


def test_the_building_of_the_site_is_that_of_the_source(tmp_path: Path) -> None:
    def named(folder: str, *names: str) -> tuple[LabelledSource, ...]:
        outs = [
            write_out(tmp_path / folder / str(n), RUN | ({"building": name} if name else {}))
            for n, name in enumerate(names)
        ]
        return open_sources(outs, (), [None] * len(outs), outs, Folder.at(tmp_path / folder / "scratch"))

    assert [(one.building, one.prefixed) for one in named("one", "Hall")] == [("Hall", False)]
    assert [(one.building, one.prefixed) for one in named("same", "Hall", "")] == [("Hall", False)] * 2
    assert [(one.building, one.prefixed) for one in named("two", "Hall", "Annex")] == [("Hall", True), ("Annex", True)]


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
    with pytest.raises(DatasetError, match=f"floor 1 is {words}: if these are two buildings.*--building"):
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
