"""The walk-through of docs/tutorials/first_survey.md, command by command, on three plans as people have them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.cli.three_plans import HEIGHT_M, WIDTH_M, draw
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.site.discover import read_site

DOCS = Path(__file__).parents[2] / "docs" / "tutorials" / "first_survey.md"


def commands() -> list[str]:
    blocks = re.findall(r"```sh\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


@pytest.mark.slow
def test_three_plans_end_in_a_data_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw(tmp_path)
    monkeypatch.chdir(tmp_path)
    said = {}
    for command in commands():
        program, *words = shlex.split(command)
        assert program == "vislam2tag"
        if words[0] == "label":
            trajectory = next((tmp_path / "out" / "labels" / "trajectory").glob("floor_0.LG.*.parquet"))
            begun_s = pl.read_parquet(trajectory)["time_ns"][100] / 1e9
            Path("co2.csv").write_text("time,ppm\n" + "".join(f"{begun_s + i},{400 + i}\n" for i in range(10)))
        done = vislam2tag(*words)
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        said[command] = done.stdout
    site, _ = read_site(tmp_path / "survey")
    for floor in site.floors:
        assert (floor.width_m, floor.height_m) == pytest.approx((WIDTH_M, HEIGHT_M), abs=1.1), floor.name
    assert any("the page has a frame" in text for text in said.values())
    dataset = open_dataset(tmp_path / "out" / "dataset")
    assert [floor.name for floor in dataset.info.floors] == ["Ground", "First", "Second"]
    labelled = dataset.fingerprints.filter(pl.col("status") == "ok").collect()
    assert set(labelled["floor"]) == {0, 1, 2}
    assert pl.read_csv(tmp_path / "co2-labelled.csv")["status"].to_list() == ["ok"] * 10
