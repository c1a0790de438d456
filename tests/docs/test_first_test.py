"""The first real test (docs/how-to/first-test.md): its commands score a survey of the files that it asks for."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.docs.named_tests import ROOT
from vislam2tag.quality.evaluation.truth import read_truth
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings, SessionLayout, WalkStyle, walk_settings
from vislam2tag.simulation.survey import WritingOptions, simulate

PAGE = (ROOT / "docs" / "how-to" / "first-test.md").read_text("utf-8")
TABLES = dict(re.findall(r"```csv\n# survey/(\S+)\n(.*?)```", PAGE, re.DOTALL))


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """What is there after the walks: the four tables of the page and a session of the phone app; no truth, no plan."""
    building = BuildingSettings(landmarks=12, width_m=40.0, height_m=24.0)
    plan = regular_survey(5, floors=(0,), devices=("Pixel",), sessions=1, duration_s=100.0, building=building)
    walk = replace(plan.sessions[0], walk=walk_settings(WalkStyle.CONTROL_POINTS), presses=True)
    root = tmp_path / "survey"
    simulate(replace(plan, sessions=(walk,)), root, WritingOptions(layout=SessionLayout.PHONE))
    floor, session = root / "floor_0", next((root / "floor_0" / "Pixel").iterdir())
    sheets = pl.read_csv(floor / "marker_dict.csv").with_columns(z=1.4, sigma_m=0.02)
    sheets.write_csv(floor / "marker_dict.csv")
    route = pl.DataFrame({"point": pressed_points(session, floor / "refmarker.csv")})
    route.write_csv(floor / "route.csv")
    for made in (session / "truth.csv", root / "simulation.json", floor / "floorplan.jpg"):
        made.unlink()
    return root


def pressed_points(session: Path, points: Path) -> list[int]:
    """Number of the control point at each press, by the truth."""
    truth = read_truth(session / "truth.csv")
    time_ns = pl.read_csv(session / "ControlPoint.csv")["time_ns"].to_numpy()
    where = np.column_stack([np.interp(time_ns, truth.time_ns, axis) for axis in truth.position_bcs.T])
    places = pl.read_csv(points, has_header=False).to_numpy()
    distance = np.linalg.norm(where[:, None] - places[None], axis=2)
    return [int(point) for point in distance.argmin(axis=1)]


def test_the_tables_of_the_page_are_those_that_are_scored(survey: Path) -> None:
    """The floor's size, the sheets, the crosses and their order have the columns that the page shows."""
    assert set(TABLES) == {
        path.relative_to(survey).as_posix() for path in survey.rglob("*.csv") if "Pixel" not in path.parts
    }
    for name, rows in TABLES.items():
        shown, scored = rows.splitlines(), (survey / name).read_text("utf-8").splitlines()
        if name != "floor_0/refmarker.csv":
            assert shown[0] == scored[0], name
        assert shown[1].count(",") == scored[1].count(","), name


def test_its_commands_score_the_survey_and_what_is_sent_names_no_network(
    survey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(survey.parent)
    (block,) = re.findall(r"## Score it.*?```sh\n(.*?)```", PAGE, re.DOTALL)
    commands = [shlex.split(line)[1:] for line in block.splitlines()]
    assert [words[0] for words in commands] == ["inspect", "evaluate", "check"]
    sent = ""
    for words in commands:
        done = vislam2tag(*words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        sent += done.stdout
    assert "Error at control points (identified)" in sent
    scored = pl.read_csv("result/sessions.csv").filter(strategy="smoother", truth="control_points", method="identified")
    assert scored["points"].item() == scored["labelled"].item() > 5
    assert scored["mean_m"].item() < 0.7, "a hand that presses while it walks is 0.3 to 0.4 m off by itself"
    heard = next(survey.rglob("WiFi.csv")).read_text("utf-8")
    addresses = set(re.findall(r"(?:[0-9a-f]{2}:){5}[0-9a-f]{2}", heard))
    assert addresses
    sent += "".join(path.read_text("utf-8") for path in Path("result").rglob("*") if path.is_file())
    assert not [address for address in addresses if address in sent]


def test_its_sheets_are_twelve(tmp_path: Path) -> None:
    (command,) = re.findall(r"^vislam2tag (sheets .*)$", PAGE, re.MULTILINE)
    words = shlex.split(command.replace("--out sheets", ""))
    done = vislam2tag(*words, "--out", tmp_path / "sheets")
    assert done.returncode == 0, done.stderr
    assert len(json.loads((tmp_path / "sheets" / "sheets.json").read_text("utf-8"))["images"]) == 12
