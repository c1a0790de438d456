"""``vislam2tag plan`` as its users run it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.preparation.planning.floors import write_ring_site

@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ring_site(tmp_path_factory.mktemp("plan") / "site")


@pytest.mark.usefixtures("undrawn_figures")
def test_a_plan_is_written_and_told(site: Path, tmp_path: Path) -> None:
    done = vislam2tag("plan", site, "--out", tmp_path / "plan", "--further", "0")
    assert done.returncode == 0, done.stderr
    assert "Landmarks" in done.stdout
    assert "1 Floor 1" in done.stdout
    assert f"page: {tmp_path / 'plan' / 'index.html'}\n" in done.stdout
    assert len((tmp_path / "plan" / "landmarks.csv").read_text().splitlines()) == 7


@pytest.mark.usefixtures("undrawn_figures")
def test_a_file_says_where_walls_are_and_what_is_demanded(site: Path, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[walkable]\ncell_m = 0.2\n[plan]\nspacing_m = 10\nfurther = 0\n")
    words = ("--out", tmp_path / "plan", "--config", tmp_path / "own.toml", "--spacing-m", "12", "--json")
    printed = vislam2tag("plan", site, *words).stdout
    kept = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert json.loads(printed) == kept
    assert (kept["walkable"]["cell_m"], kept["settings"]["spacing_m"]) == (0.2, 12.0)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_demand_that_no_wall_meets_is_told_and_ends_with_1(site: Path, tmp_path: Path) -> None:
    forbidden = tmp_path / "glass.csv"
    forbidden.write_text("floor,x0,y0,x1,y1\n1,3.5,-1,26.5,3\n")
    done = vislam2tag("plan", site, "--out", tmp_path / "plan", "--further", "0", "--forbid", forbidden)
    assert done.returncode == 1
    assert "m without a wall for a sheet; put up a stand there" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--spacing-m", "0"), "--spacing-m 0.0"),
        (("--spacing-m", "1e308"), "--spacing-m 1e+308: Input should be less than or equal to 1000"),
        (("--view-deg", "0", "50"), "--view-deg 0 50: angles of view lie between 10 and 170 degrees"),
        (("--sheet", "B5"), "'B5' is no size of paper"),
        (("--floor", "9"), "--floor 9: the site has no such floor"),
        (("--forbid", "/none.csv"), "/none.csv: cannot be opened"),
    ],
)
def test_wrong_usage_is_told(site: Path, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    assert message in the_error(vislam2tag("plan", site, "--out", tmp_path / "plan", *arguments))
    assert not (tmp_path / "plan").exists()
