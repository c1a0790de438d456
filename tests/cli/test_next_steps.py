"""Every command ends with a step that can be taken, and prints its result as one JSON document where that is wanted."""

from __future__ import annotations

import ast
import json
import shlex
import string
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from PIL import Image

from tests.cli.command import vislam2tag
from tests.surveys import make_survey
from vislam2tag import cli
from vislam2tag.cli.app import COMMANDS, app
from vislam2tag.cli.next_steps import STEPS
from vislam2tag.quality.evaluation.metrics import ErrorSummary

NAMES = [name for group in COMMANDS.values() for name in group]
OF_SITE = ("init", "set", "renumber", "remove", "align", "show", "write", "rebase", "walkable")
OF_FLEET = ("add", "list", "process", "status", "report")
WHOLE_NAMES = [
    *(name for name in NAMES if name not in ("docs", "fleet", "site", "studio")),
    *(f"site {name}" for name in OF_SITE),
    *(f"fleet {name}" for name in OF_FLEET),
]
"""The studio and the documentation are pages: they print no result."""
GROUP: Any = typer.main.get_command(app)


def command_named(words: list[str]) -> Any:
    command = GROUP.get_command(None, words[0])
    return command.commands[words[1]] if words[0] in ("fleet", "site") else command


@pytest.mark.parametrize("name", WHOLE_NAMES)
def test_every_command_takes_json_and_has_a_next_step(name: str) -> None:
    (option,) = (each for each in command_named(name.split()).params if "--json" in each.opts)
    assert option.help == "Print one JSON document instead of text."
    assert any(step.partition(",")[0] == name for step in STEPS)


def test_every_step_is_told_and_none_else() -> None:
    told = set()
    for path in Path(cli.__path__[0]).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and node.value in STEPS and path.stem not in ("next_steps", "app"):
                told.add(node.value)
    kinds = {name for name in STEPS if name.startswith("site rebase, ")}
    assert told | kinds == set(STEPS)


@pytest.mark.parametrize("step", STEPS.values())
def test_a_step_is_a_command_that_there_is(step: str) -> None:
    start = step.find("vislam2tag ")
    if start < 0:
        return
    fields = {field: "1" for _, field, _, _ in string.Formatter().parse(step) if field}
    words = shlex.split(step[start:].partition("\n")[0].format(**fields).partition(" > ")[0])[1:]
    command = command_named(words)
    known = {name for each in command.params for name in each.opts}
    assert {word for word in words if word.startswith("--")} <= known
    required = {each.opts[-1] for each in command.params if each.required and each.param_type_name == "option"}
    assert required <= set(words), "nothing that it needs is left out"


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a survey of one short walk, its labels, a data set, a model and a table to label."""
    folder = tmp_path_factory.mktemp("json")
    make_survey(folder / "survey", devices=("LG",), seconds=40.0)
    for command in (
        ("process", folder / "survey", "--out", folder / "labels", "--jobs", "1"),
        ("dataset", folder / "labels", "--out", folder / "set", "--jobs", "1"),
        ("train", folder / "set", "--model", "weighted-knn", "--out", folder / "m.v2t"),
    ):
        assert vislam2tag(*command).returncode == 0
    times = "".join(f"{second}\n" for second in range(0, 40, 5))
    (folder / "table.csv").write_text(f"time_s\n{times}", encoding="utf-8")
    (folder / "scans.csv").write_text("scan_id,bssid,rssi_dbm\n1,06:00:00:00:00:01,-50\n", encoding="utf-8")
    plan = np.full((100, 200), 255, dtype=np.uint8)
    plan[[0, 1, -1, -2]] = plan[:, [0, 1, -1, -2]] = 0
    Image.fromarray(plan).save(folder / "plan.png")
    (folder / "tape.csv").write_text("landmark,to,distance_m\n1,A,2\n1,B,2\n1,C,2\n", encoding="utf-8")
    (folder / "targets.csv").write_text("name,x,y\nA,0,2\nB,2,0\nC,4,2\n", encoding="utf-8")
    return folder


NEW_FLOOR = "site init survey --plan plan.png --floor 5 --width-m 20"
RUNS = (
    "site show survey",
    "site write survey --out published",
    "site rebase survey --from survey --to survey --out same",
    "inspect survey",
    "sheets --ids 1 --out sheets",
    "register survey --tape tape.csv --targets targets.csv",
    "register survey --click clicks.html",
    "sightings survey --tags apriltag-36h11 --tag-side-m 0.16",
    "simulate made --floors 1 --devices 1 --sessions 1 --minutes 0.25",
    "run survey --out out --jobs 1",
    "process survey --out labels --jobs 1",
    "fleet add fleet survey",
    "fleet process fleet --dry-run --jobs 1",
    "fleet process fleet --jobs 1",
    "fleet list fleet",
    "fleet status fleet",
    "fleet report fleet",
    "process survey --out labels --jobs 1 --dry-run",
    "label table.csv --labels labels --clock boot --unit s --offset-s 0",
    "survey-landmarks survey --out completed.csv --jobs 1",
    "diagnose survey --jobs 1",
    "diagnose survey --revert",
    "check survey --jobs 1",
    "evaluate survey --out evaluated --jobs 1 --strategy smoother",
    "dataset labels --out set-again --jobs 1",
    "split set",
    "import exported --out imported",
    "export set --format parquet --out exported-again",
    "join set set --out joined",
    "verify labels labels",
    "figures set --out figures",
    "paper survey --out paper",
    NEW_FLOOR,
    "site walkable survey --floor 5 --out walkable",
    "receive survey scans.csv",
    "radio-maps set --out maps --most 1",
    "train set --model weighted-knn --out again.v2t",
    "locate m.v2t scans.csv --out positions.csv",
    "benchmark set --model weighted-knn --split random --out compared",
)


@pytest.mark.slow
@pytest.mark.parametrize("command", RUNS)
@pytest.mark.usefixtures("undrawn_figures")
def test_json_is_one_document(command: str, world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    if command.startswith("import"):
        assert vislam2tag("export", "set", "--format", "parquet", "--out", "exported").returncode == 0
    if command.startswith("site walkable") and not (world / "survey/floor_5").exists():  # another process has its test
        assert vislam2tag(*NEW_FLOOR.split()).returncode == 0
    done = vislam2tag(*command.split(), "--json")
    assert done.returncode in (0, 1, 3), done.stderr
    assert json.loads(done.stdout), "a document that holds something"


def test_the_demonstration_has_json_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    errors = ErrorSummary(10, 0.5, 0.1, 0.1, 0.1, 0.2, 0.3, float("nan"))
    monkeypatch.setattr("vislam2tag.api.demo", lambda *_, **__: {"smoother": errors})
    found = json.loads(vislam2tag("demo", tmp_path / "out", "--json").stdout)
    assert found["smoother"]["mean_m"] == 0.1
    assert found["smoother"]["max_m"] is None
    assert vislam2tag("demo", tmp_path / "out").stdout.splitlines()[-1].startswith("next: vislam2tag run ")
