"""Second thoughts about a site, as its users have them."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.cli.three_plans import draw
from vislam2tag.preparation.sheets.sheet_requests import requested_sheets


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plans")
    draw(folder)
    return folder


@pytest.fixture(scope="module")
def planned(plans: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site with one floor whose landmarks are planned; the plan's folder is beside it."""
    site = tmp_path_factory.mktemp("planned") / "site"
    words = ("--plan", plans / "second.dxf", "--floor", "1", "--name", "First floor", "--building", "Town hall")
    assert vislam2tag("site", "init", site, *words).returncode == 0
    done = vislam2tag("plan", site, "--further", "0", "--write", "--out", site.parent / "plan")
    assert done.returncode == 0, done.stderr
    return site


@pytest.fixture
def site(planned: Path, tmp_path: Path) -> Path:
    shutil.copytree(planned, tmp_path / "site")
    return tmp_path / "site"


@pytest.mark.usefixtures("undrawn_figures")
def test_sheets_name_building_floor_and_nearest_room(planned: Path) -> None:
    table = planned.parent / "plan" / "landmarks.csv"
    rows = pl.read_csv(table)
    assert set(rows["near"].to_list()) <= {f"room 0.{number:02d}" for number in range(1, 11)}
    assert "room 0.0" in (planned.parent / "plan" / "index.html").read_text()
    for source in (table, planned):
        for one in requested_sheets(source, None)[0]:
            assert (one.building, one.floor, one.floor_name) == ("Town hall", 1, "First floor")
            assert one.near.startswith("room 0.")
