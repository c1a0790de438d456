"""The example plug-in, built and installed: what it adds is in the command line, in its workers, and in Python."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error
from tests.cli.command import vislam2tag_process as vislam2tag
from tests.surveys import make_survey

PLUGIN = Path(__file__).parents[1] / "examples" / "plugin"


@pytest.fixture(scope="module", autouse=True)
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The plug-in installed into an empty folder, where this module's commands look."""
    folder = tmp_path_factory.mktemp("plugin")
    project = shutil.copytree(PLUGIN, folder / "project")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(build, cwd=project, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(folder / "site"), prepend=os.pathsep)
        yield folder / "site"


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ``process`` made by the plug-in's strategy in two processes."""
    survey = make_survey(tmp_path_factory.mktemp("labelled") / "survey", seconds=20.0)
    done = vislam2tag("process", survey, "--out", survey / "out", "--strategy", "first-sighting", "--jobs", "2")
    assert (done.returncode, done.stderr) == (0, "")
    return survey / "out"


def test_its_strategy_maps_in_every_process(labels: Path) -> None:
    frames = pl.read_parquet(labels / "trajectory")
    assert frames["session"].n_unique() == 2
    assert (frames["status"] == "ok").all()


def test_its_format_is_written(labels: Path, tmp_path: Path) -> None:
    done = vislam2tag("export", labels, "--format", "points-csv", "--out", tmp_path / "out", "--jobs", "2")
    assert done.returncode == 0, done.stderr
    assert pl.read_csv(tmp_path / "out" / "points.csv").columns == ["building", "floor", "x", "y"]


def test_help_and_errors_name_what_is_installed(tmp_path: Path) -> None:
    assert "first-sighting" in re.sub(r"-\n +", "-", vislam2tag("process", "--help").stdout)
    assert "points-csv" in re.sub(r"-\n +", "-", vislam2tag("export", "--help").stdout)
    message = the_error(vislam2tag("process", tmp_path, "--out", tmp_path / "out", "--strategy", "nonsense"))
    assert "first-sighting, floor-plan" in message


def test_python_has_it() -> None:
    code = "from vislam2tag.api import strategy_names; print(*strategy_names())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "first-sighting" in done.stdout.split()


def test_a_broken_package_ends_nothing_else(site: Path, labels: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken-1.0.dist-info"
    broken.mkdir()
    (broken / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (broken / "entry_points.txt").write_text(
        "[vislam2tag.strategies]\nworst = absent\n[vislam2tag.dataset_formats]\nnone = absent\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
        done = vislam2tag("export", labels, "--format", "tum", "--out", tmp_path / "out")
        assert done.returncode == 0
        assert done.stderr.count("the package broken cannot be loaded") == 1
        asked = the_error(vislam2tag("process", labels.parent, "--out", tmp_path / "new", "--strategy", "worst"))
    assert "the mapping strategy 'worst' of the package broken cannot be loaded" in asked


@pytest.mark.parametrize("module", ["points_csv", "first_sighting"])
def test_its_failures_are_reported_as_its_own(
    module: str, labels: Path, site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(site, tmp_path / "site")
    file = tmp_path / "site" / "vislam2tag_example" / f"{module}.py"
    lines = file.read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if "points = dataset" in line or "builder = " in line)
    lines[place] = "    " * (1 if module == "points_csv" else 2) + "points = builder = None + 1"
    file.write_text("\n".join(lines))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "site"), prepend=os.pathsep)
    kind = "TypeError: unsupported operand type(s) for +: 'NoneType' and 'int'"
    if module == "points_csv":
        done = vislam2tag("export", labels, "--format", "points-csv", "--out", tmp_path / "out")
        assert done.returncode != 0
        assert the_error(done).startswith(
            "error: the data set format 'points-csv' of the package vislam2tag-example failed at "
            f"points_csv.py:{place + 1}: {kind}"
        )
        return
    done = vislam2tag("process", labels.parent, "--out", tmp_path / "out", "--strategy", "first-sighting")
    assert done.returncode == 3
    failures = json.loads((tmp_path / "out" / "summary.json").read_text())["failures"]
    assert all(f"the strategy first-sighting failed at line {place + 1}: {kind}" in text for text in failures.values())
