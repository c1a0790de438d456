"""The tutorial docs/tutorials/first_survey.md, command by command, and plans in the other forms that people have."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.cli.three_plans import HEIGHT_M, WIDTH_M, draw
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.site.discover import read_site

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
PAGE = (TUTORIALS / "first_survey.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_plan_of_the_tutorial_is_the_office(tmp_path: Path) -> None:
    draw(tmp_path)
    assert (TUTORIALS / "office.svg").read_text() == (tmp_path / "ground.svg").read_text()


@pytest.mark.slow
def test_the_tutorial_ends_in_a_data_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What installs the program is left to test_readme.py and to `make release`."""
    shutil.copy(TUTORIALS / "office.svg", tmp_path)
    monkeypatch.chdir(tmp_path)
    lines = [shlex.split(line) for block in blocks("sh") for line in block.replace("\\\n", "").splitlines()]
    ours = [words for program, *words in lines if program == "vislam2tag"]
    assert [words[0] for words in ours] == ["site", "site", "plan", "sheets", "simulate", "inspect", "run"]
    printed = []
    for words in ours:
        done = vislam2tag(*words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        printed += done.stdout.splitlines()
    promised = [line for block in blocks("text") for line in block.splitlines()]
    assert [line for line in promised if line not in printed] == []
    for name in ("site.html", "plan/index.html", "sheets/sheets.pdf", "out/index.html"):
        assert f"`{name}`" in PAGE
        assert (tmp_path / name).is_file()
    dataset = open_dataset(tmp_path / "out" / "dataset")
    assert [floor.name for floor in dataset.info.floors] == ["Ground"]
    assert pl.read_csv(tmp_path / "plan" / "landmarks.csv").height == 3
    (code,) = blocks("python")
    done_python = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done_python.returncode == 0, done_python.stderr
    assert "rssi_dbm" in done_python.stdout


def test_a_plan_has_its_size_in_each_form(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw(tmp_path)
    monkeypatch.chdir(tmp_path)
    first = vislam2tag("site", "init", "survey", "--floor", "1", "--plan", "first.pdf", "--scale", "1:200")
    second = vislam2tag("site", "init", "survey", "--floor", "2", "--plan", "second.dxf")
    assert (first.returncode, second.returncode) == (0, 0)
    assert "the page has a frame" in first.stdout
    site, _ = read_site(tmp_path / "survey")
    for floor in site.floors:
        assert (floor.width_m, floor.height_m) == pytest.approx((WIDTH_M, HEIGHT_M), abs=1.1), floor.name
