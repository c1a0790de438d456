"""From a site to the folder of its plans."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.preparation.planning.floors import write_ring_site
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.pipeline.site.plan import PlanRequest, ids_in_use, without_landmarks, write_plans
from vislam2tag.preparation.planning.records import PlanSummary
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.site.discover import read_site

SETTINGS = PlanSettings(further=1)
FILES = ["floor_1.plan.pdf", "floor_1.plan.png", "floor_1.sigma.pdf", "floor_1.sigma.png"]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ring_site(tmp_path_factory.mktemp("site") / "ring")


@pytest.fixture(scope="module")
def planned(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("planned") / "plan"
    write_plans(site, out, SETTINGS, PlanRequest())
    return out


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def test_a_plan_is_drawings_lists_a_summary_and_a_page(planned: Path) -> None:
    assert sorted(path.name for path in planned.iterdir()) == [
        OWN_FILES,
        *FILES,
        "index.html",
        "landmarks.csv",
        "plan.json",
    ]
    summary = PlanSummary.model_validate_json((planned / "plan.json").read_text())
    (floor,) = summary.floors
    assert floor.number == floor.bound == len(floor.landmarks) == 6
    assert [landmark.id for landmark in summary.landmarks] == ["1", "2", "3", "4", "5", "6"]
    lines = (planned / "landmarks.csv").read_text().splitlines()
    assert lines[0] == "id,floor,x,y,z,heading_rad,sheet,width_m,near,floor_name,building"
    assert len(lines) == 7
    with Image.open(planned / "floor_1.plan.png") as image:
        assert np.asarray(image.convert("L")).std() > 5
    page = (planned / "index.html").read_text()
    assert page.count("data:image/png;base64,") == 1
    assert "Hang up <b>6</b> sheets" in page
    assert "Proven minimum for the" in page


def test_the_same_site_gives_the_same_bytes(site: Path, planned: Path, tmp_path: Path) -> None:
    write_plans(site, tmp_path / "again", SETTINGS, PlanRequest())
    assert digests(tmp_path / "again") == digests(planned)


@pytest.mark.usefixtures("undrawn_figures")
def test_landmarks_written_into_the_site_are_fixed_the_next_time(tmp_path: Path) -> None:
    root = write_ring_site(tmp_path / "site")
    (root / "floor_1" / "marker_dict.csv").write_text("id,x,y\n2,,\nmain,10.0,0.1\n")
    first = write_plans(root, tmp_path / "plan", SETTINGS, PlanRequest(write=True))
    assert first.floors[0].fixed == ("main",)
    assert [landmark.id for landmark in first.landmarks][:2] == ["1", "3"]
    text = (root / "floor_1" / "marker_dict.csv").read_text()
    assert text.startswith("id,x,y,z,sigma_m,heading_rad,heading_sigma_rad,sheet,width_m\n2,,\nmain,10.0,0.1\n1,")
    landmarks = read_site(root)[0].landmarks
    assert landmarks.ids == ("2", "main", *(landmark.id for landmark in first.landmarks))
    again = write_plans(root, tmp_path / "plan", SETTINGS, PlanRequest(write=True))
    assert again.landmarks == ()
    assert again.floors[0].number == first.floors[0].number
    assert (root / "floor_1" / "marker_dict.csv").read_text() == text
    again = write_plans(root, tmp_path / "anew", SETTINGS, PlanRequest(ignore_existing=True, first_id=5))
    assert not {landmark.id for landmark in again.landmarks} & set(landmarks.ids)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_restarted_plan_drops_planned_landmarks_and_keeps_measured_ones(tmp_path: Path) -> None:
    root = write_ring_site(tmp_path / "site")
    folder = root / "floor_1"
    folder.mkdir(exist_ok=True)
    (folder / "marker_dict.csv").write_text("id,x,y,note\nmain,10.0,0.1,door\n")
    first = write_plans(root, tmp_path / "plan", SETTINGS, PlanRequest(write=True))
    wide = SETTINGS.model_copy(update={"spacing_m": 40.0})
    again = write_plans(root, tmp_path / "plan", wide, PlanRequest(restart=True, write=True))
    dropped = tuple(landmark.id for landmark in first.landmarks)
    assert again.floors[0].dropped == dropped
    assert again.floors[0].fixed == ("main",)
    assert 0 < len(again.landmarks) < len(first.landmarks)
    assert again.landmarks[0].id == "1"
    landmarks = read_site(root)[0].landmarks
    assert landmarks.ids == ("main", *(landmark.id for landmark in again.landmarks))
    assert landmarks.planned_ids == landmarks.ids[1:]
    assert "main,10.0,0.1,door" in (folder / "marker_dict.csv").read_text()
    assert ids_in_use(root, read_site(root)[0], ("7",)) == landmarks.ids
    (folder / "phone" / "walk").mkdir(parents=True)
    site = read_site(root)[0]
    kept = without_landmarks(site, {1: landmarks.planned_ids})
    assert ids_in_use(root, kept, site.landmarks.ids) == landmarks.ids, "a walk may have seen their sheets"


@pytest.mark.usefixtures("undrawn_figures")
def test_ids_go_on_from_floor_to_floor(tmp_path: Path) -> None:
    root = write_ring_site(tmp_path / "site", (0, 2))
    heard: list[tuple[str, int]] = []
    settings = SETTINGS.model_copy(update={"further": 0})
    found = write_plans(root, tmp_path / "plan", settings, PlanRequest(first_id=101), lambda *told: heard.append(told))
    assert [floor.floor for floor in found.floors] == [0, 2]
    assert [landmark.id for landmark in found.landmarks] == [str(number) for number in range(101, 113)]
    assert {total for _, total in heard} == {2}
    assert [step for step, _ in heard].count("walkable space") == 2


def test_what_cannot_be_planned_is_told_and_leaves_nothing(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "plan"
    with pytest.raises(UsageError, match=r"--floor 7: the site does not have this floor; its floors are: 1"):
        write_plans(site, out, SETTINGS, PlanRequest(floors=(7,)))
    with pytest.raises(UsageError, match="--mask corrects one floor"):
        write_plans(site, out, SETTINGS, PlanRequest(mask=tmp_path / "mask.png"))
    forbidden = tmp_path / "forbidden.csv"
    forbidden.write_text("floor,x0,y0,x1,y1\n1,-5,-5,99,99\n")
    with pytest.raises(SurveyError, match="floor 1: has no wall for a sheet"):
        write_plans(site, out, SETTINGS, PlanRequest(forbidden=forbidden))
    forbidden.write_text("floor,x0,y0,x1,y1\n3,-5,-5,99,99\n")
    with pytest.raises(SurveyError, match="the site has no floor 3"):
        write_plans(site, out, SETTINGS, PlanRequest(forbidden=forbidden))
    assert not out.exists()
    out.mkdir()
    (out / "thesis.tex").write_text("mine")
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        write_plans(site, out, SETTINGS, PlanRequest())


@pytest.mark.usefixtures("undrawn_figures")
def test_a_site_without_floor_folders_gets_them_with_its_landmarks(tmp_path: Path) -> None:
    layout = write_ring_site(tmp_path / "layout")
    root = tmp_path / "site"
    root.mkdir()
    (layout / "floor_1" / "floorplan.png").rename(root / "first.png")
    (root / "site.toml").write_text(
        '[[floors]]\nnumber = 1\n[floors.plan]\nfile = "first.png"\n'
        "[floors.plan.extent]\nwidth_m = 30.0\nheight_m = 16.0\n"
    )
    settings = SETTINGS.model_copy(update={"further": 0})
    found = write_plans(root, tmp_path / "plan", settings, PlanRequest(write=True))
    assert read_site(root)[0].landmarks.ids == tuple(landmark.id for landmark in found.landmarks)


@pytest.mark.usefixtures("undrawn_figures")
def test_rooms_without_a_door_and_ids_given_twice_are_told(tmp_path: Path) -> None:
    root = write_ring_site(tmp_path / "site")
    (root / "floor_1" / "marker_dict.csv").write_text("id,x,y\n4,1.0,8.0\n4,2.0,8.0\n")
    settings = SETTINGS.model_copy(update={"further": 0})
    found = write_plans(root, tmp_path / "plan", settings, PlanRequest())
    assert [one.kind for one in found.floors[0].findings] == ["closed_off"]
    assert [one.kind for one in found.findings] == ["duplicate_landmarks"]
    page = (tmp_path / "plan" / "index.html").read_text()
    assert "rooms without an open door" in page
    assert "an id may appear only once on a floor" in page
