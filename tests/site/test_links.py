"""Where links below a survey lead, and that `inspect` lists them."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.site.site import write_survey
from vislam2tag.sessions.inspection import inspect_survey
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.discover import read_site
from vislam2tag.site.links import is_from_outside, links_in, outside_link, shared_survey


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A folder with every kind of link, beside one that it may lead to."""
    root, outside = tmp_path / "survey", tmp_path / "outside"
    (root / "store" / "deep").mkdir(parents=True)
    outside.mkdir()
    (outside / "file").write_text("private")
    (outside / "back").symlink_to(root / "store")
    for name, target in {
        "inside": "store/deep",
        "absolute": str(root / "store"),
        "around": "../survey/store",
        "out": "../outside",
        "chain": "inside_chain",
        "inside_chain": "../outside/back",
        "nothing": "store/nothing",
        "loop": "loop",
        "zero": "/dev/zero",
        "environ": "/proc/self/environ",
    }.items():
        (root / name).symlink_to(target)
    (root / "store" / "up").symlink_to("..")
    return root


def test_links_lead_inside_outside_or_to_nothing(root: Path) -> None:
    links = {link.name: link for link in links_in(root)}
    assert {name for name, link in links.items() if link.outside} == {
        *("out", "chain", "inside_chain", "zero", "environ")
    }
    assert {name for name, link in links.items() if link.broken} == {"nothing", "loop"}
    assert links["out"].target == "../outside"
    assert {"inside", "absolute", "around", "store/up"} < links.keys()


def test_a_path_through_a_link_is_outside_by_the_name_of_the_link(root: Path) -> None:
    assert outside_link(root, root / "out" / "file") == "out"
    assert outside_link(root, root / "chain" / "deep") == "chain"
    assert outside_link(root, root / "inside") is None
    assert outside_link(root, root / "store" / "not there") is None
    assert outside_link(root, root / ".." / "outside" / "file") == "../outside/file"
    assert outside_link(root, Path("/etc/hostname")) == "/etc/hostname"


def test_the_folder_itself_may_be_a_link(root: Path, tmp_path: Path) -> None:
    (tmp_path / "typed").symlink_to(root)
    assert outside_link(tmp_path / "typed", tmp_path / "typed" / "store" / "deep") is None
    assert outside_link(tmp_path / "typed", tmp_path / "typed" / "out") == "out"


def test_loops_end_and_what_is_linked_within_is_looked_at(root: Path) -> None:
    assert not is_from_outside(root, [root / "store" / "deep"])
    (root / "store" / "deep" / "to").symlink_to("../other")
    (root / "store" / "other").mkdir()
    (root / "store" / "other" / "round").symlink_to("../deep")
    assert not is_from_outside(root, [root / "inside"])
    (root / "store" / "other" / "wifi.csv").symlink_to("../../../outside/file")
    assert is_from_outside(root, [root / "inside"])


def test_inspect_lists_links_with_what_they_lead_to(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    assert inspect_survey(survey).links == ()
    (survey / "floor_1").rename(tmp_path / "elsewhere")
    (survey / "floor_1").symlink_to("../elsewhere")
    (survey / "gone").symlink_to("nothing")
    found = inspect_survey(survey)
    assert [(link.name, link.outside, link.broken) for link in found.links] == [
        ("floor_1", True, False),
        ("gone", False, True),
    ]
    counts = {finding.kind: finding.count for finding in found.findings}
    assert (counts["links"], counts["links_outside"], counts["broken_links"]) == (2, 1, 1)
    shown = vislam2tag("inspect", survey).stdout
    assert "floor_1 -> ../elsewhere" in shown
    assert "--follow-links" in shown
    listed = json.loads(vislam2tag("inspect", survey, "--json").stdout)
    assert [link["target"] for link in listed["links"]] == ["../elsewhere", "nothing"]


def test_site_files_from_outside_are_read_but_not_shared(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    whole = open_survey(survey).site
    (survey / "floor_1" / "marker_dict.csv").rename(tmp_path / "marks.csv")
    (survey / "floor_1" / "marker_dict.csv").symlink_to(tmp_path / "marks.csv")
    (survey / "floor_dimensions.csv").rename(tmp_path / "floors.csv")
    (survey / "floor_dimensions.csv").symlink_to(tmp_path / "floors.csv")
    assert open_survey(survey).site.landmarks.ids == whole.landmarks.ids
    site, findings = read_site(survey)
    assert 1 not in site.landmarks.floor
    assert {floor.name for floor in site.floors} == {f"Floor {floor.number}" for floor in site.floors}
    (left_out,) = [finding for finding in findings if finding.kind == "from_outside"]
    assert "floor_1/marker_dict.csv" in left_out.message
    assert "floor_dimensions.csv" in left_out.message
    assert "--follow-links" in left_out.message
    followed, _ = read_site(survey, follow_links=True)
    assert followed.landmarks.ids == whole.landmarks.ids


@pytest.mark.parametrize("below", ["", "../"])
def test_plans_from_outside_are_found_whatever_path_leads_to_the_survey(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, below: str
) -> None:
    root = write_survey(tmp_path / "survey")
    (root / "floor_4" / "floorplan.png").rename(tmp_path / "plan.png")
    (root / "floor_4" / "floorplan.png").symlink_to(tmp_path / "plan.png")
    monkeypatch.chdir(root if below else tmp_path)
    site, findings = read_site(Path(f"{below}survey"))
    assert [floor.plan is None for floor in site.floors] == [False, True]
    (left_out,) = [finding.message for finding in findings if finding.kind == "from_outside"]
    assert "outside the survey: floor_4/floorplan.png;" in left_out


def test_names_within_a_linked_folder_stay_private(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    (tmp_path / "home" / "letters").mkdir(parents=True)
    (survey / "floor_1" / "device").symlink_to(tmp_path / "home")
    opened = open_survey(survey)
    assert any("letters" in finding.file for finding in opened.findings)
    assert not any("letters" in finding.file for finding in shared_survey(opened).findings)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("target", ["/dev/zero", "/proc/self/environ", "pipe"])
def test_links_to_special_files_are_not_waited_for(tmp_path: Path, target: str) -> None:
    survey = write_survey(tmp_path / "survey")
    os.mkfifo(survey / "floor_1" / "pipe")
    for name in ("floorplan.jpg", "refmarker.csv", "rooms.csv", "floorplan.mask.png"):
        (survey / "floor_1" / name).unlink(missing_ok=True)
        (survey / "floor_1" / name).symlink_to(target)
    (survey / "floor_1" / "linked").symlink_to(target)
    found = inspect_survey(survey)
    assert len(found.links) == 5
    floor = read_site(survey)[0].floor(1)
    assert (floor.plan, floor.mask, floor.rooms, floor.control_points.ids) == (None, None, None, ())
