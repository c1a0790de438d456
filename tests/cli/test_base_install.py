"""What a base installation does, and what it says of the rest: the packages of all extras are hidden."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.surveys import make_survey
from vislam2tag.common import errors

ROOT = Path(__file__).parents[2]
HIDING = f"""
import sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {[package for packages in errors._EXTRAS.values() for package in packages]}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Hidden())
"""
"""What Python imports at its start (``sitecustomize``), in this process and in those that it starts."""
RUNNING = """
import sys
from vislam2tag.cli import main
for words in sys.argv[1].split(";"):
    sys.argv = ["vislam2tag", *words.split()]
    try:
        main()
    except SystemExit as end:
        print(words, "ended with", end.code)
"""
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 32"><rect width="60" height="32"/></svg>'
SITE = '[[floors]]\nnumber = 0\n[floors.plan]\nfile = "plan.svg"\nextent = {width_m = 60.0, height_m = 32.0}\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a survey whose plan is an SVG file; commands write beside it."""
    made = tmp_path_factory.mktemp("base")
    (made / "sitecustomize.py").write_text(HIDING, encoding="utf-8")
    survey = make_survey(made / "survey", devices=("LG",), seconds=60.0)
    (survey / "site.toml").write_text(SITE, encoding="utf-8")
    (survey / "plan.svg").write_text(SVG, encoding="utf-8")
    (made / "plan.ifc").write_text("ISO-10303-21;", encoding="utf-8")
    return made


def base(folder: Path, *commands: str) -> str:
    """What commands print, one after the other in one process."""
    path = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-u", "-c", RUNNING, ";".join(commands)]
    environment = {**os.environ, "PYTHONPATH": path}
    return subprocess.run(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=True
    ).stdout


def test_the_base_serves_from_simulating_to_a_data_set(folder: Path) -> None:
    commands = (
        "simulate another --floors 1 --devices 1 --sessions 1 --minutes 0.25",
        "inspect survey",
        "process survey --out labels --jobs 1",
        "check survey --jobs 1",
        "evaluate survey --out evaluated --jobs 1",
        "dataset labels --survey survey --out set --jobs 1",
    )
    said = base(folder, *commands)
    ends = [line for line in said.splitlines() if " ended with " in line]
    assert ends == [f"{each} ended with 0" for each in commands]


def test_a_plan_without_its_extra_is_a_finding(folder: Path) -> None:
    said = base(folder, "inspect survey", "process survey --out with_finding --jobs 1")
    assert "needs resvg_py: pip install 'vislam2tag[plans]'" in said
    assert "unreadable_plan 1" in said
    assert "process survey --out with_finding --jobs 1 ended with 0" in said


def test_a_walk_that_only_its_plan_could_place_names_the_extra(folder: Path) -> None:
    survey = make_survey(folder / "planned", devices=("LG",), seconds=30.0)
    (survey / "floor_0" / "marker_dict.csv").unlink()
    said = base(folder, "process planned --out unplaced --jobs 1", "diagnose planned --jobs 1")
    assert "the plan of floor 0 cannot place the walk: this needs cv2: pip install 'vislam2tag[prepare]'" in said
    assert "unusable_plan 1" in said
    assert "diagnose planned --jobs 1 ended with 3" in said


NEEDED = {
    "plan survey --out planned": "prepare",
    "sheets --ids 1-2 --out printed": "prepare",
    "site walkable survey --out walkable": "prepare",
    "site init modelled --plan plan.ifc": "ifc",
    "simulate walked --site survey": "prepare",
    "receive survey --port 0": "receive",
    "train set --model weighted-knn --out model.v2t": "positioning",
    "locate model.v2t scans.csv": "positioning",
    "benchmark set --model weighted-knn --out compared": "positioning",
    "radio-maps set --out maps": "positioning",
    "inspect s3://bucket/survey": "fleet",
}


def test_what_needs_an_extra_names_it(folder: Path) -> None:
    """Each command says one line and ends."""
    said = base(folder, *NEEDED).splitlines()
    assert len(said) == 2 * len(NEEDED)
    for (command, extra), message, end in zip(NEEDED.items(), said[::2], said[1::2], strict=True):
        assert f"pip install 'vislam2tag[{extra}]'" in message, command
        assert end == f"{command} ended with 2"


def test_extras_are_those_of_the_project_file() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {*errors._EXTRAS, "all", "docs"} == set(project["optional-dependencies"])
