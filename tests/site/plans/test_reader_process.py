from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import EXTENT, floor_with
from tests.site.plans.hostile import drawings
from vislam2tag.common.errors import SurveyError
from vislam2tag.site.plans import reader_process
from vislam2tag.site.plans.load import floor_plan, plan_extent
from vislam2tag.site.plans.reader_process import read_guarded
from vislam2tag.site.plans.source import PlanSource

TOLD = {
    "nested groups": "its reader crashed",
    "blocks within blocks": "takes longer than 1 s",
    "tiny arc steps": "takes longer than 1 s|needs more than 1 GB",
    "nested arrays": "is nested too deep",
    "a bomb": "has an unknown format|contains level.geojson, which is larger than 50 MB",
    "many pixels": "has more than 100 million pixels",
    "integers beyond floats": r"cannot be read \(OverflowError: int too large to convert to float\)",
}
"""What must be said of some of them."""
HOSTILE = {what: (name, content) for what, name, content in drawings()}


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader_process, "CPU_S", 1)


@pytest.mark.slow
@pytest.mark.parametrize("what", HOSTILE)
@pytest.mark.usefixtures("impatient")
def test_a_hostile_drawing_is_drawn_or_one_message(tmp_path: Path, what: str) -> None:
    name, content = HOSTILE[what]
    (tmp_path / name).write_bytes(content)
    floor = floor_with(tmp_path / name, {"extent": EXTENT})
    source = PlanSource.model_validate({"file": name, "extent": EXTENT})
    if name != "plan.dxf":  # which is read in full for either
        assert "\n" not in message_of(lambda: plan_extent(tmp_path / name, source, None))
    message = message_of(lambda: floor_plan(floor))
    assert "\n" not in message
    assert re.search(TOLD.get(what, ""), message)


def message_of(read: Callable[[], object]) -> str:
    """What is said where a plan cannot be read; nothing where it can."""
    try:
        read()
    except (OSError, SurveyError) as error:
        return str(error)
    return ""


def test_what_one_plan_ended_is_there_for_the_next(tmp_path: Path) -> None:
    name, content = HOSTILE["nested groups"]
    (tmp_path / name).write_bytes(content)
    for _ in range(2):
        with pytest.raises(SurveyError):
            floor_plan(floor_with(tmp_path / name, {"extent": EXTENT}))
    assert floor_plan(floor_with(drawn_floor.geojson(tmp_path), {"extent": EXTENT})).polygons


def test_a_plan_that_was_refused_is_not_waited_for_again(tmp_path: Path) -> None:
    path = tmp_path / "plan.svg"
    floor = floor_with(path, {"extent": EXTENT})
    for content, changed_ns, told in (("<html/>", 1, "SVG"), ("<svg/>", 1, "SVG"), ("<svg/>", 2, "has no size")):
        path.write_text(content)
        os.utime(path, ns=(changed_ns, changed_ns))
        assert told in message_of(lambda: floor_plan(floor))


def test_one_child_serves_many_plans(tmp_path: Path) -> None:
    for name in ("a.svg", "b.svg"):
        (tmp_path / name).write_bytes(b"")
    first, second = (read_guarded(tmp_path / name, os.getpid) for name in ("a.svg", "b.svg"))
    assert first == second != os.getpid()


def test_small_images_are_read_in_this_process(tmp_path: Path) -> None:
    assert read_guarded(drawn_floor.png(tmp_path), os.getpid) == os.getpid()


def test_a_file_too_large_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "plan.dxf"
    with path.open("wb") as file:
        file.truncate(reader_process.MOST_BYTES + 1)
    with pytest.raises(OSError, match="is larger than 200 MB"):
        read_guarded(path, os.getpid)


def test_what_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "plan.svg")
    with pytest.raises(SurveyError, match=r"plan\.svg: the plan of floor 1 "):
        floor_plan(floor_with(tmp_path / "plan.svg", {"extent": EXTENT}))
