"""Preparing a survey: what the studio writes is what the command line writes of the same files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.cli.command import vislam2tag
from tests.studio.running import Page, running_studio
from tests.survey.plans import drawn_floor

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
    assert (look["has_scale"], look["downwards"], look["is_picture"]) == (False, False, True)
    assert studio.get(f"/api/prepare/files/{dxf}/look")["has_scale"]
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
    assert vislam2tag("site", "init", by_hand, *of_pdf).returncode == 0
    assert vislam2tag("site", "init", by_hand, "--plan", folder / "plan.dxf", "--floor", "2").returncode == 0
    assert (folder / "survey" / "site.toml").read_text() == (by_hand / "site.toml").read_text()
    floors = studio.get("/api/survey")["floors"]
    assert [floor["extent_m"] for floor in floors] == [pytest.approx([0, 20, 0, 10], abs=0.3)] * 2
    taken = refused(studio.client.post("/api/prepare/floors", json=ground))
    assert "has that floor already" in taken


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
