from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.site.walkable.hand_made import HEIGHT_M, MARGIN_M, WIDTH_M, plan
from vislam2tag.cli import main
from vislam2tag.common.errors import SurveyError
from vislam2tag.simulation.building.site_survey import site_floors
from vislam2tag.site.discover import read_site
from vislam2tag.site.walkable.settings import WalkableSettings

SIZE = f"{WIDTH_M + 2 * MARGIN_M},{HEIGHT_M + 2 * MARGIN_M}"
LANDMARKS = "id,x,y,heading_rad\n" + "".join(
    f"{n},{x},{y},{h}\n"
    for n, (x, y, h) in enumerate([(3.0, 11.1, 3.14), (9.5, 13.1, 0.0), (17.0, 13.1, 0.0), (23.0, 11.1, 3.14)], start=1)
)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    root = tmp_path / "site"
    (root / "floor_2").mkdir(parents=True)
    (root / "floor_dimensions.csv").write_text(f"id,width,height\n2,{SIZE}\n")
    (root / "floor_2" / "marker_dict.csv").write_text(LANDMARKS)
    Image.fromarray(plan(10).image).save(root / "floor_2" / "floorplan.png")
    return root


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["vislam2tag", "simulate", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_a_survey_on_a_site_takes_over_its_plan_and_landmarks(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "survey"
    assert run(monkeypatch, str(out), "--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.5") == 0
    simulated, findings = read_site(out)
    assert not findings
    original, _ = read_site(site)
    assert simulated.landmarks.position_bcs == pytest.approx(original.landmarks.position_bcs)
    plan_file = out / "floor_2" / "floorplan.png"
    assert plan_file.read_bytes() == (site / "floor_2" / "floorplan.png").read_bytes()
    truth = np.genfromtxt(next(out.rglob("truth.csv")), delimiter=",", names=True)
    assert 1 < truth["x"].min() < truth["x"].max() < 25


def test_the_same_options_give_the_same_bytes(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ("--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.25", "--seed", "5")
    for name in ("one", "two"):
        assert run(monkeypatch, str(tmp_path / name), *options) == 0
    for path in (tmp_path / "one").rglob("*.csv"):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()


def test_a_described_site_is_taken_over_as_such(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (site / "floor_dimensions.csv").unlink()
    extent = f"extent = {{ width_m = {SIZE.split(',')[0]}, height_m = {SIZE.split(',')[1]}, lower_left_m = [-50, 30] }}"
    plan_table = f'[floors.plan]\nfile = "floor_2/floorplan.png"\n{extent}\n'
    (site / "site.toml").write_text(f"[[floors]]\nnumber = 2\nelevation_m = 8.0\n\n{plan_table}")
    moved = LANDMARKS.splitlines()
    rows = [row.split(",") for row in moved[1:]]
    text = "\n".join([moved[0], *(f"{n},{float(x) - 50},{float(y) + 30},{h}" for n, x, y, h in rows)])
    (site / "floor_2" / "marker_dict.csv").write_text(text + "\n")
    out = tmp_path / "survey"
    assert (
        run(monkeypatch, str(out), "--site", str(site), "--devices", "1", "--sessions", "1", "--minutes", "0.25") == 0
    )
    assert (out / "site.toml").read_bytes() == (site / "site.toml").read_bytes()
    assert not (out / "floor_dimensions.csv").exists()
    truth = np.genfromtxt(next(out.rglob("truth.csv")), delimiter=",", names=True)
    assert -50 < truth["x"].min() < truth["x"].max() < -24


def test_landmarks_of_a_plan_replace_the_sites_own(site: Path, tmp_path: Path) -> None:
    planned = tmp_path / "landmarks.csv"
    planned.write_text(
        "id,floor,x,y,z,heading_rad,sheet,width_m\n7,2,3,11.1,1.4,3.14,A3,0.277\n8,2,17,13.1,1.4,0,A4,0.19\n"
    )
    (floor,) = site_floors(site, landmark_file=planned)
    assert floor.landmarks.ids == ("7", "8")
    assert floor.landmarks.width_m.tolist() == [0.277, 0.19]


def test_a_mask_corrects_one_floor(site: Path, tmp_path: Path) -> None:
    mask = np.full((22, 26, 3), 255, dtype=np.uint8)
    mask[-10:] = (255, 0, 0)
    Image.fromarray(mask).save(tmp_path / "mask.png")
    (free,), (masked,) = site_floors(site), site_floors(site, masks={2: tmp_path / "mask.png"})
    assert masked.space.area.mask.sum() < free.space.area.mask.sum()


def test_settings_of_walkable_space_count(site: Path) -> None:
    (floor,) = site_floors(site, settings=WalkableSettings(cell_m=0.25))
    assert floor.space.area.cell_m == 0.25


def test_a_floor_that_is_not_there_is_told(site: Path) -> None:
    with pytest.raises(SurveyError, match="has no floor 3; there are: 2"):
        site_floors(site, [3])


@pytest.mark.parametrize("options", [("--like", "paper"), ("--climb", "stairs"), ("--mask", "x.png")])
def test_options_that_contradict_each_other(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), "--site", str(site), *options) == 2


def test_options_of_a_site_need_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), "--floor", "2") == 2
