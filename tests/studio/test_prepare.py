"""Preparing a survey: what the studio writes is what the command line writes of the same files."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.preparation.planning.floors import write_ring_site
from tests.site.plans import drawn_floor
from tests.studio.running import Page, running_studio
from vislam2tag.cli.app import app
from vislam2tag.pipeline.site.plan import PlanRequest, write_plans
from vislam2tag.pipeline.site.register import FloorFiles, floor_of, register, write_into_site
from vislam2tag.pipeline.site.show import write_walkable
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.site.settings import WalkableSettings

FILE = {"Content-Type": "application/octet-stream"}
POINTS = (120.0, 300.0), (120.0 + 0.2 * drawn_floor.POINTS_PER_M, 300.0)
"""Lower left and right corner of the framed drawing, 20 m apart."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder, ``survey``, in which a survey is to begin; plans beside it."""
    folder = tmp_path_factory.mktemp("prepare")
    (folder / "survey").mkdir()
    drawn_floor.framed_pdf(folder)
    drawn_floor.dxf(folder)
    write_ring_site(folder / "ring")
    return folder


@pytest.fixture(scope="module")
def studio(folder: Path) -> Iterator[Page]:
    with running_studio(folder / "survey", "--jobs", "1") as page:
        assert page.enter().status_code == 204
        yield page


def drop(studio: Page, file: Path) -> int:
    answer = studio.client.post(f"/api/prepare/files?name={file.name}", content=file.read_bytes(), headers=FILE)
    assert answer.status_code == 200, answer.text
    return int(answer.json()["id"])


def refused(answer: httpx.Response) -> str:
    assert answer.status_code == 422, answer.text
    return str(answer.json()["message"])


def test_dropped_plans_become_the_floors_that_site_init_makes(studio: Page, folder: Path) -> None:
    assert studio.get("/api/survey")["floors"] == []
    pdf, dxf = drop(studio, folder / "framed.pdf"), drop(studio, folder / "plan.dxf")
    look = studio.get(f"/api/prepare/files/{pdf}/look")
    assert look["box"] == [0, pytest.approx(1190.55), 0, pytest.approx(841.89)]
    assert look["building"] == pytest.approx([120, POINTS[1][0], 300, 300 + 0.1 * drawn_floor.POINTS_PER_M], abs=3)
    assert (look["size_m"], look["downwards"], look["is_picture"]) == (None, False, True)
    assert studio.get(f"/api/prepare/files/{dxf}/look")["size_m"] == pytest.approx([20.0, 10.0])
    drawn = studio.client.get(f"/api/prepare/files/{pdf}/picture")
    assert drawn.headers["content-type"] == "image/png"
    distance = {"from": POINTS[0], "to": POINTS[1], "metres": 20.0}
    plan: dict[str, Any] = {"file": "plan", "distance": distance}
    ground = {"file": pdf, "part": {"number": 1, "name": "Ground", "plan": plan}}
    assert "has a frame" in studio.post("/api/prepare/floors", ground)["notes"][0]
    studio.post("/api/prepare/floors", {"file": dxf, "part": {"number": 2, "plan": {"file": "plan"}}})
    by_hand = folder / "by-hand"
    clicked = ",".join(map(str, (*POINTS[0], *POINTS[1], 20.0)))
    of_pdf = ("--plan", folder / "framed.pdf", "--floor", "1", "--name", "Ground", "--distance", clicked)
    for options in (of_pdf, ("--plan", folder / "plan.dxf", "--floor", "2")):
        assert CliRunner().invoke(app, ["site", "init", str(by_hand), *map(str, options)]).exit_code == 0
    assert (folder / "survey" / "site.toml").read_text() == (by_hand / "site.toml").read_text()
    floors = studio.get("/api/survey")["floors"]
    assert [floor["extent_m"] for floor in floors] == [pytest.approx([0, 20, 0, 10], abs=0.3)] * 2
    taken = refused(studio.client.post("/api/prepare/floors", json=ground))
    assert "already has that floor" in taken


@pytest.fixture(scope="module")
def ring(studio: Page, folder: Path) -> int:
    """Floor 5 of the survey: corridors around closed rooms, 30 m wide; and of a survey made by hand."""
    number = drop(studio, folder / "ring" / "floor_1" / "floorplan.png")
    distance = {"from": (0.0, 160.0), "to": (600.0, 160.0), "metres": 30.0}
    part = {"number": 5, "plan": {"file": "plan", "distance": distance}}
    studio.post("/api/prepare/floors", {"file": number, "part": part})
    shutil.copytree(folder / "survey", folder / "planned-by-hand")
    return 5


@pytest.mark.slow
def test_landmarks_are_planned_moved_and_written_as_by_plan(studio: Page, folder: Path, ring: int) -> None:
    wish = {"floor": ring, "spacing_m": 15, "rooms": False, "sheets": ["A4", "A3"]}
    plan = studio.post("/api/prepare/plans", wish)
    by_hand = folder / "planned-by-hand"
    summary = write_plans(by_hand, folder / "plan", PlanSettings(), PlanRequest(floors=(ring,), write=True))
    (floor,) = summary.floors
    assert [(one["id"], one["x"], one["y"]) for one in plan["landmarks"]] == [
        (one.id, one.x_m, one.y_m) for one in floor.landmarks
    ]
    assert plan["expected_error_m"] == pytest.approx(floor.expected_error_m, abs=1e-4)
    assert plan["longest_m"] == floor.longest_m
    assert len(plan["sigma_cm"]) == plan["rows"] * plan["columns"]
    held = [{"id": one["id"], "place": one["place"]} for one in plan["landmarks"]]
    first = plan["landmarks"][0]
    change = {"plan": plan["plan"], "landmarks": held, "moved": first["id"], "to": (first["x"] + 4, first["y"] + 4)}
    moved = studio.post("/api/prepare/plans/change", change)
    assert moved["landmarks"][0]["place"] != first["place"]
    assert moved["landmarks"][1:] == plan["landmarks"][1:]
    assert moved["sigma_cm"] != plan["sigma_cm"]
    more = studio.post("/api/prepare/plans/change", {**change, "moved": None})
    assert len(more["landmarks"]) == len(held) + 1
    assert more["expected_error_m"] < plan["expected_error_m"]
    numbered = studio.post("/api/prepare/plans", {**wish, "number": len(held) + 2})
    assert len(numbered["landmarks"]) == len(held) + 2
    as_planned = {"plan": plan["plan"], "landmarks": held}
    assert studio.post("/api/prepare/plans/write", as_planned)["count"] == len(held)
    own = f"floor_{ring}/marker_dict.csv"
    assert (folder / "survey" / own).read_text() == (by_hand / own).read_text()
    assert len(studio.get("/api/survey")["landmarks"]) == len(held)
    gone = studio.client.post("/api/prepare/plans/change", json={**as_planned, "plan": 99})
    assert (gone.status_code, gone.json()["message"]) == (409, "the plan is no longer available; plan again")


@pytest.mark.slow  # of the landmarks that the test before wrote
def test_sheets_are_made_beside_the_survey(studio: Page, folder: Path) -> None:
    assert studio.client.get("/api/prepare/sheets/pdf").status_code == 404
    found = studio.post("/api/prepare/sheets", {"ids": "1-2", "paper": "A3"})
    assert (found["pages"], found["folder"]) == (2, str((folder / "survey-sheets").resolve()))
    answer = studio.client.get("/api/prepare/sheets/pdf")
    assert answer.content == (folder / "survey-sheets" / "sheets.pdf").read_bytes()
    assert answer.headers["content-disposition"].startswith("attachment")
    assert sorted(path.name for path in (folder / "survey-sheets" / "images").glob("*.png")) == ["1.png", "2.png"]


def test_walls_are_painted_into_the_mask_that_every_command_reads(studio: Page, folder: Path) -> None:
    """Floor 2 has a wall from (5, 0) to (5, 6): prolonged to the other side it closes the left part off."""
    whole = studio.post("/api/prepare/walls", {"floor": 2})
    assert (whole["corrected"], whole["area_m2"]) == (False, pytest.approx(200, rel=0.05))
    wall = {"walkable": False, "shape": "brush", "points": [(5, 5.5), (5, 10)], "width_m": 0.3}
    cut = studio.post("/api/prepare/walls", {"floor": 2, "strokes": [wall]})
    assert cut["area_m2"] == pytest.approx(whole["area_m2"] - 50, abs=4)
    door = {"walkable": True, "shape": "polygon", "points": [(4.5, 8), (5.5, 8), (5.5, 9.5), (4.5, 9.5)]}
    kept = studio.post("/api/prepare/walls", {"floor": 2, "strokes": [wall, door], "write": True})
    assert kept["area_m2"] == pytest.approx(whole["area_m2"], abs=2)
    assert kept["area_m2"] < whole["area_m2"]
    assert studio.post("/api/prepare/walls", {"floor": 2}) == {**kept, "corrected": True}
    (found,) = write_walkable(folder / "survey", folder / "walkable", [2], WalkableSettings(), None)
    assert found.area_m2 == pytest.approx(kept["area_m2"])
    (area,) = studio.get("/api/layers/walkable", floor=2)["features"]
    assert [area["coordinates"], *area["holes"]] == kept["rings"]
    everything = {"walkable": False, "shape": "polygon", "points": [(-1, -1), (21, -1), (21, 11), (-1, 11)]}
    nowhere = studio.client.post("/api/prepare/walls", json={"floor": 2, "strokes": [everything], "write": True})
    assert "the plan has no walkable space" in refused(nowhere)
    assert studio.post("/api/prepare/walls", {"floor": 2, "anew": True, "write": True})["area_m2"] == whole["area_m2"]
    assert not (folder / "survey" / "floor_2" / "floorplan.mask.png").exists()


def station_files(folder: Path, places: Mapping[str, complex], corner: complex = 29 + 15j) -> tuple[Path, Path]:
    """What a station that stands somewhere measured of landmarks and four known points, and these."""
    known = {"A": 1 + 1j, "B": corner.real + 1j, "C": corner, "D": 1 + corner.imag * 1j}
    lines = ["Punkt;Y;X;Höhe"]
    for name, place in (known | dict(places)).items():
        seen = (place - 20 - 10j) * np.exp(0.7j) + 1000 + 2000j
        lines.append(f"{name};{seen.real:.3f};{seen.imag:.3f};1,4".replace(".", ","))
    (folder / "S1.txt").write_text("\n".join(lines) + "\n")
    rows = [f"{name},{place.real},{place.imag},0" for name, place in known.items()]
    (folder / "known.csv").write_text("\n".join(["name,x,y,z", *rows]) + "\n")
    return folder / "S1.txt", folder / "known.csv"


def test_a_station_file_places_landmarks_as_register_does(studio: Page, folder: Path, ring: int) -> None:
    station, control = station_files(folder, {"1": 2.05 + 8j, "2": 15 + 1.95j, "3": 27.95 + 8j})
    sources = FloorFiles(stations=[station], control=control)
    by_hand = folder / "registered-by-hand"
    shutil.copytree(folder / "survey", by_hand)
    site, floor = floor_of(by_hand, ring)
    expected = register(site, floor, sources, RegistrationSettings())
    request = {"floor": ring, "stations": [drop(studio, station)], "control": drop(studio, control)}
    found = studio.post("/api/prepare/positions", request)
    assert found == {"found": json.loads(expected.model_dump_json()), "written": []}
    assert len(found["found"]["residuals"]) == 2 * 4  # each known point as given, and as shot
    assert "known points" in refused(studio.client.post("/api/prepare/positions", json={**request, "control": None}))
    studio.client.post("/api/prepare/positions", json={**request, "write": True, "replace": True}).raise_for_status()
    write_into_site(by_hand, floor, expected, replace=True)
    for name in ("marker_dict.csv", "registration.json"):
        assert (folder / "survey" / f"floor_{ring}" / name).read_text() == (
            by_hand / f"floor_{ring}" / name
        ).read_text()


def test_a_file_that_is_no_plan_is_one_message_and_a_form_is_refused(studio: Page, folder: Path) -> None:
    (folder / "broken.pdf").write_bytes(b"%PDF-1.4 and nothing else")
    number = drop(studio, folder / "broken.pdf")
    assert "broken.pdf: the plan" in refused(studio.client.get(f"/api/prepare/files/{number}/look"))
    assert studio.client.get("/api/prepare/files/77/look").status_code == 404
    empty = studio.client.post("/api/prepare/files?name=empty.pdf", headers=FILE)
    assert "is empty" in refused(empty)
    outside = studio.client.post("/api/prepare/files?name=../../etc/passwd", content=b"x", headers=FILE)
    assert outside.json()["name"] == "passwd"
    for kind in ("application/json", "multipart/form-data", "text/plain"):
        form = studio.client.post("/api/prepare/files?name=plan.pdf", content=b"x", headers={"Content-Type": kind})
        assert form.status_code == 403
    as_file = studio.client.post("/api/jobs", content=b"{}", headers=FILE)
    assert as_file.status_code == 403
